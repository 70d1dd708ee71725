"""The largest coherent mistake of a picture: connected pixels that are off by more than a threshold, and by more than noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evalsuite.compare.regions import Mask
from evalsuite.compare.statistics import Z95, Metric

#: Of the mean luminance of the reference within the mask.
THRESHOLD = 0.05
#: Standard errors: one pixel in 370 is beyond them by noise alone, hardly ever two neighbours.
BEYOND = 3.0


def largest_blob(
    difference: NDArray, standard_error: NDArray, inside: Mask, mean: float, threshold: float = THRESHOLD
) -> tuple[dict[str, object], Mask] | None:
    """The largest 8-connected set of pixels of one sign, in the mask, where |image − reference| exceeds `threshold` × mean and
    BEYOND standard errors; None where there is no such pixel.

    difference, standard_error: (H, W) of the luminance. mean: of the reference's luminance within the mask.
    Returns ({threshold [radiance], pixels, share: of the mask's pixels, box: (x, y, width, height) [pixels], peak: the largest
    difference in it, mean_error: the mean one [radiance, value and ci95]}, (H, W) bool)."""
    limit = threshold * mean
    strong = inside & (np.abs(difference) > np.maximum(limit, BEYOND * standard_error))
    best, size = None, 0
    for sign in (1.0, -1.0):
        labels, count = ndimage.label(strong & (sign * difference > 0), np.ones((3, 3)))
        if count:
            sizes = np.bincount(labels.ravel())[1:]
            if sizes.max() > size:
                size, best = int(sizes.max()), labels == 1 + int(np.argmax(sizes))
    if best is None:
        return None
    error, sigma = difference[best].astype(np.float64), standard_error[best].astype(np.float64)
    top = int(np.argmax(np.abs(error)))
    rows, columns = np.flatnonzero(best.any(1)), np.flatnonzero(best.any(0))
    found = {
        "threshold": float(limit),
        "pixels": size,
        "share": size / int(inside.sum()),
        "box": [int(v) for v in (columns[0], rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1)],
        "peak": _metric(error[top], sigma[top]),
        "mean_error": _metric(error.mean(), np.sqrt((sigma**2).sum()) / size),
    }
    return found, best


def _metric(value: float, deviation: float) -> dict[str, object]:
    return Metric(float(value), (float(value - Z95 * deviation), float(value + Z95 * deviation))).to_json()
