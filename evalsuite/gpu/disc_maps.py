"""Dual paraboloid and sphere maps of an environment on the GPU, made from its lat-long texture by compute shaders."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import context, programs
from evalsuite.gpu.environment import LUMINANCE, GpuEnvironment
from evalsuite.math import disc_map, paraboloid, sphere_map
from evalsuite.math.sphere import latlong_spacing

Mips = Literal["none", "box", "weighted"]
_LOOKUPS = 4_000_000  # a dispatch, so that no driver's watchdog sees a long one


@dataclass(eq=False)
class DiscMaps:
    """Float32 RGBA textures clamped to the edge: (front, back) of a dual paraboloid map, or one sphere map. Alpha is 1 where a
    texel's centre lies in the circle (or its ring). size, border [texels of level 0]. energy_residual: (∫map − ∫lat-long) /
    ∫lat-long of luminance (0 for a black map)."""

    textures: tuple[moderngl.Texture, ...]
    size: int
    border: float
    energy_residual: float
    prepare_ms: float

    @cached_property
    def level0(self) -> NDArray[np.float32]:
        """(1 or 2, n, n, 4) float32 read back."""
        return self.read(0)

    def read(self, level: int) -> NDArray[np.float32]:
        """(1 or 2, n, n, 4) float32 of a level, read back."""
        n = self.size >> level
        return np.stack([np.frombuffer(t.read(level, alignment=1), np.float32).reshape(n, n, 4) for t in self.textures])

    def release(self) -> None:
        """Free the textures."""
        for texture in self.textures:
            texture.release()


def paraboloids(env: GpuEnvironment, size: int, border: float, ring: float, mips: Mips) -> DiscMaps:
    """The environment's dual paraboloid maps about the world's z axis, made once. size: power of two, border included.

    ring: alpha is 1 up to so many texels beyond the circle. mips: none, the hardware's plain box, or weighted by solid angle.
    Raises EvalsuiteError for a size that cannot be.
    """
    return env.kept(("paraboloids", size, border, ring, mips), lambda: _paraboloids(env, size, border, ring, mips))


def _paraboloids(env: GpuEnvironment, size: int, border: float, ring: float, mips: Mips) -> DiscMaps:
    gl, start = context.get(), time.perf_counter()
    if size < 8 or size & (size - 1) or not 0 <= border <= size / 4:
        where = f"paraboloid map of {size}² texels, border {border:g}"
        raise EvalsuiteError(where, "no usable size", "a power of two from 8, and a border up to a quarter of it")
    textures = tuple(_texture(size, chain=mips != "none") for _ in (paraboloid.FRONT, paraboloid.BACK))
    k = paraboloid.subsamples_per_texel(size, border, latlong_spacing(*env.shape))
    _resample(env, textures, border, ring, np.eye(3), {"subsamples": k}, {}, k * k)
    if mips == "box":
        for texture in textures:
            texture.build_mipmaps()
    elif mips == "weighted":
        _weighted_mips(textures, size, border, ring)
    for texture in textures:
        texture.filter = (moderngl.LINEAR if mips == "none" else moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    gl.finish()
    context.check_errors("resampling the environment to paraboloid maps")
    maps = DiscMaps(textures, size, border, 0.0, 1e3 * (time.perf_counter() - start))
    maps.energy_residual = _residual(env, paraboloid.integral(maps.level0[..., :3], border))
    return maps


def sphere(env: GpuEnvironment, size: int, border: float, view: tuple[float, float, float]) -> DiscMaps:
    """The environment's sphere map for the viewing direction v₀ = view (towards the viewer), made once."""
    return env.kept(("sphere", size, border, view), lambda: _sphere(env, size, border, view))


def _sphere(env: GpuEnvironment, size: int, border: float, view: tuple[float, float, float]) -> DiscMaps:
    gl, start = context.get(), time.perf_counter()
    texture = _texture(size)
    counts = sphere_map.subsamples(size, border, latlong_spacing(*env.shape))
    table = gl.texture((size, size), 1, counts.astype(np.int32).tobytes(), dtype="i4", alignment=1)
    table.filter = (moderngl.NEAREST, moderngl.NEAREST)
    frame = sphere_map.frame(view)
    mean = int(np.ceil((counts.astype(np.float64) ** 2).mean(1).max()))  # of the costliest row
    _resample(env, (texture,), border, 0.0, frame, {}, {"counts": table}, mean, {"SPHERE_MAP": 1})
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    gl.finish()
    table.release()
    context.check_errors("resampling the environment to a sphere map")
    maps = DiscMaps((texture,), size, border, 0.0, 1e3 * (time.perf_counter() - start))
    maps.energy_residual = _residual(env, sphere_map.integral(maps.level0[0, ..., :3], border))
    return maps


def _texture(size: int, chain: bool = False) -> moderngl.Texture:
    context.check_texture_size("map", size, size)
    texture = context.get().texture((size, size), 4, dtype="f4")
    if chain:
        texture.build_mipmaps()  # allocated before level 0 is first written as an image: Mesa loses later levels' stores else
    texture.repeat_x = texture.repeat_y = False
    return texture


def _resample(
    env: GpuEnvironment,
    textures: tuple[moderngl.Texture, ...],
    border: float,
    ring: float,
    map_to_world: NDArray[np.float64],
    uniforms: dict[str, object],
    inputs: dict[str, object],
    lookups_per_texel: int,
    defines: dict[str, object] | None = None,
) -> None:
    gl, size = context.get(), textures[0].width
    parts = (programs.part("latlong.glsl"), programs.part("resample_disc.comp"))
    shader = programs.compute(parts, tuple((defines or {}).items()))
    programs.set_uniforms(shader, {
        **env.uniforms, **uniforms, "map_to_world": map_to_world, "radius": 0.5 * size - border,
        "marked": disc_map.circle_limit(size, border, ring),
    })  # fmt: skip
    programs.bind_textures(shader, {"env_latlong": env.latlong, **inputs})
    for unit, texture in enumerate(textures):
        texture.bind_to_image(unit, read=False, write=True, level=0)
    rows = max(8, (_LOOKUPS // (len(textures) * size * lookups_per_texel)) // 8 * 8)
    for first in range(0, size, rows):
        programs.set_uniforms(shader, {"first_row": first})
        shader.run((size + 7) // 8, (min(rows, size - first) + 7) // 8, len(textures))
        gl.finish()
    gl.memory_barrier()


def _weighted_mips(textures: tuple[moderngl.Texture, ...], size: int, border: float, ring: float) -> None:
    gl = context.get()
    shader = programs.compute((programs.part("halve_weighted.comp"),))
    for level in range(1, size.bit_length()):
        finer, shrunk = size >> (level - 1), 2.0 ** (1 - level)
        omega = paraboloid.texel_solid_angles(finer, border * shrunk, inside=False)
        weights = gl.texture((finer, finer), 1, (omega / omega.max()).astype(np.float32).tobytes(), dtype="f4", alignment=1)
        weights.filter = (moderngl.NEAREST, moderngl.NEAREST)
        marked = disc_map.circle_limit(finer // 2, 0.5 * border * shrunk, ring)
        programs.set_uniforms(shader, {"marked": marked})
        programs.bind_textures(shader, {"weights": weights})
        for texture in textures:
            texture.bind_to_image(0, read=True, write=False, level=level - 1)
            texture.bind_to_image(1, read=False, write=True, level=level)
            shader.run((finer // 2 + 7) // 8, (finer // 2 + 7) // 8, 1)
        gl.memory_barrier()
        weights.release()


def _residual(env: GpuEnvironment, integral: NDArray[np.float64]) -> float:
    whole = float(env.integral @ LUMINANCE)
    return float(integral @ LUMINANCE) / whole - 1.0 if whole > 0.0 else 0.0
