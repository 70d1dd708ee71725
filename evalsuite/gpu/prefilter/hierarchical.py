"""Phong-prefiltered dual paraboloid maps with two small kernels, by compute shaders: `math.hierarchical` on the GPU."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np

from evalsuite.gpu import context, disc_maps, programs
from evalsuite.gpu.environment import GpuEnvironment
from evalsuite.math import hierarchical

_TAPS_A_DISPATCH = 8_000_000  # no driver's watchdog sees a long one


@dataclass(frozen=True, eq=False)
class HierarchicalMaps:
    """textures: prefiltered front and back map, (n, n). widths: texels across the two kernels, S's and L's. levels: their MIP
    levels."""

    textures: tuple[moderngl.Texture, moderngl.Texture]
    widths: tuple[int, int]
    levels: tuple[int, int]
    prepare_ms: float

    def release(self) -> None:
        """Free the textures."""
        for texture in self.textures:
            texture.release()


def hierarchical_maps(
    env: GpuEnvironment, exponent: float, cutoff: float, taps: int, size: int, border: float
) -> HierarchicalMaps:
    """The maps of an environment, made once. size: power of two, border included [texels]. Raises EvalsuiteError for sizes."""
    key = ("hierarchical", exponent, cutoff, taps, size, border)
    return env.kept(key, lambda: _make(env, exponent, cutoff, taps, size, border))


def _texture(size: int, components: int = 4, data: bytes | None = None) -> moderngl.Texture:
    texture = context.get().texture((size, size), components, data, dtype="f4", alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def _make(env: GpuEnvironment, exponent: float, cutoff: float, taps: int, size: int, border: float) -> HierarchicalMaps:
    source = disc_maps.paraboloids(env, size, border, 0.0, "weighted")
    start, circle = time.perf_counter(), 0.5 * size - border
    kernels, levels = [], []
    for which in (hierarchical.SMALL, hierarchical.LARGE):
        level = hierarchical.filter_level(which, exponent, cutoff, circle, taps, size)
        kernels.append(hierarchical.kernel(which, exponent, cutoff, circle / 2.0**level))
        levels.append(level)
    textures = tuple(_one(texture, kernels, levels, circle) for texture in source.textures)
    context.get().finish()
    context.check_errors("filtering the paraboloid maps")
    elapsed = source.prepare_ms + 1e3 * (time.perf_counter() - start)
    return HierarchicalMaps(textures, tuple(len(k) for k in kernels), tuple(levels), elapsed)


def _one(source: moderngl.Texture, kernels: list[np.ndarray], levels: list[int], circle: float) -> moderngl.Texture:
    """S, L and their blend for one map."""
    both = [_filter(source, kernel, level) for kernel, level in zip(kernels, levels, strict=True)]
    result, gl = _texture(source.width), context.get()
    shader = programs.compute((_part("paraboloid_blend.comp"),))
    programs.set_uniforms(shader, {"circle": circle})
    programs.bind_textures(shader, {"small": both[0], "large": both[1]})
    result.bind_to_image(0, read=False, write=True)
    shader.run((source.width + 7) // 8, (source.width + 7) // 8)
    gl.memory_barrier()
    gl.finish()
    for texture in both:
        texture.release()
    return result


def _filter(source: moderngl.Texture, kernel: np.ndarray, level: int) -> moderngl.Texture:
    gl, size = context.get(), source.width >> level
    result, weights = _texture(size), _texture(len(kernel), 1, kernel.astype(np.float32).tobytes())
    shader = programs.compute((_part("paraboloid_filter.comp"),))
    programs.bind_textures(shader, {"map": source, "weights": weights})
    result.bind_to_image(0, read=False, write=True)
    rows = max(8, _TAPS_A_DISPATCH // (size * kernel.size) // 8 * 8)
    for first in range(0, size, rows):
        programs.set_uniforms(shader, {"level": level, "first_row": first})
        shader.run((size + 7) // 8, (min(rows, size - first) + 7) // 8)
        gl.finish()
    gl.memory_barrier()
    weights.release()
    return result


def _part(name: str) -> programs.Part:
    return programs.read_part(Path(__file__).with_name(name))
