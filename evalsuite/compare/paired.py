"""How much better one picture is than another against the same reference: the reference's noise moves both errors alike, so that
the difference has a far narrower interval than either error."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import metrics
from evalsuite.compare.error_map import ROUNDING
from evalsuite.compare.statistics import extrapolated, standard_error
from evalsuite.compare.unified import Z95

Pixels = NDArray[np.float64]


def difference(metric: str, a: Pixels, b: Pixels, reference: Pixels, sigma: Pixels) -> tuple[float, float] | None:
    """95 % interval of metric(a) − metric(b); None for metrics that are no mean over pixels.

    a, b: pictures free of noise; reference: their common one, sigma its standard error; all (P, 3), the pixels scored. For
    `rel_rmse` and `psnr` the difference is that of `mse`, which orders pictures as they do (less is better for both). There it is
    **mean (a − R)² − (b − R)² = mean (a − b)(a + b − 2R)**, linear in R: no bias to remove, and standard deviation
    2 √Σ((a − b) σ)² over the number of values. For `rel_bias` it is that of the |mean errors|. (0, 0) for pictures that are the
    same but for the rounding of floats.
    """
    if np.abs(a - b).max() <= 4 * ROUNDING * np.abs(reference).mean():
        return 0.0, 0.0
    if metric == "rel_bias":
        mean, half = reference.mean(), Z95 * standard_error(sigma, False)
        # |ā − r| − |b̄ − r| is straight in the truth's mean r between ā and b̄, and constant outside.
        bends = [p for p in (a.mean(), b.mean()) if abs(p - mean) < half]
        ends = [abs(a.mean() - r) - abs(b.mean() - r) for r in (mean - half, mean + half, *bends)]
        return float(min(ends)), float(max(ends))
    errors = {
        "rel_rmse": (metrics.squared_error, 2.0),
        "psnr": (metrics.squared_error, 2.0),
        "relmse": (metrics.relative_squared_error(float(reference.mean())), 2.0),
        "mae": (metrics.absolute_error, 1.0),
        "smape": (metrics.symmetric_relative_error, 1.0),
    }
    if metric not in errors:
        return None
    error, order = errors[metric]

    def gap(truth: Pixels) -> Pixels:
        return error(a, truth) - error(b, truth)

    here, plus, minus = gap(reference), gap(reference + sigma), gap(reference - sigma)
    if not all(np.isfinite(g).all() for g in (here, plus, minus)):
        return None
    spread = standard_error((plus - minus) / 2, False)
    low, high = extrapolated(*(g.mean(axis=-1) for g in (here, plus, minus)), order, spread).ci95
    return (low, high) if math.isfinite(low) and math.isfinite(high) else None
