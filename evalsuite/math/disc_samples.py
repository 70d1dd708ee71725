"""Sample points of disc-shaped lights at infinity, spread evenly. All in float64.

Heckbert and Herf 1997 average the hard shadows of samples of an area light; samples of low discrepancy make the mean converge
faster than 1/√n.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.disc_coverage import tangent_frame

Float = NDArray[np.float64]
#: 1/g and 1/g² with g³ = g + 1: steps of an additive sequence that fills the square evenly (Roberts 2018).
R2 = np.array([0.7548776662466927, 0.5698402909980532])


def hammersley(count: int) -> Float:
    """(count, 2) points of the unit square: ((i + ½)/n, i with its binary digits mirrored at the point)."""
    index = np.arange(count)
    mirrored, half, rest = np.zeros(count), 0.5, index.copy()
    while rest.any():
        mirrored += half * (rest & 1)
        rest >>= 1
        half *= 0.5
    return np.stack([(index + 0.5) / max(count, 1), mirrored], axis=-1)


def concentric(u: ArrayLike) -> Float:
    """Unit square (N, 2) to unit disc (N, 2), areas kept (Shirley and Chiu 1997): with a = 2u₁ − 1, b = 2u₂ − 1,
    **ρ = a, φ = (π/4) b/a** where |a| > |b|, else **ρ = b, φ = π/2 − (π/4) a/b**."""
    a, b = np.moveaxis(2.0 * np.asarray(u, np.float64) - 1.0, -1, 0)
    wide = np.abs(a) > np.abs(b)
    rho = np.where(wide, a, b)
    ratio = np.divide(np.where(wide, b, a), rho, out=np.zeros_like(rho), where=rho != 0.0)
    phi = np.where(wide, 0.25 * np.pi * ratio, 0.5 * np.pi - 0.25 * np.pi * ratio)
    return rho[..., None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)


def cap_directions(direction: ArrayLike, radius: float, disc: ArrayLike) -> Float:
    """Unit directions (N, 3) within `radius` [rad] of a unit direction D; disc: (N, 2) points of the unit disc, whose areas
    become solid angles: with k = 1 − cos α,
    **l = √(k (2 − ρ² k)) (x T + y B) + (1 − ρ² k) D**."""
    d = np.asarray(direction, np.float64)
    disc = np.asarray(disc, np.float64)
    t, b = tangent_frame(d)
    k = 2.0 * np.sin(0.5 * radius) ** 2
    drop = k * (disc**2).sum(-1, keepdims=True)
    return np.sqrt(k * (2.0 - drop)) * (disc[:, :1] * t + disc[:, 1:] * b) + (1.0 - drop) * d


def light_samples(direction: ArrayLike, radius: float, count: int, light: int) -> Float:
    """(count, 3) unit directions to one light's samples, Hammersley points shifted by the light's number, so that no two
    lights have the same pattern."""
    return cap_directions(direction, radius, concentric((hammersley(count) + light * R2) % 1.0))


def spiral(count: int) -> Float:
    """(count, 2) points of the unit disc on a sunflower's spiral: √((i + ½)/n) away from its centre, a golden angle apart
    (Vogel 1979)."""
    index = np.arange(count)
    distance, azimuth = np.sqrt((index + 0.5) / max(count, 1)), index * np.pi * (3.0 - np.sqrt(5.0))
    return distance[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
