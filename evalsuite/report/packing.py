"""Pictures as text for the page, unpacked by `static/pixels.js`: whole numbers of steps, predicted from neighbours, deflated."""

from __future__ import annotations

import base64
import zlib

import numpy as np
from numpy.typing import NDArray

#: Steps of radiance [relative]: never finer than what OpenEXR's PXR24 keeps, never coarser than 1/256.
FINEST, COARSEST = 2.0**-16, 2.0**-8
#: Part of a pixel's standard error that a step is at most, for all pixels but the QUIETEST percent.
PART, QUIETEST = 0.5, 5.0
#: Codes beyond this are cut: 4 bytes a residual.
_LARGEST = 2**28
_NAN = _LARGEST + 1


def fineness(reference: NDArray, sigma: NDArray | None, mask: NDArray[np.bool_] | None = None) -> tuple[float, float]:
    """(step, soft) for a reference and all pictures held against it: they share codes, so that equal pixels stay equal. mask: the
    pixels whose noise decides."""
    values = np.abs(np.nan_to_num(reference, posinf=0.0, neginf=0.0)).astype(np.float64)
    soft = 1e-3 * float(values.mean()) or 1.0
    if sigma is None or not (sigma > 0).any():
        return FINEST, soft
    noisy = sigma > 0 if mask is None else (sigma > 0) & mask[(...,) + (None,) * (sigma.ndim - 2)]
    if not noisy.any():
        return FINEST, soft
    least = PART * float(np.percentile(sigma[noisy] / (values[noisy] + soft), QUIETEST))
    return float(np.clip(least, FINEST, COARSEST)), soft


def pack(picture: NDArray, step: float, soft: float = 0.0) -> dict[str, object]:
    """(H, W) or (H, W, 3) → JSON. With soft: steps of asinh(value/soft), so relative ones well above it; without: steps of the
    value itself. NaN stays NaN, what is infinite becomes very large.

    A pixel is predicted from its left and upper neighbours (median edge detector of LOCO-I, Weinberger et al. 2000), red and blue
    as their difference to green; residuals are interleaved by sign and written as planes of bytes, the low ones first."""
    values = np.asarray(picture, np.float64)
    with np.errstate(over="ignore"):
        scaled = np.arcsinh(values / soft) / step if soft else values / step
    codes = np.where(np.isnan(scaled), _NAN, np.clip(np.nan_to_num(scaled), -_LARGEST, _LARGEST).round()).astype(np.int64)
    if codes.ndim == 3:
        red, green, blue = np.moveaxis(codes, 2, 0)
        channels = [green, red - green, blue - green]
    else:
        channels = [codes]
    residuals = np.stack([channel - _predicted(channel) for channel in channels])
    folded = ((residuals << 1) ^ (residuals >> 63)).astype(np.uint64)
    count = max(1, (int(folded.max()).bit_length() + 7) // 8)
    planes = [((folded >> np.uint64(8 * k)) & np.uint64(255)).astype(np.uint8).tobytes() for k in range(count)]
    text = base64.b64encode(zlib.compress(b"".join(planes), 6)).decode("ascii")
    return {"channels": len(channels), "step": step, "soft": soft, "planes": count, "nan": _NAN, "data": text}


def _predicted(c: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each pixel's prediction; 0 beyond the picture, but the neighbour that there is along the first row and column."""
    out = np.zeros_like(c)
    left, above, corner = c[1:, :-1], c[:-1, 1:], c[:-1, :-1]
    low, high = np.minimum(left, above), np.maximum(left, above)
    out[1:, 1:] = np.where(corner >= high, low, np.where(corner <= low, high, left + above - corner))
    out[0, 1:], out[1:, 0] = c[0, :-1], c[:-1, 0]
    return out
