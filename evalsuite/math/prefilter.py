"""Deterministic sample sets of lobes that are round about an axis, and the filtering of a cubemap with them, in float64.

A lobe is held as N directions about +z, each the middle of its share of the lobe: shares are equal, azimuths a golden-angle
spiral. Each direction is looked up at the MIP level whose mean texel is as large as the share (Křivánek, Colbert 2008).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math import microfacet
from evalsuite.math.phong import mean_texel_solid_angle

if TYPE_CHECKING:
    from evalsuite.math.cubemap import SeamlessCube

Float = NDArray[np.float64]

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class SampleSet:
    """directions: (N, 3) unit, about +z. weights: (N,), summing to 1. solid_angles: (N,) [sr] that each stands for."""

    directions: Float
    weights: Float
    solid_angles: Float

    def levels(self, face_width: int) -> Float:
        """MIP level of each sample in a cubemap: **½ log₂(Ω_sample / Ω_texel)**, not below 0."""
        texel = mean_texel_solid_angle(face_width, 0.0)
        return np.maximum(0.0, 0.5 * np.log2(np.maximum(self.solid_angles, 1e-12) / texel))


def spiral(cosine: ArrayLike) -> Float:
    """Unit directions (N, 3) at the given cosines to +z, each a golden angle further round than the one before."""
    z = np.asarray(cosine, np.float64)
    phi = GOLDEN_ANGLE * np.arange(len(z))
    sine = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], -1)


def ggx_at_normal_incidence(alpha: float, count: int) -> SampleSet:
    """Karis' lobe (2013): l for n = v = r, h drawn from GGX, weighted by n·l.

    l·r = 2c² − 1 with c = n·h; pdf(l) = D(c) c / (4 v·h) = **D(c)/4**, hence Ω_sample = 4/(N D(c)). Samples below the horizon
    carry no weight.
    """
    c = microfacet.half_vector_cosine("ggx", alpha, 1.0 - (np.arange(count) + 0.5) / count)
    cosine = 2.0 * c * c - 1.0
    weight = np.maximum(cosine, 0.0)
    share = 4.0 / (count * microfacet.normal_density("ggx", alpha, c))
    kept = weight > 0
    return SampleSet(spiral(cosine)[kept], weight[kept] / weight.sum(), share[kept])


def frame(axis: ArrayLike) -> tuple[Float, Float]:
    """Two unit vectors (..., 3) that complete each unit axis (..., 3) to a right-handed frame (Duff et al. 2017)."""
    x, y, z = np.moveaxis(np.asarray(axis, np.float64), -1, 0)
    side = np.where(z < 0, -1.0, 1.0)
    a = -1.0 / (side + z)
    b = x * y * a
    return np.stack([1 + side * x * x * a, side * b, -side * x], -1), np.stack([b, side + y * y * a, -y], -1)


def filter_cube(cube: SeamlessCube, axes: ArrayLike, samples: SampleSet) -> Float:
    """Σ w L(direction about each axis, its level), (..., C), for unit axes (..., 3)."""
    axes = np.asarray(axes, np.float64)
    x, y = frame(axes)
    levels = np.minimum(samples.levels(cube.width), cube.max_level)
    out = np.zeros((*axes.shape[:-1], cube.levels[0].shape[-1]))
    for direction, weight, level in zip(samples.directions, samples.weights, levels, strict=True):
        to_light = direction[0] * x + direction[1] * y + direction[2] * axes
        lower, part = int(level), level - int(level)
        out += weight * (1 - part) * cube.bilinear(to_light, lower)
        if part > 0:
            out += weight * part * cube.bilinear(to_light, lower + 1)
    return out
