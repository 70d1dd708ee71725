"""The object mask: pixels that lie on a scored object whole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

#: Sub-samples are all on the object; float32 sums of ones are exact.
WHOLE = 1 - 1e-6


def whole_pixels(coverage: NDArray) -> NDArray[np.bool_]:
    """(H, W) bool: covered whole, and so are the eight neighbours.

    A silhouette can clip a pixel's corner between two sub-samples. The GPU then sees no background there and Mitsuba's
    random samples see some, which beside a dark grazing edge is a fifth of the pixel; the neighbour across that corner shows
    it. An object too thin to have such pixels keeps those that are covered whole by themselves."""
    whole = coverage >= WHOLE
    inner = ndimage.binary_erosion(whole, np.ones((3, 3)), border_value=1)
    return inner if inner.any() else whole
