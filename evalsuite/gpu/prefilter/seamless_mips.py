"""The environment's cubemap with a MIP chain that crosses faces, each level written by a compute shader."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import context, programs
from evalsuite.gpu.environment import GpuEnvironment
from evalsuite.math import cubemap, seamless_mips


@dataclass(eq=False)
class SeamlessMips:
    """texture: float32 RGBA cubemap with the chain of `math.seamless_mips`. mean: (3,) radiance of the whole sphere, the level
    that would follow."""

    texture: moderngl.TextureCube
    face_size: int
    mean: NDArray[np.float64]
    prepare_ms: float

    @cached_property
    def sampler(self) -> cubemap.SeamlessCube:
        """CPU twin of the texture, every level read back."""
        return cubemap.SeamlessCube([self.read(level) for level in range(self.face_size.bit_length())])

    def read(self, level: int) -> NDArray[np.float32]:
        """(6, w, w, 3) float32 of a level."""
        width, gl = self.face_size >> level, context.get()
        out = gl.buffer(reserve=6 * width * width * 16)
        shader = programs.compute((programs.read_part(Path(__file__).with_name("read_level.comp")),))
        self.texture.bind_to_image(0, read=True, write=False, level=level)
        out.bind_to_storage_buffer(0)
        shader.run((width + 7) // 8, (width + 7) // 8, 6)
        gl.memory_barrier()
        return np.frombuffer(out.read(), np.float32).reshape(6, width, width, 4)[..., :3]

    def release(self) -> None:
        """Free the texture."""
        self.texture.release()


def seamless_cube(env: GpuEnvironment, face_size: int) -> SeamlessMips:
    """The chain over the environment's cubemap with faces face_size², made once."""
    return env.kept(("seamless mips", face_size), lambda: _make(env, face_size))


def _make(env: GpuEnvironment, face_size: int) -> SeamlessMips:
    gl, plain = context.get(), env.cube(face_size)
    level0, start = plain.level0, time.perf_counter()
    texture = gl.texture_cube((face_size, face_size), 4, dtype="f4")
    texture.build_mipmaps()  # allocates the chain
    rgba = np.ones((6, face_size, face_size, 4), np.float32)
    rgba[..., :3] = level0
    for face in range(6):
        texture.write(face, rgba[face].tobytes())
    shader = programs.compute(
        (programs.part("library/cube_faces.glsl"), programs.read_part(Path(__file__).with_name("seamless_mips.comp")))
    )
    for level in range(1, face_size.bit_length()):
        width = face_size >> (level - 1)
        omega = cubemap.texel_solid_angles(width)
        weights = gl.texture((width, width), 1, (omega / omega.max()).astype(np.float32).tobytes(), dtype="f4", alignment=1)
        weights.filter = (moderngl.NEAREST, moderngl.NEAREST)
        programs.bind_textures(shader, {"solid_angles": weights})
        texture.bind_to_image(0, read=True, write=False, level=level - 1)
        texture.bind_to_image(1, read=False, write=True, level=level)
        shader.run((width // 2 + 7) // 8, (width // 2 + 7) // 8, 6)
        gl.memory_barrier()
        weights.release()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    gl.finish()
    context.check_errors("filtering the cubemap across faces")
    elapsed = plain.prepare_ms + 1e3 * (time.perf_counter() - start)
    return SeamlessMips(texture, face_size, seamless_mips.mean_radiance(level0), elapsed)
