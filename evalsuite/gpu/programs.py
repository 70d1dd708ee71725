"""GLSL sources into programs: assembled from named parts, cached, and with compile errors told in the user's own lines."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import moderngl
import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import context

GLSL = Path(__file__).parent / "glsl"
Defines = tuple[tuple[str, object], ...]


@dataclass(frozen=True)
class Part:
    """One GLSL file's text under its name. own: a technique's, not the library's."""

    name: str
    text: str
    own: bool = False


@lru_cache(maxsize=64)
def part(name: str) -> Part:
    """A file of `gpu/glsl` by name."""
    return Part(name, (GLSL / name).read_text(encoding="utf-8"))


def read_part(path: Path) -> Part:
    """A technique's file, read anew each time (a user may be editing it). Raises EvalsuiteError."""
    try:
        return Part(str(path), path.read_text(encoding="utf-8"), own=True)
    except (OSError, UnicodeDecodeError) as error:
        raise EvalsuiteError(path, str(error), "a readable GLSL file in UTF-8", "check the path") from error


def _numbered(parts: Sequence[Part]) -> dict[int, Part]:
    """Source-string numbers. The technique's own file is 0: Mesa puts some errors under 0 whatever `#line` said."""
    return {0 if item.own else index + 1: item for index, item in enumerate(parts)}


def _assemble(parts: Sequence[Part], defines: Defines) -> str:
    head = ["#version 430 core", *(f"#define {name} {value}" for name, value in defines)]
    # `#line n i`: messages then carry source string i and its own line numbers.
    body = [f"#line 1 {number}\n{item.text}" for number, item in _numbered(parts).items()]
    return "\n".join([*head, *body, ""])


# Mesa "2:12(5): error: …" (also "preprocessor error: …") and "error: …"; NVIDIA "2(12) : error C0000: …";
# AMD and Apple "ERROR: 2:12: …".
_MESSAGES = (
    re.compile(r"^(?P<part>\d+):(?P<line>\d+)\(\d+\): (?:preprocessor )?error: (?P<text>.*)$", re.M),
    re.compile(r"^(?P<part>\d+)\((?P<line>\d+)\) : error (?P<text>.*)$", re.M),
    re.compile(r"^ERROR: (?P<part>\d+):(?P<line>\d+): (?P<text>.*)$", re.M),
)


def _compile_error(message: str, parts: Sequence[Part], fallback: str) -> EvalsuiteError:
    hits = [hit for pattern in _MESSAGES for hit in pattern.finditer(message)]
    if not hits:
        text = " ".join(message.replace("=", " ").split())
        return EvalsuiteError(fallback, f"GLSL error: {text}", "a shader that compiles and links", "mend the shader")
    hit = min(hits, key=lambda h: h.start())
    source, line = _numbered(parts).get(int(hit["part"]), parts[-1]), int(hit["line"])
    lines = source.text.splitlines()
    quoted = lines[line - 1].strip() if 0 < line <= len(lines) else ""
    return EvalsuiteError(
        f"{source.name}:{line}", f"GLSL error: {hit['text'].strip()}, in `{quoted}`", "GLSL 4.30", "mend that line"
    )


@lru_cache(maxsize=128)
def program(
    vertex: tuple[Part, ...], fragment: tuple[Part, ...], defines: Defines = (), geometry: tuple[Part, ...] = ()
) -> moderngl.Program:
    """Compiled and linked program. Raises EvalsuiteError naming file, line and the line's text."""
    gl = context.get()
    stages = {"vertex_shader": vertex, "geometry_shader": geometry, "fragment_shader": fragment}
    try:
        return gl.program(**{name: _assemble(parts, defines) for name, parts in stages.items() if parts})
    except (moderngl.Error, KeyError) as error:  # KeyError: an #include, of which there are none
        stage = next((parts for name, parts in stages.items() if parts and name in str(error)), fragment)
        raise _compile_error(str(error), stage, stage[-1].name) from error


@lru_cache(maxsize=16)
def compute(parts: tuple[Part, ...], defines: Defines = ()) -> moderngl.ComputeShader:
    """Compiled compute shader, with errors as `program`."""
    try:
        return context.get().compute_shader(_assemble(parts, defines))
    except (moderngl.Error, KeyError) as error:  # KeyError: an #include, of which there are none
        raise _compile_error(str(error), parts, parts[-1].name) from error


def technique_program(
    shader: Path, *, library: Sequence[str] = (), vertex_stage: bool = False, defines: Mapping[str, object]
) -> moderngl.Program:
    """The forward-shading program of a technique's GLSL file.

    shader: defines `vec3 shade(Surface s)`; with vertex_stage also `vec3 shade_vertex(vec3 normal)`. library: files of
    gpu/glsl/library that it uses. Raises EvalsuiteError.
    """
    own = read_part(shader)
    for function in ["shade", *(["shade_vertex"] if vertex_stage else [])]:
        if not re.search(rf"\bvec3\s+{function}\s*\(", own.text):
            raise EvalsuiteError(shader, f"no function `{function}`", f"`vec3 {function}(…)`", "define it")
    settings = tuple(sorted({**defines, **({"VERTEX_STAGE": 1} if vertex_stage else {})}.items()))
    always = (part("surface.glsl"), part("fresnel.glsl"), part("latlong.glsl"))
    before = (*always, *(part(f"library/{name}") for name in library))
    vertex = (*before, own, part("surface.vert")) if vertex_stage else (part("surface.vert"),)
    return program(vertex, (*before, own, part("material.glsl"), part("main.frag")), settings)


def set_uniforms(target: moderngl.Program | moderngl.ComputeShader, values: Mapping[str, object]) -> None:
    """Set the uniforms that the program kept; arrays are row-major (r, c) matrices, colours and vectors any sequence."""
    for name, value in values.items():
        member = target.get(name, None)
        if not isinstance(member, moderngl.Uniform):
            continue
        if isinstance(value, np.ndarray) and value.ndim == 2 and member.dimension in (9, 16):
            member.write(np.ascontiguousarray(value.T, dtype=np.float32).tobytes())
        elif isinstance(value, np.ndarray):
            member.write(np.ascontiguousarray(value, dtype=np.float32).tobytes())
        else:
            member.value = tuple(value) if isinstance(value, list) else value


def bind_textures(target: moderngl.Program | moderngl.ComputeShader, textures: Mapping[str, object]) -> None:
    """Bind each texture to a unit of its own and point the sampler of that name at it."""
    for unit, (name, texture) in enumerate(sorted(textures.items())):
        if isinstance(target.get(name, None), moderngl.Uniform):
            texture.use(unit)
            target[name].value = unit
