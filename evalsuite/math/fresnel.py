"""Fresnel reflectance, in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def fresnel_conductor(cosine: ArrayLike, eta: ArrayLike, k: ArrayLike) -> NDArray[np.float64]:
    """Unpolarised reflectance of a smooth conductor of complex index η + ik seen from vacuum.

    cosine: n·v in [0, 1]; eta, k: broadcast against it. With c = cosine, s² = 1 − c²,
    a² + b² = √(D² + 4η²k²),  D = η² − k² − s²,  a² = ½(a² + b² + D) = 2η²k²/(a² + b² − D):
        R_s = (a² + b² + c² − 2ac) / (a² + b² + c² + 2ac),
        R_p = R_s (c²(a² + b²) + s⁴ − 2acs²) / (c²(a² + b²) + s⁴ + 2acs²),   **F = ½(R_s + R_p)**.
    η = 0, k = 1 (Mitsuba's material "none") gives exactly 1.
    """
    c, eta, k = (np.asarray(x, dtype=np.float64) for x in (cosine, eta, k))
    s2 = 1.0 - c * c
    difference = eta * eta - k * k - s2
    a2b2 = np.sqrt(difference**2 + 4.0 * eta**2 * k**2)
    shorter = np.where(difference < 0, a2b2 - difference, 1.0)  # without cancellation where D < 0
    a = np.sqrt(np.where(difference < 0, 2.0 * eta**2 * k**2 / shorter, 0.5 * (a2b2 + difference)))
    r_s = (a2b2 + c * c - 2 * a * c) / (a2b2 + c * c + 2 * a * c)
    r_p = r_s * (c * c * a2b2 + s2 * s2 - 2 * a * c * s2) / (c * c * a2b2 + s2 * s2 + 2 * a * c * s2)
    return 0.5 * (r_s + r_p)


def fresnel_dielectric(cosine: ArrayLike, eta: ArrayLike) -> NDArray[np.float64]:
    """Unpolarised reflectance of a smooth dielectric of relative index η (Heidrich, course notes, Eq 13).

    cosine: n·v in [0, 1]; eta: inside over outside, broadcast against it. With c = cosine and g² = η² + c² − 1, so that
    g = η cos θ_t (Snell), the two polarisations are
        R_s = ((g − c)/(g + c))²,   R_p = R_s · ((c(g + c) − 1)/(c(g − c) + 1))²,
        **F = ½ (g − c)²/(g + c)² · [1 + (c(g + c) − 1)²/(c(g − c) + 1)²]**.
    g − c = (η² − 1)/(g + c) cancels nothing near η = 1, where F = 0 exactly. g² ≤ 0 (η < 1 beyond the critical angle) is
    total reflection, F = 1.
    """
    c, eta = np.asarray(cosine, np.float64), np.asarray(eta, np.float64)
    g2 = eta * eta + c * c - 1.0
    g = np.sqrt(np.maximum(g2, 0.0))
    total = np.maximum(g + c, 1e-30)  # 0 only for η = 1 at c = 0: no surface, no reflection
    difference = (eta * eta - 1.0) / total
    r_s = (difference / total) ** 2
    ratio = (c * total - 1.0) / (c * difference + 1.0)
    return np.where((g2 <= 0.0) & (eta < 1.0), 1.0, 0.5 * r_s * (1.0 + ratio * ratio))


def fresnel_schlick(cosine: ArrayLike, normal_reflectance: ArrayLike) -> NDArray[np.float64]:
    """Schlick's approximation from the reflectance at normal incidence, Kautz's f_λ: **F = f_λ + (1 − f_λ)(1 − n·v)⁵**."""
    f, grazing = np.asarray(normal_reflectance, np.float64), 1.0 - np.asarray(cosine, np.float64)
    return f + (1.0 - f) * grazing**5


def eta_to_normal_reflectance(eta: ArrayLike) -> NDArray[np.float64]:
    """f_λ of a dielectric: Eq 13 at c = 1, where g = η: **f = ((η − 1)/(η + 1))²**."""
    eta = np.asarray(eta, np.float64)
    return ((eta - 1.0) / (eta + 1.0)) ** 2


def normal_reflectance_to_eta(normal_reflectance: ArrayLike) -> NDArray[np.float64]:
    """Inverse of `eta_to_normal_reflectance` for η ≥ 1: **η = (1 + √f)/(1 − √f)**."""
    root = np.sqrt(np.asarray(normal_reflectance, np.float64))
    return (1.0 + root) / (1.0 - root)
