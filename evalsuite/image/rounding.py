"""Rounding of pictures to what is known of them, so that they compress."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Bits after the leading one that a run's folder keeps of radiance. OpenEXR's PXR24 has 15: what is rounded so survives it.
RADIANCE = 14


def significant(array: ArrayLike, bits: int) -> NDArray[np.float32]:
    """Floats with `bits` (1 to 23) binary digits after the leading one, to nearest: off by at most 2^−(bits+1), relative.
    NaN and Inf stay."""
    values = np.ascontiguousarray(array, np.float32)
    dropped = np.uint32(23 - bits)
    half = np.uint32((1 << dropped) >> 1)
    with np.errstate(over="ignore"):
        codes = ((values.view(np.uint32) + half) >> dropped) << dropped
    rounded = codes.astype(np.uint32).view(np.float32)
    return np.where(np.isfinite(values) & np.isfinite(rounded), rounded, values)


def stepped(array: ArrayLike, step: float) -> NDArray[np.float32]:
    """Multiples of the largest power of two that is at most `step`, to nearest; as it is for a step of 0."""
    values = np.asarray(array, np.float32)
    if not step > 0:
        return values
    power = np.float32(2.0 ** np.floor(np.log2(step)))
    return np.round(values / power) * power
