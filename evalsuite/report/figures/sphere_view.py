"""What the headroom figures share: the scene `sphere` as its camera sees it, in float64, and the maps around it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import cubemap, phong

Float = NDArray[np.float64]

#: The camera of scenes/sphere.xml: where it stands, looking at the centre of the unit sphere, and its field of view.
ORIGIN, FOV_DEG = np.array([2.2, 1.1, 3.4]), 30.5
#: Built-in maps, from lamps in the dark to an even sky.
MAPS = ("office", "cathedral", "coloured-cube", "overcast", "sunsky", "sh2")
#: One colour a map (Okabe and Ito 2008).
COLOURS = dict(zip(MAPS, ("#E69F00", "#D55E00", "#CC79A7", "#56B4E9", "#0072B2", "#009E73"), strict=True))


def rays(width: int, height: int | None = None) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Normal and direction to the viewer at the pixel centres of a picture, square unless its height is given, (h, w, 3), and
    where the sphere is, (h, w). The field of view is that of its width, as in Mitsuba."""
    z = -ORIGIN / np.linalg.norm(ORIGIN)
    x = np.cross(z, (0.0, 1.0, 0.0))
    x /= np.linalg.norm(x)
    y = np.cross(x, z)
    across, down = (
        (np.arange(n) + 0.5 - 0.5 * n) * np.tan(np.radians(FOV_DEG) / 2) * 2 / width for n in (width, height or width)
    )
    direction = z + across[None, :, None] * x - down[:, None, None] * y
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    along = direction @ ORIGIN
    root = along**2 - (ORIGIN @ ORIGIN - 1.0)
    hit = root > 0
    distance = -along - np.sqrt(np.maximum(root, 0.0))
    normal = ORIGIN + distance[..., None] * direction
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True), -direction, hit


def some(mask: NDArray[np.bool_], count: int) -> NDArray[np.int64]:
    """Flat indices of `count` pixels of a mask, spread evenly."""
    inside = np.flatnonzero(mask)
    return inside[np.unique(np.linspace(0, len(inside) - 1, count).astype(int))]


@lru_cache(maxsize=16)
def cube(name: str, width: int) -> cubemap.SeamlessCube:
    """A built-in map as a cubemap with box-filtered MIPs."""
    from evalsuite.scene import builtin
    from evalsuite.scene.environment import read_environment

    environment = read_environment(builtin.environment_path(name))
    return cubemap.SeamlessCube(cubemap.box_mips(cubemap.resample_latlong(environment.radiance, environment.to_world, width)))


def hardware_lod(normal: Float, to_view: Float, mask: NDArray[np.bool_], face_size: int) -> tuple[Float, NDArray[np.bool_]]:
    """λ of a look-up about r before any bias, (w − 1, w − 1), and where both neighbours are on the sphere too."""
    inside = mask[:-1, :-1] & mask[:-1, 1:] & mask[1:, :-1]
    return cubemap.reflection_lod(phong.reflect(to_view, normal), face_size), inside


def least(values: Float, errors: Float) -> float:
    """Where a curve has its least point: the vertex of the parabola through the lowest three; an end where that is the lowest."""
    k = int(np.argmin(errors))
    if not 0 < k < len(values) - 1:
        return float(values[k])
    left, middle, right = errors[k - 1 : k + 2]
    bend = left - 2 * middle + right
    return float(values[k] + (0.5 * (left - right) / bend * (values[k + 1] - values[k]) if bend > 0 else 0.0))
