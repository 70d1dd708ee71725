"""Rounding of pictures to what is known of them, so that they compress."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Most and fewest bits after the leading one that a run's folder keeps of radiance. OpenEXR's PXR24 has 15: what is rounded to
#: fewer survives it.
MOST, FEWEST = 14, 8
#: Header of a rounded picture: its bits.
BITS = "significantBits"


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


def bits_in(array: ArrayLike) -> int:
    """Bits after the leading one, 0 to 23, that the values of floats use: what `significant` was given, or fewer."""
    used = int(np.bitwise_or.reduce(np.ascontiguousarray(array, np.float32).view(np.uint32), axis=None)) & 0x7FFFFF
    return 23 - (used & -used).bit_length() + 1 if used else 0


def bits_for(reference: NDArray, sigma: NDArray | None) -> int:
    """Bits of radiance for a reference and what is held against it: steps of about a 16th of its standard error, so that rounding
    adds nothing to the noise."""
    if sigma is None or not (sigma > 0).any():
        return MOST
    noise = float(np.median(sigma[sigma > 0] / np.maximum(np.abs(reference[sigma > 0]), 1e-12)))
    return int(np.clip(np.round(-np.log2(noise / 16)), FEWEST, MOST))


def stepped(array: ArrayLike, step: ArrayLike) -> NDArray[np.float32]:
    """Multiples of the largest power of two that is at most `step`, a number or one a value, to nearest; as it is for a step
    of 0."""
    values, step = np.asarray(array, np.float32), np.asarray(step, np.float32)
    power = np.where(step > 0, 2.0 ** np.floor(np.log2(np.where(step > 0, step, 1))), 1).astype(np.float32)
    return np.where(step > 0, np.round(values / power) * power, values)
