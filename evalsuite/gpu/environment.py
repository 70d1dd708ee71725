"""An environment on the GPU: the lat-long texture that Mitsuba's envmap is, cubemaps resampled from it, and its tables
for importance sampling."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import TypeVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import context, programs
from evalsuite.math import cubemap
from evalsuite.math.sphere import latlong_solid_angles
from evalsuite.scene.model import Environment

T = TypeVar("T")

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Rec.709, linear
_CACHED_DERIVED = 12
_CACHED = 3  # environments kept: a 1024² cube is 134 MB


@dataclass(eq=False)
class Cube:
    """A float32 RGBA cubemap with hardware-made MIPs. energy_residual: (∫cube − ∫lat-long)/∫lat-long of luminance, what
    resampling lost or won (0 for a black map). prepare_ms: resampling and MIPs."""

    texture: moderngl.TextureCube
    face_size: int
    energy_residual: float
    prepare_ms: float

    @property
    def max_level(self) -> int:
        """Index of the 1 × 1 level."""
        return self.face_size.bit_length() - 1

    @cached_property
    def level0(self) -> NDArray[np.float32]:
        """(6, w, w, 3) float32 radiance read back from level 0."""
        return _read_level0(self.texture, self.face_size)

    @cached_property
    def sampler(self) -> cubemap.SeamlessCube:
        """CPU twin of the texture with its MIPs."""
        return cubemap.SeamlessCube(cubemap.box_mips(self.level0))


def _read_level0(texture: moderngl.TextureCube, width: int) -> NDArray[np.float32]:
    faces = [np.frombuffer(texture.read(face), np.float32).reshape(width, width, 4)[..., :3] for face in range(6)]
    return np.stack(faces)


class GpuEnvironment:
    """radiance and to_world as in `Environment`. Textures are made when first asked for."""

    def __init__(self, environment: Environment) -> None:
        height, width = environment.radiance.shape[:2]
        context.check_texture_size(f"environment {environment.source}", width, max(height, 2))
        gl = context.get()
        radiance = np.asarray(environment.radiance, np.float32)
        if height == 1:  # constant in v; the shader's two rows are then equal
            radiance = np.repeat(radiance, 2, axis=0)
        self.environment, self.radiance = environment, radiance
        rgba = np.ones((*radiance.shape[:2], 4), np.float32)
        rgba[..., :3] = radiance
        self.latlong = gl.texture((width, radiance.shape[0]), 4, rgba.tobytes(), dtype="f4")
        self.latlong.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.uniforms = {"env_to_local": np.asarray(environment.to_world, np.float64).T}
        self._cubes: dict[int, Cube] = {}
        self._kept: OrderedDict[tuple, object] = OrderedDict()
        self._textures: list[moderngl.Texture] = [self.latlong]

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W) of the scene's lat-long map."""
        return self.environment.radiance.shape[:2]

    @cached_property
    def integral(self) -> NDArray[np.float64]:
        """∫ L dω of the bilinear lat-long map, (3,) [W m⁻²], exact."""
        return np.einsum("yxc,yx->c", self.environment.radiance.astype(np.float64), latlong_solid_angles(*self.shape))

    @property
    def has_energy(self) -> bool:
        """Whether any texel has positive luminance, so that the map can be sampled."""
        return bool((self.environment.radiance.max(axis=-1, initial=0.0) > 0).any())

    def cube(self, face_size: int) -> Cube:
        """The cubemap with faces face_size² and its MIPs, made once. Raises EvalsuiteError for a size that cannot be."""
        width = cubemap.check_face_size(face_size)
        if width not in self._cubes:
            while len(self._cubes) >= 3:
                self._cubes.pop(next(iter(self._cubes))).texture.release()
            self._cubes[width] = self._resample(width)
        return self._cubes[width]

    def kept(self, key: tuple, make: Callable[[], T]) -> T:
        """What was derived from this environment under `key` (a prefiltered map, say), made when first asked for. The last
        few are kept; what has a `release()` is released with them."""
        if key not in self._kept:
            while len(self._kept) >= _CACHED_DERIVED:
                _release(self._kept.popitem(last=False)[1])
            self._kept[key] = make()
        self._kept.move_to_end(key)
        return self._kept[key]

    def _resample(self, width: int) -> Cube:
        gl = context.get()
        shader = programs.compute(
            (programs.part("latlong.glsl"), programs.part("library/cube_faces.glsl"), programs.part("resample.comp"))
        )
        start = time.perf_counter()
        texture = gl.texture_cube((width, width), 4, dtype="f4")
        texture.build_mipmaps()  # allocates the chain, so that the cube is complete as an image
        subsamples = cubemap.subsamples_per_texel(width, self.shape)
        programs.set_uniforms(shader, {**self.uniforms, "subsamples": subsamples})
        programs.bind_textures(shader, {"env_latlong": self.latlong})
        texture.bind_to_image(0, read=False, write=True, level=0)
        # A few million look-ups a dispatch, so that no driver's watchdog sees a long one.
        rows = max(8, (4_000_000 // (6 * width * subsamples**2)) // 8 * 8)
        for first in range(0, width, rows):
            programs.set_uniforms(shader, {"first_row": first})
            shader.run((width + 7) // 8, (min(rows, width - first) + 7) // 8, 6)
            gl.finish() if width * subsamples > 4096 else None
        gl.memory_barrier()
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        gl.finish()
        context.check_errors("resampling the environment to a cubemap")
        elapsed = 1e3 * (time.perf_counter() - start)
        cube = Cube(texture, width, 0.0, elapsed)
        whole = float(self.integral @ LUMINANCE)
        if whole > 0.0:
            cube.energy_residual = float(cubemap.integral(cube.level0) @ LUMINANCE) / whole - 1.0
        return cube

    @cached_property
    def sampling(self) -> dict[str, moderngl.Texture]:
        """Distribution over bilinear cells, luminance × solid angle: `row_cdf` (H' + 1, 1) of rows of cells, `column_cdf`
        (W + 1, H') within each row, both float32 from 0 to 1; all 0 for a map without energy.

        Cell (row, column) lies between texel rows row, row + 1 and texel columns column, column + 1 (wrapping).
        """
        height, width = self.radiance.shape[:2]
        context.check_texture_size("environment", width + 1, height)
        luminance = np.maximum(self.radiance.astype(np.float64) @ LUMINANCE, 0.0)
        cells = luminance + np.roll(luminance, -1, axis=1)
        cells = 0.25 * (cells[:-1] + cells[1:])
        edge = np.cos(np.pi * np.arange(height) / (height - 1))
        per_row = cells.sum(1) * (edge[:-1] - edge[1:])
        gl = context.get()

        def upload(weights: NDArray[np.float64]) -> moderngl.Texture:
            cdf = np.zeros((weights.shape[0], weights.shape[1] + 1))
            np.cumsum(weights, axis=1, out=cdf[:, 1:])
            total = cdf[:, -1:]
            cdf = np.divide(cdf, total, out=np.zeros_like(cdf), where=total > 0).astype(np.float32)
            texture = gl.texture((cdf.shape[1], cdf.shape[0]), 1, cdf.tobytes(), dtype="f4")
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._textures.append(texture)
            return texture

        return {"row_cdf": upload(per_row[None, :]), "column_cdf": upload(cells)}

    def release(self) -> None:
        """Free the textures."""
        for texture in [*self._textures, *(cube.texture for cube in self._cubes.values()), *self._kept.values()]:
            _release(texture)


def _release(derived: object) -> None:
    if hasattr(derived, "release"):
        derived.release()


_cache: OrderedDict[bytes, GpuEnvironment] = OrderedDict()


def of(environment: Environment) -> GpuEnvironment:
    """The environment's resources, kept between calls by the content of its texels."""
    texels = np.ascontiguousarray(environment.radiance, np.float32)
    key = blake2b(texels.tobytes() + repr(texels.shape).encode() + np.asarray(environment.to_world, np.float64).tobytes())
    digest = key.digest()
    if digest not in _cache:
        while len(_cache) >= _CACHED:
            _cache.popitem(last=False)[1].release()
        _cache[digest] = GpuEnvironment(environment)
    _cache.move_to_end(digest)
    return _cache[digest]
