"""Mitsuba's `sunsky` baked into a lat-long map that both renderers then use."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evalsuite.math.sphere import latlong_to_direction
from evalsuite.scene.environment import clean_environment
from evalsuite.scene.model import Environment

HEIGHT, WIDTH = 1024, 2048  # a texel is 0.18°, the sun 0.53°
STRATA = 8  # 8 × 8 jittered samples a texel wherever radiance changes abruptly: the sun and the horizon
_Y_TO_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # the map's pole goes to the sky's zenith


def bake_sky(emitter: Any, rotation: NDArray[np.float64]) -> Environment:
    """Environment of a `sunsky` emitter, deterministic.

    emitter: the Mitsuba object. rotation: (3, 3) of its to_world. Texels are point samples, which suits the smooth sky;
    where a texel's 5 × 5 surroundings vary more than twofold it is the mean of 64 jittered samples over its cell, so that
    the sun's energy is right (point samples miss it by up to a factor of two).
    """
    to_world = rotation @ _Y_TO_Z
    u, v = (np.arange(WIDTH) + 0.5) / WIDTH, np.arange(HEIGHT) / (HEIGHT - 1)
    grid_u, grid_v = np.meshgrid(u, v)
    texels = _radiance(emitter, latlong_to_direction(grid_u, grid_v), to_world)

    peak = texels.max(axis=2)
    around = {"size": 5, "mode": ("nearest", "wrap")}
    rough = ndimage.maximum_filter(peak, **around) > 2.0 * ndimage.minimum_filter(peak, **around) + 1e-12
    rows, columns = np.nonzero(rough)
    generator = np.random.Generator(np.random.PCG64(20))  # any fixed seed
    total = np.zeros((len(rows), 3))
    # Of the polar rows only half a cell lies on the sphere; clipping v there repeats the pole, which is smooth anyway.
    for i in range(STRATA):
        for j in range(STRATA):
            du, dv = ((generator.random(len(rows)) + k) / STRATA - 0.5 for k in (i, j))
            cell_v = np.clip(v[rows] + dv / (HEIGHT - 1), 0.0, 1.0)
            total += _radiance(emitter, latlong_to_direction(u[columns] + du / WIDTH, cell_v), to_world)
    texels[rows, columns] = total / STRATA**2
    baked = clean_environment(texels, "sunsky")
    note = f"sunsky baked to {WIDTH}×{HEIGHT} texels, {STRATA**2} samples in {len(rows)} texels about the sun and the horizon"
    return Environment(baked.radiance, to_world, "sunsky", baked.notes, (note, *baked.remarks))


def _radiance(emitter: Any, directions: NDArray[np.float64], to_world: NDArray[np.float64]) -> NDArray[np.float64]:
    import drjit as dr
    import mitsuba as mi

    world = (directions.reshape(-1, 3) @ to_world.T).astype(np.float32)
    si = dr.zeros(mi.SurfaceInteraction3f, len(world))
    si.wi = -mi.Vector3f(np.ascontiguousarray(world.T))
    return np.array(emitter.eval(si), dtype=np.float64).T.reshape(*directions.shape[:-1], 3)
