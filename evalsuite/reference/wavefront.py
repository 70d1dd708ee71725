"""Passes whose pixels take different numbers of samples: rays of our own through Mitsuba's sensor and integrator.

`integrator.render` takes the same samples in every pixel. Here the pixels of one count at a time form a wavefront, a pixel's
samples one after another: multi-jittered among themselves, uniform over the pixel (the film's box filter), averaged in their
order. The same measure as a film's, another stream of random numbers; the bits depend on no number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.reference.passes import pass_seed
from evalsuite.scene.load import LoadedScene

#: Samples traced at once: 100 MB of Dr.Jit's and ours. A constant, as the bits depend on it.
BLOCK = 2**20


def picture(
    loaded: LoadedScene, integrator: Any, counts: NDArray[np.int32], seed: int, number: int, look: int
) -> NDArray[np.float32]:
    """Radiance (H, W, 3) of one pass. counts: (H, W) samples of each pixel, squares. seed, number, look: what the random
    numbers are made of; look is at least 1, as the passes of `integrator.render` have none."""
    radiance = np.empty((counts.size, 3), np.float32)
    for spp in np.unique(counts):
        chosen = np.flatnonzero(counts.ravel() == spp)
        size = max(BLOCK // int(spp), 1)
        for block, first in enumerate(range(0, len(chosen), size)):
            pixels = chosen[first : first + size]
            seeded = pass_seed(seed, number, look, int(spp), block)
            radiance[pixels] = _means(loaded, integrator, pixels, int(spp), seeded)
    return radiance.reshape(*counts.shape, 3)


def _means(loaded: LoadedScene, integrator: Any, pixels: NDArray, spp: int, seed: int) -> NDArray[np.float32]:
    """Mean radiance (N, 3) of N pixels, numbered along rows. As `SamplingIntegrator::render_sample` of Mitsuba 3.9 does it."""
    import drjit as dr
    import mitsuba as mi

    width, height = loaded.scene.camera.size
    sampler = mi.load_dict({"type": "multijitter", "sample_count": spp})
    sampler.set_samples_per_wavefront(spp)
    sampler.seed(seed, len(pixels) * spp)
    # Opaque: one kernel serves all counts.
    each = dr.arange(mi.UInt32, len(pixels) * spp) // dr.opaque(mi.UInt32, spp)
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), each)
    film = (mi.Point2f(mi.Float(pixel % width), mi.Float(pixel // width)) + sampler.next_2d()) / mi.Vector2f(width, height)
    lens = sampler.next_2d() if loaded.sensor.needs_aperture_sample() else mi.Point2f(0.5)
    ray, weight = loaded.sensor.sample_ray_differential(0.0, sampler.next_1d(), film, lens)
    ray.scale_differential(dr.rsqrt(dr.opaque(mi.Float, spp)))
    radiance, _, _ = integrator.sample(loaded.mitsuba, sampler, ray)
    found = np.array(weight * radiance, np.float32)
    return found.reshape(3, len(pixels), spp).mean(axis=2).T
