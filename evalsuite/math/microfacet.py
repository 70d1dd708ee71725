"""Isotropic microfacet reflection as Mitsuba's `roughconductor` has it (GGX and Beckmann, separable Smith), in float64.

Notation: n normal, v to_view, l to_light, h = (l + v)/|l + v|, α the distribution's width, D density of facet normals, G₁
Smith's masking of one direction, F Fresnel reflectance. The BRDF is f = F D(n·h) G₁(n·v) G₁(n·l) / (4 (n·v) (n·l)).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]

DISTRIBUTIONS = ("ggx", "beckmann")


def normal_density(distribution: str, alpha: float, cos_half: ArrayLike) -> Float:
    """D(n·h) [sr⁻¹], ∫ D (n·h) dω = 1 over the hemisphere; 0 below it. With c = n·h, t² = 1/c² − 1:

    **GGX: α² / (π ((α² − 1) c² + 1)²)**, **Beckmann: exp(−t²/α²) / (π α² c⁴)**.
    """
    c = np.maximum(np.asarray(cos_half, np.float64), 1e-9)
    if distribution == "ggx":
        density = alpha**2 / (np.pi * ((alpha**2 - 1.0) * c * c + 1.0) ** 2)
    else:
        density = np.exp(-(1.0 / c**2 - 1.0) / alpha**2) / (np.pi * alpha**2 * c**4)
    return np.where(np.asarray(cos_half) > 0, density, 0.0)


def smith_g1_over_cosine(distribution: str, alpha: float, cosine: ArrayLike) -> Float:
    """G₁(c)/c, which stays finite at grazing: c = 0 gives the limit, c < 0 gives 0.

    **GGX: G₁/c = 2 / (c + √(c² + α² (1 − c²)))**. **Beckmann** (Walter et al. 2007, Eq 27, Mitsuba's fit): with
    a = 1/(α tan θ), G₁ = (3.535 a + 2.181 a²) / (1 + 2.276 a + 2.577 a²) for a < 1.6, else 1.
    """
    c = np.asarray(cosine, np.float64)
    x = np.clip(c, 1e-9, 1.0)
    sine = np.sqrt(np.maximum(1.0 - x * x, 0.0))
    if distribution == "ggx":
        value = 2.0 / (x + np.sqrt(x * x + (alpha * sine) ** 2))
    else:
        a = np.minimum(x / np.maximum(alpha * sine, 1e-9), 2.0)
        fit = (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a)
        value = np.where(a < 1.6, fit, 1.0) / x
    return np.where(c >= 0, value, 0.0)


def smith_g1(distribution: str, alpha: float, cosine: ArrayLike) -> Float:
    """Smith's masking G₁ of a direction at cosine n·ω: 1 at normal incidence, 0 below the horizon."""
    return np.clip(cosine, 0.0, 1.0) * smith_g1_over_cosine(distribution, alpha, cosine)


def lobe(distribution: str, alpha: float, cos_view: ArrayLike, cos_light: ArrayLike, cos_half: ArrayLike) -> Float:
    """f (n·l)₊ for F = 1 [sr⁻¹]: **D G₁(n·v) G₁(n·l) / (4 n·v)**; 0 for l below the horizon."""
    density = normal_density(distribution, alpha, cos_half) * smith_g1(distribution, alpha, cos_light)
    return 0.25 * density * smith_g1_over_cosine(distribution, alpha, cos_view)


def half_vector_cosine(distribution: str, alpha: float, beyond: ArrayLike) -> Float:
    """n·h at which the share `beyond` in (0, 1] of ∫ D (n·h) dω lies at larger angles: inverse of the cumulative distribution.

    **GGX: c² = b / (α² + (1 − α²) b)** (Karis 2013 with ξ = 1 − b), **Beckmann: tan²θ = −α² ln b**.
    """
    b = np.asarray(beyond, np.float64)
    if distribution == "ggx":
        return np.sqrt(b / (alpha**2 + (1.0 - alpha**2) * b))
    return 1.0 / np.sqrt(1.0 - alpha**2 * np.log(b))


def no_fresnel(cosine: Float) -> Float:
    """F = 1, (..., 1)."""
    return np.ones_like(cosine)[..., None]


def albedo(
    distribution: str, alpha: float, cos_view: ArrayLike, fresnel: Callable[[Float], Float] = no_fresnel, rings: int = 48
) -> Float:
    """∫ f (n·l)₊ dl for views at cos_view (P,), (P, C): what the surface reflects of a uniform environment of radiance 1.

    fresnel: cosines v·h (...) → F (..., C). Midpoint rule in the half vector's own cumulative distribution, rings × rings
    points over half the azimuths (the other half mirrors it): with pdf(l) = D (n·h)/(4 v·h) the integrand over the density is
    **F G₁(n·v) G₁(n·l) (v·h) / ((n·v) (n·h))**. The share beyond is t³ with weight 3t²: GGX's long tail, which views at grazing
    angles gather, then has points enough (error below 10⁻³ for α = 0.02 … 1 at any angle, 4·10⁻⁴ for GGX).
    """
    views = np.atleast_1d(np.asarray(cos_view, np.float64))[:, None, None]
    t = (np.arange(rings) + 0.5) / rings
    c = half_vector_cosine(distribution, alpha, t**3)[:, None]
    sine_view, s = np.sqrt(1.0 - np.minimum(views, 1.0) ** 2), np.sqrt(1.0 - c * c)
    view_half = views * c + sine_view * s * np.cos(np.pi * t)
    light = 2.0 * view_half * c - views
    weight = smith_g1_over_cosine(distribution, alpha, views) * smith_g1(distribution, alpha, light) * view_half / c
    weight = np.where(view_half > 0, weight, 0.0) * 3.0 * t[:, None] ** 2
    return (weight[..., None] * fresnel(np.clip(view_half, 0.0, 1.0))).mean((1, 2))


def split_sum_table(alpha: ArrayLike, cos_view: ArrayLike, rings: int = 48) -> Float:
    """Karis' BRDF integral (2013), (len(alpha), len(cos_view), 2): the GGX albedo under Schlick's F = F₀ + (1 − F₀)(1 − v·h)⁵
    is **F₀ A + B** with A = ∫ f (n·l) (1 − (1 − v·h)⁵) dl and B = ∫ f (n·l) (1 − v·h)⁵ dl, f that of F = 1."""

    def schlick(cosine: Float) -> Float:
        rest = (1.0 - cosine) ** 5
        return np.stack([1.0 - rest, rest], -1)

    return np.stack([albedo("ggx", float(a), cos_view, schlick, rings) for a in np.ravel(alpha)])
