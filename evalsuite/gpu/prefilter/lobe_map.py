"""An environment convolved with a cosine-power lobe, as a cubemap: Phong-prefiltered maps, and diffuse ones (N = 1).

The map is gathered on a grid (float64, CPU: two matrix products), the lobe's sums are made there by one compute shader, and a
second interpolates them into the cubemap's texels; `math.lobe_grid` says why that is exact.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import context, programs
from evalsuite.gpu.environment import GpuEnvironment
from evalsuite.math import lobe_grid

_PAIRS_A_DISPATCH = 4_000_000  # of texels: no driver's watchdog sees a long one


@dataclass(frozen=True, eq=False)
class LobeMap:
    """texture: cubemap with faces face_size², RGB = (N + 1)/2π ∫ (r·l)₊^N L dω [W m⁻² sr⁻¹] at r, no MIPs. rows: of the grid."""

    texture: moderngl.TextureCube
    face_size: int
    rows: int
    prepare_ms: float

    def release(self) -> None:
        """Free the texture."""
        self.texture.release()


def lobe_map(env: GpuEnvironment, exponent: float, face_size: int) -> LobeMap:
    """The prefiltered map of an environment, made once. Raises EvalsuiteError for exponents outside 1 … 10⁴."""
    low, high = lobe_grid.LOWEST_EXPONENT, lobe_grid.HIGHEST_EXPONENT
    if not low <= exponent <= high:
        raise EvalsuiteError("exponent", f"{exponent:g}", f"{low:g} to {high:g} for a prefiltered map",
                             "choose one, or a technique that looks up MIP levels")  # fmt: skip
    return env.kept(("lobe map", exponent, face_size), lambda: _make(env, exponent, face_size))


def _part(name: str) -> programs.Part:
    return programs.read_part(Path(__file__).with_name(name))


def _nearest(width: int, height: int, components: int, data: bytes | None = None) -> moderngl.Texture:
    texture = context.get().texture((width, height), components, data, dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def _make(env: GpuEnvironment, exponent: float, face_size: int) -> LobeMap:
    gl, start = context.get(), time.perf_counter()
    rows = lobe_grid.grid_rows(exponent)
    sums = _sum(env, exponent, rows)
    texture = gl.texture_cube((face_size, face_size), 4, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    shader = programs.compute(
        (programs.part("latlong.glsl"), programs.part("library/cube_faces.glsl"), _part("lobe_to_cube.comp"))
    )
    programs.set_uniforms(shader, env.uniforms)
    programs.bind_textures(shader, {"sums": sums})
    texture.bind_to_image(0, read=False, write=True)
    shader.run((face_size + 7) // 8, (face_size + 7) // 8, 6)
    gl.memory_barrier()
    gl.finish()
    sums.release()
    context.check_errors("prefiltering the environment")
    return LobeMap(texture, face_size, rows, 1e3 * (time.perf_counter() - start))


def _sum(env: GpuEnvironment, exponent: float, rows: int) -> moderngl.Texture:
    """(R, 2R) lobe integrals at the grid's nodes."""
    gl, columns = context.get(), 2 * rows
    power = np.zeros((rows, columns, 4), np.float32)
    power[..., :3] = lobe_grid.gather(env.environment.radiance, rows)
    haversine = np.sin(np.pi * np.arange(rows + 1) / columns) ** 2
    inputs = {"power": _nearest(columns, rows, 4, power.tobytes()),
              "haversine": _nearest(rows + 1, 1, 1, haversine.astype(np.float32).tobytes())}  # fmt: skip
    sums = _nearest(columns, rows, 4)
    shader = programs.compute((_part("lobe_sum.comp"),))
    reach = lobe_grid.reach(exponent)
    reach_rows = int(np.ceil(np.arccos(1.0 - reach) * rows / np.pi))
    programs.set_uniforms(shader, {"exponent": exponent, "reach": reach, "reach_rows": reach_rows})
    programs.bind_textures(shader, inputs)
    sums.bind_to_image(0, read=False, write=True)
    pairs = columns * min(0.5 * columns * rows * 0.5 * reach * np.pi, 0.5 * columns * rows)
    step = int(np.clip(_PAIRS_A_DISPATCH // pairs, 1, rows))
    for first in range(0, rows, step):
        programs.set_uniforms(shader, {"first_row": first})
        shader.run((columns + 63) // 64, min(step, rows - first), 1)
        gl.finish()
    gl.memory_barrier()
    for texture in inputs.values():
        texture.release()
    return sums
