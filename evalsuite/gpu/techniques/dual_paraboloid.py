"""What the two dual-paraboloid mirrors share: parameters, maps on the GPU, and their twin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import common, mirror
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings
from evalsuite.math import disc_map, paraboloid
from evalsuite.math.sphere import latlong_lookup, latlong_spacing
from evalsuite.scene.model import Environment, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

#: `filter` → how gpu.disc_maps makes the MIP chain.
_MIPS = {"finest": "none", "hardware": "box", "weighted": "weighted"}

FILTER = Parameter(
    "filter", "finest", "finest: bilinear in level 0; at the hardware's own λ, trilinear in hardware: its plain 2 × 2 MIPs, or "
    "weighted: MIPs weighted by solid angle", "technique", common.choice(*_MIPS), "finest, hardware or weighted",
)  # fmt: skip


def _size(value: object) -> int:
    size = common.integer(8, 8192)(value)
    if size & (size - 1):
        raise ValueError(value)
    return size


MAP_SIZE = Parameter(
    "map_size", None, "width of each map, border included [texels]; default: twice mirror-cube's face width", "technique", _size,
    "a power of two from 8 to 8192",
)  # fmt: skip
BORDER = Parameter(
    "border", None, "border around the circle [texels]; default: so that the circles hold as many texels as mirror-cube's faces, "
    "at least 2", "technique", common.number(0.0, 2048.0), "a number of texels up to a quarter of map_size",
)  # fmt: skip


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """Size and border where they are not given."""
    size = settings["map_size"] or 2 * mirror.finest_face_size(scene)
    border = paraboloid.matched_border(size) if settings["border"] is None else settings["border"]
    return {"map_size": size, "border": border}


def prepare(env: GpuEnvironment, settings: Settings, ring: float) -> Prepared:
    """Both maps with alpha, and their texture matrices."""
    from evalsuite.gpu import disc_maps

    size, border = settings["map_size"], settings["border"]
    if border < ring:
        raise EvalsuiteError("border", f"{border:g} texels", f"at least the ring's {ring:g}")
    maps = disc_maps.paraboloids(env, size, border, ring, _MIPS[settings["filter"]])
    front, back = (paraboloid.texture_matrix(half, size, border) for half in (paraboloid.FRONT, paraboloid.BACK))
    note = (f"two paraboloid maps of {size}² texels, circle radius {0.5 * size - border:.2f}; resampling changed the map's "
            f"energy by {maps.energy_residual:+.1e}")  # fmt: skip
    textures = {"front_map": maps.textures[0], "back_map": maps.textures[1]}
    return Prepared({"front_matrix": front, "back_matrix": back}, textures, maps.prepare_ms, (note,))


def defines(settings: Settings) -> dict[str, object]:
    """Whether the hardware chooses the level."""
    return {} if settings["filter"] == "finest" else {"HARDWARE_LOD": 1}


def twin_maps(environment: Environment, directions: Float, settings: Settings, ring: float) -> tuple[Float, Float]:
    """Twin of level 0 of both maps at world directions (N, 3): each (N, 4), radiance and alpha. Only the texels that are
    looked up are resampled."""
    size, border = settings["map_size"], settings["border"]
    radius, coordinates = 0.5 * size - border, []
    for half in (paraboloid.FRONT, paraboloid.BACK):
        _, x, y = paraboloid.direction_to_paraboloid(directions, half)
        # Infinitely far out at the other map's centre, where it is not used.
        coordinates.append(tuple(np.nan_to_num(np.clip(0.5 * size + radius * v, -1.0, size + 1.0)) for v in (x, y)))
    wanted = np.stack([disc_map.footprint(size, x, y) for x, y in coordinates])
    k = paraboloid.subsamples_per_texel(size, border, latlong_spacing(*environment.radiance.shape[:2]))
    radiance = paraboloid.resample(
        lambda d: latlong_lookup(environment.radiance, d @ environment.to_world), size, border, k, wanted
    )
    alpha = np.broadcast_to(disc_map.inside_circle(size, border, ring), (2, size, size))
    rgba = np.concatenate([radiance, alpha[..., None]], axis=-1)
    texels = []
    for half, (x, y) in enumerate(coordinates):
        texel = disc_map.bilinear(rgba[half], x, y)
        texel[:, 3] *= (x >= 0) & (x <= size) & (y >= 0) & (y <= size)  # nothing beyond the map
        texels.append(texel)
    return texels[0], texels[1]
