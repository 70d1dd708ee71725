"""What each metric measures, on noise-free pictures: error per pixel, before any averaging or statistics.

`image` and `reference` are (…, 3) linear Rec.709 of any equal shape. `scale` is the mean of the reference over the region
scored; ε = `EPSILON`·scale keeps relative errors finite in the dark.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

#: ε of relmse and of the relative map, as a fraction of the mean reference (interface: 1 %).
EPSILON = 0.01
#: White point: this percentile of the reference's luminance in the mask is mapped to 1, and is psnr's peak.
WHITE_PERCENTILE = 99.0

Pixels = NDArray[np.float64]
PerChannel = Callable[[Pixels, Pixels], Pixels]


def squared_error(image: Pixels, reference: Pixels) -> Pixels:
    """(a − b)², per channel."""
    return np.square(image - reference)


def relative_squared_error(scale: float) -> PerChannel:
    """(a − b)² / (b² + ε²), per channel; 0 where both are 0 and the mean reference is 0."""

    def error(image: Pixels, reference: Pixels) -> Pixels:
        return _divide(np.square(image - reference), np.square(reference) + (EPSILON * scale) ** 2)

    return error


def absolute_error(image: Pixels, reference: Pixels) -> Pixels:
    """|a − b|, per channel."""
    return np.abs(image - reference)


def symmetric_relative_error(image: Pixels, reference: Pixels) -> Pixels:
    """2 |a − b| / (|a| + |b|), in [0, 2], per channel; 0 where both are 0 (the terms of SMAPE)."""
    return _divide(2 * np.abs(image - reference), np.abs(image) + np.abs(reference))


def largest_channel_error(image: Pixels, reference: Pixels) -> Pixels:
    """(…, 3) → (…): the largest |a − b| of a pixel's channels."""
    return np.abs(image - reference).max(axis=-1)


def _divide(numerator: Pixels, denominator: Pixels) -> Pixels:
    """numerator / denominator; 0/0 = 0, x/0 = ∞."""
    if denominator.all():
        return numerator / denominator
    safe = np.where(denominator != 0, denominator, 1.0)
    return np.where(denominator != 0, numerator / safe, np.where(numerator != 0, np.inf, 0.0))
