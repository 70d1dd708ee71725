"""Maps of where a picture is wrong. Signed error = image − reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.metrics import EPSILON

#: |z| below this is what noise alone does to 95 % of pixels: there noise decides, not the error.
NOISE_DECIDES = 2.0
#: Largest z stored; beyond it only the certainty grows.
MAX_Z = 1000.0
#: Relative rounding of float32 sums in either renderer: no standard error is believed below this share of the value.
ROUNDING = 2.0**-20


def signed(image: NDArray, reference: NDArray) -> NDArray[np.float32]:
    """(H, W, 3) image − reference, in the unit of the pictures."""
    return (image - reference).astype(np.float32)


def relative(image: NDArray, reference: NDArray, scale: float) -> NDArray[np.float32]:
    """(H, W, 3) (image − reference) / (reference + ε), ε = 1 % of `scale`, the mean reference in the mask; 0 for 0/0."""
    denominator = np.maximum(reference, 0.0) + EPSILON * scale
    safe = np.where(denominator > 0, denominator, 1.0)
    return np.where(denominator > 0, (image - reference) / safe, np.sign(image - reference)).astype(np.float32)


def z_score(image: NDArray, reference: NDArray, standard_error: NDArray, scale: float) -> NDArray[np.float32]:
    """(H, W) |error| in standard errors: mean of the channels' |error| over the mean of their standard errors (channels
    taken as fully correlated), at most MAX_Z."""
    error = np.abs(image - reference).mean(axis=2)
    sigma = standard_error.mean(axis=2) + ROUNDING * (np.abs(reference).mean(axis=2) + abs(scale))
    safe = np.where(sigma > 0, sigma, 1.0)
    return np.minimum(np.where(sigma > 0, error / safe, np.where(error > 0, MAX_Z, 0.0)), MAX_Z).astype(np.float32)
