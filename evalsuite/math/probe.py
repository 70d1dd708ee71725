"""Where a probe samples its texels, and how few of them harmonics need."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Samples a texel and axis.
SUBSAMPLES = 4
#: Width of the level that SH coefficients are summed over (Kautz et al. §5.1.1: 8 × 8 pixels a face suffice).
SH_FACE_SIZE = 8


def subsample_offsets(k: int) -> NDArray[np.float64]:
    """(k², 2) places (x, y) of k × k samples within a texel, k a power of two: with n = k², sample s lies at
    **((s + ½)/n, (s̄ + ½)/n)**, s̄ the bits of s reversed (Hammersley's points, a (0, m, 2)-net).

    Each of n rows and n columns has one, and so has each box of area 1/n whose sides are powers of two: an edge along an axis
    is placed to 1/n of a texel. With a plain grid the flux of a lamp whose edges run along the texels errs by several per cent.
    """
    n = k * k
    bits = n.bit_length() - 1
    s = np.arange(n)
    reversed_bits = sum(((s >> bit) & 1) << (bits - 1 - bit) for bit in range(bits))
    return (np.stack([s, reversed_bits + 0 * s], axis=-1) + 0.5) / n
