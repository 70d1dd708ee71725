"""Cosine-power lobes, their normalisations and their match to MIP levels, in float64.

Notation: n normal, v to_view, l to_light, r = 2(n·v)n − v, h = (l + v)/|l + v|, N Phong exponent, s Blinn-Phong exponent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


def reflect(to_view: ArrayLike, normal: ArrayLike) -> Float:
    """r = 2(n·v)n − v, (..., 3)."""
    v, n = np.asarray(to_view, np.float64), np.asarray(normal, np.float64)
    return 2.0 * (n * v).sum(-1, keepdims=True) * n - v


def phong_lobe(exponent: ArrayLike, cosine: ArrayLike) -> Float:
    """Phong BRDF × n·l for k_s = 1 [sr⁻¹]: (N + 1)/(2π) (r·l)₊^N, which integrates to 1 over the sphere.

    ∫ cos^N θ dω over the hemisphere about r is 2π ∫₀¹ c^N dc = **2π/(N + 1)**.
    """
    return (np.asarray(exponent) + 1.0) / (2.0 * np.pi) * np.maximum(cosine, 0.0) ** exponent


def blinn_phong_brdf(exponent: ArrayLike, cosine: ArrayLike) -> Float:
    """Blinn-Phong BRDF for k_G = 1 [sr⁻¹]: (s + 8)/(8π) (h·n)₊^s (McGuire et al. Eq 13). Multiply by n·l for the integrand.

    (s + 8)/8 is itself an approximation: the lobe's albedo at normal incidence is only near 1.
    """
    return (np.asarray(exponent) + 8.0) / (8.0 * np.pi) * np.maximum(cosine, 0.0) ** exponent


def lobe_solid_angle(exponent: ArrayLike) -> Float:
    """Γ = 2π/(N + 1) [sr], the weighted solid angle of cos^N about its axis (McGuire et al. Eq 3)."""
    return 2.0 * np.pi / (np.asarray(exponent, np.float64) + 1.0)


def mean_texel_solid_angle(face_width: float, lod: ArrayLike) -> Float:
    """T = 4π / (6 (w 2^−m)²) [sr], a texel of level m on average (McGuire et al. Eq 4)."""
    return 4.0 * np.pi / (6.0 * (face_width * 2.0 ** -np.asarray(lod, np.float64)) ** 2)


def exponent_to_lod(exponent: ArrayLike, face_width: float) -> Float:
    """MIP level whose mean texel has the lobe's solid angle (McGuire et al. Eq 12).

    2π/(s + 1) = 4π / (6 w² 2^−2m)  ⇒  2^2m = 3w²/(s + 1)  ⇒  **m = log₂(w√3) − ½ log₂(s + 1)**. Not clamped.
    """
    return np.log2(face_width * np.sqrt(3.0)) - 0.5 * np.log2(np.asarray(exponent, np.float64) + 1.0)


def lod_to_exponent(lod: ArrayLike, face_width: float) -> Float:
    """Inverse of `exponent_to_lod`: s = 3w² 4^−m − 1, held at 0 where the texel is larger than a hemisphere."""
    return np.maximum(0.0, 3.0 * face_width**2 * 4.0 ** -np.asarray(lod, np.float64) - 1.0)


def alpha_to_exponent(alpha: ArrayLike) -> Float:
    """Blinn-Phong exponent whose normal distribution has the same peak as a microfacet alpha (GGX or Beckmann).

    D(0) = (s + 2)/2π for cos^s and 1/(πα²) for both microfacet distributions  ⇒  **s = 2/α² − 2**, held at 0.
    """
    return np.maximum(0.0, 2.0 / np.asarray(alpha, np.float64) ** 2 - 2.0)


def exponent_to_alpha(exponent: ArrayLike) -> Float:
    """Inverse of `alpha_to_exponent`: α = √(2/(s + 2))."""
    return np.sqrt(2.0 / (np.asarray(exponent, np.float64) + 2.0))


def half_vector_to_phong_exponent(exponent: ArrayLike) -> Float:
    """Phong exponent N about r of a narrow lobe cos^s about the half vector, in the plane of incidence.

    There r·l = cos θ where h·n = cos(θ/2), and ln cos x ≈ −x²/2 near the peak: s (θ/2)² = N θ²  ⇒  **N = s/4**.
    """
    return np.asarray(exponent, np.float64) / 4.0


def phong_to_half_vector_exponent(exponent: ArrayLike) -> Float:
    """Inverse of `half_vector_to_phong_exponent`: s = 4N."""
    return np.asarray(exponent, np.float64) * 4.0
