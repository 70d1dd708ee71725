"""The 95 % interval of a quantity that cannot be negative, from an estimate that can: Feldman and Cousins, A Unified Approach to
the Classical Statistical Analysis of Small Signals, Phys. Rev. D 57, 1998, §IV.B (a normal estimate near a physical boundary).

A debiased mean square is such an estimate: near normal, and below 0 as often as above where the picture has no error. Cutting
its usual interval at 0 would hold a true 0 in 97.5 % of all cases, and be empty in the rest. Of all estimates x that a true
value μ may give, the unified one takes those first whose likelihood is largest against that of the best value x allows,
max(x, 0), until they make up 95 %; the interval of x is all μ that take it. It holds every μ ≥ 0 in 95 %, is never empty, and
is the usual x ± 1.96 σ from x = 3.92 σ on.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

#: Two-sided 95 % quantile of the normal distribution.
Z95 = 1.959963984540054
#: Standard deviations below 0 beyond which an upper end shrinks no more.
FAR = 1000.0


def nonnegative_interval(value: float, deviation: float) -> tuple[float, float]:
    """(lower, upper) end in the unit of `value`, a normal estimate of standard deviation `deviation` ≥ 0 of a quantity ≥ 0."""
    if deviation == 0.0:
        return max(value, 0.0), max(value, 0.0)
    true, first, last = _belt()
    x = max(value / deviation, -FAR)
    lower = x - Z95 if x >= last[-1] else float(np.interp(x, last, true, left=0.0))
    upper = x + Z95 if x >= 0.0 else float(np.interp(x, first, true))
    return lower * deviation, upper * deviation


@lru_cache(1)
def _belt() -> tuple[NDArray, NDArray, NDArray]:
    """(μ, first x, last x) that a true value μ ≤ Z95 takes, all in standard deviations. With t = last − μ, likelihood ratios
    equal at both ends (exp(−t²/2) above 0, exp(xμ − μ²/2) below) put the first at −(t² − μ²) / 2μ."""
    true = np.append(np.geomspace(1e-4, 0.1, 2000)[:-1], np.linspace(0.1, Z95, 2000))
    low, high = np.full(true.shape, 1.6), np.full(true.shape, 2.0)
    for _ in range(60):
        t = (low + high) / 2
        short = ndtr(t) - ndtr(-(true**2 + t**2) / (2 * true)) < 0.95
        low, high = np.where(short, t, low), np.where(short, high, t)
    return true, -(high**2 - true**2) / (2 * true), true + high
