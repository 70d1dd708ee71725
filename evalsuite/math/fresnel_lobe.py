"""A round lobe with the Fresnel factor inside its integral, ∫ K(r·l) F(v·h) L(l) dl, in float64.

F varies over the lobe with the light's direction: h = (l + v)/|l + v| gives **v·h = √((1 + v·l)/2)**. What that adds to F(n·v) in
front of the integral, K (F(v·h) − F(n·v)), is written as a sum of lobes of one shape about 19 or 37 directions round r, with
weights that depend on the angle of incidence alone: their integrals over the environment are then known (`lobe_field`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
#: cosine to the axis (...) → value (...).
Kernel = Callable[[Float], Float]

#: Below it the lobe's own edge at the horizon is not made of the narrower ones.
LOWEST_EXPONENT = 4.0
#: Of what F within the integral changes, rms, against sums over the lobe of ten thousand points and more in the office, at views
#: of all angles: 1 to 11 % (N = 8 … 600, gold and Schlick); up to 78° 2 %. F's kink at l = −v is narrower than the lobes summed.
TOLERANCE = 0.1
#: Angles of incidence that weights are tabulated at, linear between them.
ANGLES = 129
_RINGS, _AZIMUTHS = 96, 40  # of the sums over the lobe, half of it: the plane of incidence mirrors the other
_RIDGE = 1e-10  # keeps weights of lobes that overlap from growing against one another


@dataclass(frozen=True, eq=False)
class FresnelLobe:
    """steps: (Q, 3) directions round r as (towards v in the plane of incidence, across it, along r). weights: (ANGLES, Q, C) of
    each at θ = 90° i/(ANGLES − 1). missed: (ANGLES, C), ∫ |K (F − F(n·v)) − their sum| dl over F(n·v), the part of the radiance
    that an environment could hide there at worst."""

    steps: Float
    weights: Float
    missed: Float

    def __call__(self, integral: Callable[[Float], Float], normals: ArrayLike, to_view: ArrayLike) -> Float:
        """∫ K(r·l) (F(v·h) − F(n·v)) L dl, (P, C). integral: directions (P, 3) → the narrow lobe's integral there, (P, C)."""
        n, v = np.asarray(normals, np.float64), np.asarray(to_view, np.float64)
        cosine = np.clip((n * v).sum(-1, keepdims=True), 0.0, 1.0)
        r = 2.0 * cosine * n - v
        towards = v - (v * r).sum(-1, keepdims=True) * r
        towards /= np.maximum(np.linalg.norm(towards, axis=-1, keepdims=True), 1e-12)
        across = np.cross(r, towards)
        place = np.arccos(cosine[:, 0]) * (2.0 / np.pi) * (ANGLES - 1)
        below = np.minimum(place.astype(int), ANGLES - 2)
        part = (place - below)[:, None]
        out = np.zeros((len(n), 1))
        for (x, y, z), weight in zip(self.steps, np.moveaxis(self.weights, 1, 0), strict=True):
            share = (1.0 - part) * weight[below] + part * weight[below + 1]
            out = out + share * integral(x * towards + y * across + z * r)
        return out


def steps(spread: float, rings: int) -> Float:
    """Directions about r in hexagonal rings, `spread` [rad] apart: 19 for two rings, 37 for three, (Q, 3)."""
    along = range(-rings, rings + 1)
    lattice = np.array([(i + 0.5 * j, np.sqrt(0.75) * j) for i in along for j in along if abs(i + j) <= rings])
    angle = np.linalg.norm(lattice, axis=1) * spread
    return np.concatenate([lattice * spread * np.sinc(angle / np.pi)[:, None], np.cos(angle)[:, None]], axis=1)


def fit(
    lobe: Kernel, narrow: Kernel, spread: float, reach: float, factor: Callable[[Float], Float], rings: int = 2
) -> FresnelLobe:
    """Least squares over the lobe. lobe: K; narrow: of the lobes summed; spread, reach [rad]: between these, and from r to where
    K is nothing; factor: cosine (...) → F (..., C)."""
    psi = reach * ((np.arange(_RINGS) + 0.5) / _RINGS) ** 1.5  # dense about the peak
    ring = np.sin(psi) * 1.5 * reach / _RINGS * ((np.arange(_RINGS) + 0.5) / _RINGS) ** 0.5
    chi = np.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS
    sine = np.sin(psi)[:, None]
    to_light = np.stack([sine * np.cos(chi), sine * np.sin(chi), np.broadcast_to(np.cos(psi)[:, None], (_RINGS, _AZIMUTHS))], -1)
    to_light = to_light.reshape(-1, 3)
    area = np.repeat(ring * 2.0 * np.pi / _AZIMUTHS, _AZIMUTHS)
    around = steps(spread, rings)
    basis = 0.5 * (narrow(to_light @ around.T) + narrow(to_light @ (around * [1.0, -1.0, 1.0]).T))
    gram = basis.T @ (area[:, None] * basis)
    gram += _RIDGE * np.trace(gram) / len(around) * np.eye(len(around))
    theta = 0.5 * np.pi * np.arange(ANGLES) / (ANGLES - 1)
    view_light = np.cos(2.0 * theta)[:, None] * to_light[:, 2] + np.sin(2.0 * theta)[:, None] * to_light[:, 0]
    outside = factor(np.cos(theta))[:, None]
    # v·h loses digits to cancellation where l is near −v alone, which only views at grazing angles reflect.
    wanted = lobe(to_light[:, 2])[:, None] * (factor(np.sqrt(np.clip(0.5 * (1.0 + view_light), 0.0, 1.0))) - outside)
    weights = np.linalg.solve(gram, np.einsum("pq,apc->qac", basis * area[:, None], wanted).reshape(len(around), -1))
    weights = np.moveaxis(weights.reshape(len(around), *outside[:, 0].shape), 0, 1)
    left = np.abs(wanted - np.einsum("pq,aqc->apc", basis, weights))
    return FresnelLobe(around, weights, np.einsum("apc,p->ac", left, area) / np.maximum(outside[:, 0], 1e-12))


def phong(exponent: float, factor: Callable[[Float], Float]) -> tuple[FresnelLobe, float]:
    """For the Phong lobe (N + 1)/2π (r·l)₊^N: the sum, and the exponent M of its lobes, a multiple of N: wide lobes see more of F
    and take narrower ones. From 100 on it is N itself, F being nearly straight over a lobe, so that one field serves both."""
    multiple, spread, rings = (3.0, 0.9, 3) if exponent < 12.0 else (2.0, 1.0, 2) if exponent < 100.0 else (1.0, 0.7, 2)
    narrow, width = multiple * exponent, 1.0 / np.sqrt(exponent + 1.0)

    def power(n: float) -> Kernel:
        return lambda c: (n + 1.0) / (2.0 * np.pi) * np.maximum(c, 0.0) ** n

    reach = min(0.5 * np.pi, 7.0 * width)
    return fit(power(exponent), power(narrow), spread * width, reach, factor, rings), narrow
