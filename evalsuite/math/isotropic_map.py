"""Microfacet lobes made round: the approximation of Kautz and McCool 2000 (Heidrich's course notes §3.2.3), in float64.

L_o(r, c) = E(c) ∫ p_c(|l − r|) L(l) dl with c = n·r: for each c one lobe round about r, or two. Slices lie at c_k = (k/(K − 1))²,
close together at grazing angles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import microfacet, radial_lobe
from evalsuite.math.radial_lobe import RadialLobe

Float = NDArray[np.float64]

RINGS = 192  # azimuths about an axis over which a lobe is averaged
LEAST_COSINE = 1e-4  # of the slice at grazing incidence: f n·l stays finite there, 0/0 in the formulas does not


@dataclass(frozen=True, eq=False)
class RoundLobe:
    """One lobe of one slice. shape: p, unnormalised. energy: its share of ∫ f n·l dl. shift: angle [rad] of its axis from r
    towards n."""

    shape: RadialLobe
    energy: float
    shift: float


def slice_cosines(count: int) -> Float:
    """n·r of each slice, (count,)."""
    return np.maximum((np.arange(count) / (count - 1)) ** 2, LEAST_COSINE)


def _about(angle: float, psi: Float) -> tuple[Float, Float]:
    """Directions (P, RINGS, 3) at angles psi (P,) from an axis that stands `angle` from n = +z in the plane of incidence (towards
    +x, where r is), and the azimuths' weights (RINGS,), summing to 1.

    Half the azimuths, χ = π (t − sin 2πt/2π): dense in the plane of incidence itself, where lobes at grazing angles are ridges.
    """
    t = (np.arange(RINGS) + 0.5) / RINGS
    chi, weight = np.pi * (t - np.sin(2 * np.pi * t) / (2 * np.pi)), (1 - np.cos(2 * np.pi * t)) / RINGS
    axis, across = np.array([np.sin(angle), 0, np.cos(angle)]), np.array([np.cos(angle), 0, -np.sin(angle)])
    sine = np.sin(psi)[:, None, None]
    round_ = np.cos(chi)[:, None] * across + np.sin(chi)[:, None] * np.array([0.0, 1.0, 0.0])
    return np.cos(psi)[:, None, None] * axis + sine * round_, weight


def _integral(chord: Float, p: Float) -> float:
    """∫ p dω of a lobe tabulated over chord distance c: dω = 2π c dc. Trapezoids."""
    return float(2 * np.pi * np.trapezoid(p * chord, chord))


@lru_cache(maxsize=8)
def fit(distribution: str, alpha: float, slices: int, lobes: int, cosine: str) -> tuple[tuple[RoundLobe, ...], ...]:
    """Lobes of each slice, [lobe][slice].

    One lobe: **p(ψ) = mean over χ of f (n·l)₊** about r, which keeps the energy of every ring; that is the least-squares fit.
    cosine "outside" is the published form: the mean of f alone, n·r taken for n·l before the integral.
    Two lobes: the first is the largest round lobe about r that f n·l holds everywhere, **p₁(ψ) = min over χ of f (n·l)₊**, and
    the second the mean, about its own centroid, of what that leaves. Both are positive, together they hold all energy.
    """
    columns = [_fit_slice(distribution, alpha, c, lobes, cosine) for c in slice_cosines(slices)]
    return tuple(zip(*columns, strict=True))


def _fit_slice(distribution: str, alpha: float, c: float, lobes: int, cosine: str) -> tuple[RoundLobe, ...]:
    view = np.array([-np.sqrt(1 - c * c), 0.0, c])

    def reflected(to_light: Float) -> Float:
        half = to_light + view
        half /= np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
        if cosine == "inside":
            return microfacet.lobe(distribution, alpha, c, to_light[..., 2], half[..., 2])
        over = microfacet.smith_g1_over_cosine(distribution, alpha, to_light[..., 2])
        return 0.25 * c * microfacet.normal_density(distribution, alpha, half[..., 2]) * over * (
            microfacet.smith_g1_over_cosine(distribution, alpha, c))  # fmt: skip

    width = min(2.0 * alpha * max(c, 0.3), radial_lobe.WIDEST)
    chord, theta = radial_lobe.chords(width), np.arccos(c)
    psi = 2.0 * np.arcsin(0.5 * chord)

    def averaged(angle: float, value: Callable[[Float], Float]) -> RadialLobe:
        to_light, weight = _about(angle, psi)
        return RadialLobe(width, value(to_light) @ weight)

    whole = averaged(theta, reflected)
    energy = float(microfacet.albedo(distribution, alpha, c)[0, 0]) if cosine == "inside" else _integral(chord, whole.profile)
    if lobes == 1:
        return (RoundLobe(whole, energy, 0.0),)

    to_light, weight = _about(theta, psi)
    values = reflected(to_light)
    core = RadialLobe(width, values.min(axis=1))
    r = np.array([np.sin(theta), 0.0, np.cos(theta)])

    def rest(to_light: Float) -> Float:
        return np.maximum(reflected(to_light) - core(np.linalg.norm(to_light - r, axis=-1)), 0.0)

    left = energy - _integral(chord, core.profile)
    if left < 1e-3 * energy:
        return RoundLobe(core, energy, 0.0), RoundLobe(core, 0.0, 0.0)
    ring = (np.maximum(values - core.profile[:, None], 0.0) * weight)[..., None] * to_light
    centre = np.trapezoid(ring.sum(1) * chord[:, None], chord, axis=0)
    angle = float(np.arctan2(centre[0], centre[2]))
    return RoundLobe(core, energy - left, 0.0), RoundLobe(averaged(angle, rest), left, theta - angle)
