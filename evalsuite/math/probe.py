"""Where a probe samples its texels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def subsample_offsets(k: int) -> NDArray[np.float64]:
    """(k, k, 2) places (x, y) of k × k samples within a texel, indexed [j, i]: **((i + (j + ½)/k)/k, (j + (i + ½)/k)/k)**.

    One in each cell of the grid and one in each of k² rows and columns (the canonical arrangement of multi-jittered sampling,
    Chiu, Shirley, Wang 1994): an edge along an axis is placed to 1/k² of a texel. With a plain grid the flux of a lamp whose
    edges run along the texels errs by several per cent.
    """
    j, i = np.meshgrid(np.arange(k), np.arange(k), indexing="ij")
    return np.stack([i + (j + 0.5) / k, j + (i + 0.5) / k], axis=-1) / k
