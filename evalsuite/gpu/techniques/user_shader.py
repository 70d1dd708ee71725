"""A user's own technique from one GLSL file: `evalsuite run -t my.glsl`.

The file defines `vec3 shade(Surface s)`. Its `uniform float|int|bool|vec3 name = value; // meaning` lines become parameters
(`-p name=…`); everything else it may use stands in docs/adding-a-technique.md. An optional `my.toml` beside it says what it
is called and which BSDF it is held against.
"""

from __future__ import annotations

import re
import tomllib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import common, rough_conductor
from evalsuite.gpu.techniques.base import Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import phong
from evalsuite.scene.model import Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

KEYS = ("title", "paper", "equations", "assumptions", "bsdf", "target")

_UNIFORM = re.compile(
    r"^\s*uniform\s+(?P<type>float|int|bool|vec3)\s+(?P<name>\w+)\s*(?:=\s*(?P<value>[^;]+?)\s*)?;[ \t]*(?://\s*(?P<meaning>.*))?$",
    re.M,
)
_PARSERS = {
    "float": (common.number(), "a number"),
    "int": (common.integer(-(1 << 31), (1 << 31) - 1), "a whole number"),
    "bool": (lambda value: {"true": True, "1": True, "false": False, "0": False}[str(value).lower()], "true or false"),
    "vec3": (common.rgb, "one number or three, not negative"),
}


_GIVEN = (
    rough_conductor.ALPHA,
    rough_conductor.DISTRIBUTION,
    rough_conductor.ETA,
    rough_conductor.K,
    Parameter("time", 0.0, "what the uniform `time` holds [s]", "technique", common.number(), "a number"),
    common.FACE_SIZE,
)
#: What evalsuite declares itself, as uniforms or as parameters.
_TAKEN = {p.name for p in (*common.bsdf_parameters("phong"), *_GIVEN)} | {"env_face_size", "env_max_level", "camera_position",
                                                                         "camera_axis", "two_sided", "scored"}  # fmt: skip


def load(path: Path) -> Technique:
    """The technique of a GLSL file. Raises EvalsuiteError for a file or definition that cannot be used."""
    path = path.absolute()
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        got = getattr(error, "strerror", None) or str(error)
        raise EvalsuiteError(path, got, "a readable GLSL file in UTF-8", "check the path") from error
    about = _definition(path.with_suffix(".toml"))
    bsdf, own = str(about.get("bsdf", "phong")), _own_parameters(path, text)
    return Technique(
        id=path.stem,
        title=str(about.get("title", path.stem)),
        paper=str(about.get("paper", "a shader of yours")),
        equations=str(about.get("equations", f"shade() in {path.name}")),
        parameters=(
            *common.bsdf_parameters(bsdf, tuple(common.OF_PLUGIN)),
            *_GIVEN,
            *own,
        ),
        assumptions=tuple(str(line) for line in about.get("assumptions", ("Not stated.",))),
        stands_for={plugin: StandsFor(f"{plugin} as it is", everything) for plugin in common.OF_PLUGIN},
        target_bsdf=common.named_target,
        shader=path,
        prepare=partial(prepare, _uses(text), frozenset(p.name for p in own)),
        twin=None,
        target=str(about.get("target", "unoccluded")),
        library=("sh.glsl", "user.glsl"),
        fill=common.fill_face_size,
        path=path,
    )  # fmt: skip


def _definition(path: Path) -> dict[str, object]:
    if not path.exists():
        return {}
    try:
        about = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise EvalsuiteError(path, str(error), "a TOML file", "mend the file there") from error
    strange = sorted(set(about) - set(KEYS))
    if strange:
        raise EvalsuiteError(path, f"unknown key '{strange[0]}'", f"one of {', '.join(KEYS)}", "rename or remove it")
    if not isinstance(about.get("assumptions", []), list):
        raise EvalsuiteError(f"{path}, assumptions", repr(about["assumptions"]), "a list of sentences")
    if str(about.get("bsdf", "phong")) not in common.OF_PLUGIN:
        raise EvalsuiteError(f"{path}, bsdf", repr(about["bsdf"]), f"one of {', '.join(common.OF_PLUGIN)}")
    return about


def _own_parameters(path: Path, text: str) -> list[Parameter]:
    """A parameter for each uniform of a plain type that the file declares; its initial value is the default."""
    own = []
    for found in _UNIFORM.finditer(text):
        kind, name = found["type"], found["name"]
        parse, expected = _PARSERS[kind]
        line = text.count("\n", 0, found.start("name")) + 1
        if name in _TAKEN or name in (p.name for p in own):
            raise EvalsuiteError(f"{path}:{line}", f"`{found[0].strip()}`", "a name that is not declared yet",
                                 "remove the line if you mean evalsuite's, else rename it")  # fmt: skip
        initial = re.sub(r"^vec3\s*\(|\)$", "", found["value"]) if found["value"] else "0"
        try:
            default = parse(initial)
        except (KeyError, TypeError, ValueError) as error:
            raise EvalsuiteError(f"{path}:{line}", f"`{found[0].strip()}`", f"an initial value that is {expected}",
                                 "write it out as numbers") from error  # fmt: skip
        own.append(Parameter(name, default, (found["meaning"] or f"uniform {kind} {name}").strip(), "technique", parse, expected))
    return own


def _uses(text: str) -> frozenset[str]:
    """Which of the costlier tables a shader reads."""
    wanted = {"sh": r"\b(irradiance|sh)\b", "brdf_table": r"\bbrdf_table\b"}
    return frozenset(name for name, pattern in wanted.items() if re.search(pattern, text))


def everything(material: Material, settings: Settings) -> dict[str, object]:
    """Every uniform of a material; what its plugin lacks is 0, or the equivalent of what it has."""
    none = {"diffuse_reflectance": (0.0, 0.0, 0.0), "specular_reflectance": (0.0, 0.0, 0.0), "exponent": 0.0, "alpha": 1.0,
            "eta": (0.0, 0.0, 0.0), "k": common.WHITE}  # fmt: skip
    if material.plugin == "diffuse":
        return none | common.diffuse_uniforms(material, settings)
    if material.plugin == "conductor":
        return none | common.conductor_uniforms(material, settings) | {"exponent": 1e7, "alpha": 0.0}
    if material.plugin == "roughconductor":
        return none | rough_conductor.uniforms(material, settings) | common.rough_conductor_uniforms(material, settings)
    lobe = common.lobe_uniforms(material, settings)
    return none | lobe | {"alpha": float(phong.exponent_to_alpha(lobe["exponent"]))}


def prepare(uses: frozenset[str], own: frozenset[str], env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The map and its cubemap always, SH coefficients and the BRDF table where the shader reads them, the file's own uniforms."""
    cube = common.prepare_cube(env, settings, scene)
    uniforms = {**env.uniforms, **cube.uniforms, "time": settings["time"], **{name: settings[name] for name in own}}
    textures, elapsed = {"env_latlong": env.latlong, **cube.textures}, cube.prepare_ms
    if "sh" in uses:
        coefficients, projecting = common.sh9(env, settings["face_size"])
        uniforms, elapsed = {**uniforms, **coefficients}, elapsed + projecting
    if "brdf_table" in uses:
        from evalsuite.gpu.prefilter import brdf_table

        textures["brdf_table"] = brdf_table.texture()
    return Prepared(uniforms, textures, elapsed, cube.notes)
