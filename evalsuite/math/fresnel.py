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
