"""Windows against the ringing of degree-2 irradiance (Sloan, Stupid Spherical Harmonics Tricks, 2008), in float64.

A window scales band l of the coefficients by h_l with h₀ = 1: the mean irradiance stays, contrast is lost. Irradiance itself
cannot be negative; its nine coefficients' sum can, under small bright lights, because bands above 2 are missing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.sh import COSINE_LOBE

Float = NDArray[np.float64]

WINDOWS = ("hann", "lanczos", "laplacian")
BANDS = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2])


def factors(window: str, size: float) -> Float:
    """h_l of each of the nine coefficients, (9,).

    **hann: ½(1 + cos(πl/w))**, **lanczos: sin(πl/w)/(πl/w)**, both 0 for l ≥ w, with w = size > 0; **laplacian:
    1/(1 + λ l²(l + 1)²)**, the least squared error plus λ ∫ (∇²E)², with λ = size ≥ 0.
    """
    degree = BANDS.astype(np.float64)
    if window == "laplacian":
        return 1.0 / (1.0 + size * (degree * (degree + 1.0)) ** 2)
    x = degree / size
    value = 0.5 * (1.0 + np.cos(np.pi * x)) if window == "hann" else np.sinc(x)
    return np.where(x < 1.0, value, 0.0)


def minimum(coefficients: ArrayLike) -> Float:
    """Least E(n) over all unit n of each channel of L_i (9, C), (C,) [W m⁻²], to about 10⁻¹² of its scale.

    With degree 2, E = c₀ + b·n + nᵀMn: a quadratic on the sphere, whose minimum is that of its dual,
    **c₀ + max over μ ≤ λ_min(M) of μ − ¼ Σ_i b_i²/(λ_i − μ)** with λ_i the eigenvalues of M and b in its eigenvectors: concave in
    μ, and without a gap (trust-region problems have none, Boyd, Vandenberghe, Convex Optimization, App. B).
    """
    one, two = np.sqrt(3 / (4 * np.pi)), np.sqrt(15 / (4 * np.pi))
    e = COSINE_LOBE[:, None] * np.asarray(coefficients, np.float64)
    found = []
    for c in e.T:
        third, half = np.sqrt(5 / (16 * np.pi)) * c[6], 0.5 * two
        m = np.array([[half * c[8] - third, half * c[4], half * c[7]],
                      [half * c[4], -half * c[8] - third, half * c[5]],
                      [half * c[7], half * c[5], 2.0 * third]])  # fmt: skip
        values, vectors = np.linalg.eigh(m)
        b2 = (vectors.T @ (one * c[[3, 1, 2]])) ** 2
        # The slope 1 − ¼ Σ b²/(λ − μ)² changes sign between λ_min − ½|b| and λ_min.
        low, high = values[0] - 0.5 * np.sqrt(b2.sum()), values[0]
        for _ in range(200):
            middle = 0.5 * (low + high)
            gap = values - middle
            rising = (gap > 0).all() and 0.25 * (b2 / gap**2).sum() < 1.0
            low, high = (middle, high) if rising else (low, middle)
        gap = values - low
        dual = low - 0.25 * np.divide(b2, gap, out=np.zeros(3), where=gap > 0).sum()
        found.append(np.sqrt(1 / (4 * np.pi)) * c[0] + dual)
    return np.array(found)


def largest_without_ringing(window: str, coefficients: ArrayLike) -> tuple[Float, float]:
    """(h_l (9,), size) of the mildest window under which no channel's irradiance is negative (Sloan 2017): the largest w, or the
    smallest λ. Size inf (0 for λ) and h = 1 where none is needed.

    Found from the mild end on a grid of 1/w (λ/(1 + λ)) over [0, 1], then halved to 10⁻⁹; at 1/w = 1 the mean alone is left.
    """
    coefficients = np.asarray(coefficients, np.float64)

    def size(t: float) -> float:
        if window == "laplacian":
            return t / (1.0 - t) if t < 1.0 else np.inf
        return 1.0 / t if t > 0.0 else np.inf

    def negative(t: float) -> bool:
        windowed = factors(window, size(t))[:, None] * coefficients
        return bool((minimum(windowed) < 0.0).any())

    if not negative(0.0):
        return np.ones(9), size(0.0)
    grid = np.linspace(0.0, 1.0, 65)
    last = next((i for i in range(1, 65) if not negative(grid[i])), 64)
    low, high = grid[last - 1], grid[last]
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if negative(middle) else (low, middle)
    return factors(window, size(high)), size(high)
