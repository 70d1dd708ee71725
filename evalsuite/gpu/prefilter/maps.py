"""Prefiltered maps made by compute shader: cubemaps whose levels, and volumes of octahedral maps whose layers, are each the
environment filtered with a lobe of its own. How a lobe is summed is a `Filter`: sampled.py, tree.py."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import moderngl

from evalsuite.gpu import context, programs

_LOOKUPS = 4_000_000  # a dispatch, so that no driver's watchdog sees a long one


class Filter(Protocol):
    """One lobe and the way it is summed. parts, defines: GLSL files that define main() after filter_target.glsl."""

    parts: Sequence[str]
    defines: programs.Defines

    def bind(self, shader: moderngl.ComputeShader) -> int:
        """Set the shader up; returns about how many look-ups a texel takes."""

    def release(self) -> None:
        """Free its buffers; whoever makes a map of it does so."""


@dataclass(eq=False)
class Prefiltered:
    """A filtered map and the milliseconds that making it took."""

    texture: moderngl.TextureCube | moderngl.Texture3D | moderngl.TextureArray
    prepare_ms: float

    def release(self) -> None:
        """Free the texture."""
        self.texture.release()


def to_cube(width: int, filters: Sequence[Filter]) -> Prefiltered:
    """A cubemap whose level k, (width / 2^k)² texels a face, is filtered by filters[k]; coarser levels stay undefined."""
    gl, start = context.get(), time.perf_counter()
    texture = gl.texture_cube((width, width), 4, dtype="f4")
    texture.build_mipmaps()  # allocates the chain
    for level, one in enumerate(filters):
        shader = _shader(one)
        texture.bind_to_image(0, read=False, write=True, level=level)
        dispatch(shader, width >> level, 6, one.bind(shader))
        one.release()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    return finished(texture, start)


def to_octahedral(width: int, filters: Sequence[Filter]) -> Prefiltered:
    """A volume of octahedral maps with borders (math.octahedral), layer k by filters[k]; linear in all three axes."""
    gl, start = context.get(), time.perf_counter()
    texture = gl.texture3d((width + 2, width + 2, len(filters)), 4, dtype="f4")
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.bind_to_image(0, read=False, write=True)
    for layer, one in enumerate(filters):
        shader = _shader(one, (("OCTAHEDRAL", 1),))
        programs.set_uniforms(shader, {"layer": layer})
        dispatch(shader, width + 2, 1, one.bind(shader))
        one.release()
    return finished(texture, start)


def _shader(one: Filter, defines: programs.Defines = ()) -> moderngl.ComputeShader:
    names = ("library/octahedral.glsl", "library/cube_faces.glsl", "library/filter_target.glsl", *one.parts)
    return programs.compute(tuple(programs.part(name) for name in names), (*defines, *one.defines))


def dispatch(shader: moderngl.ComputeShader, width: int, depth: int, lookups: int) -> None:
    """Run over width² × depth texels, `lookups` each, in strips of rows."""
    rows = max(8, (_LOOKUPS // (depth * width * max(lookups, 1))) // 8 * 8)
    for first in range(0, width, rows):
        programs.set_uniforms(shader, {"first_row": first})
        shader.run((width + 7) // 8, (min(rows, width - first) + 7) // 8, depth)


def finished(texture: moderngl.TextureCube | moderngl.Texture3D | moderngl.TextureArray, start: float) -> Prefiltered:
    """The map, once the GPU is done with it."""
    gl = context.get()
    gl.memory_barrier()
    gl.finish()
    context.check_errors("prefiltering the environment")
    return Prefiltered(texture, 1e3 * (time.perf_counter() - start))
