"""Colour conversions, each in this one place. Linear means linear Rec.709 (the primaries of sRGB)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Rec.709 luminance weights (ITU-R BT.709-6, item 3.2). They sum to 1.
LUMINANCE = (0.2126, 0.7152, 0.0722)


def srgb_to_linear(encoded: ArrayLike) -> NDArray:
    """(…) sRGB code values in [0, 1] → linear, IEC 61966-2-1. Keeps float32 as float32."""
    v = np.asarray(encoded)
    return np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.04045) + 0.055) / 1.055) ** 2.4).astype(v.dtype)


def linear_to_srgb(linear: ArrayLike) -> NDArray:
    """(…) linear values in [0, 1] → sRGB code values, IEC 61966-2-1. Keeps float32 as float32."""
    v = np.asarray(linear)
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * np.maximum(v, 0.0031308) ** (1 / 2.4) - 0.055).astype(v.dtype)


def luminance(rgb: ArrayLike) -> NDArray:
    """(…, 3) linear Rec.709 → (…) luminance, in the unit of the input."""
    return np.asarray(rgb) @ np.asarray(LUMINANCE, dtype=np.asarray(rgb).dtype)


def tone_map(rgb: ArrayLike, exposure: float) -> NDArray[np.float32]:
    """(…, 3) linear Rec.709 × exposure [1/unit of rgb], clamped to [0, 1] and sRGB-encoded, float32."""
    return linear_to_srgb(np.clip(np.asarray(rgb, np.float32) * np.float32(exposure), 0.0, 1.0))
