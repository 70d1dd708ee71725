"""The page's unpacking (`static/pixels.js`) in Python."""

from __future__ import annotations

import base64
import zlib

import numpy as np
from numpy.typing import NDArray


def unpack(packed: dict, height: int, width: int) -> NDArray[np.float32]:
    """What `pack` has packed, as the page reads it: (H, W) or (H, W, 3)."""
    channels, count = packed["channels"], packed["planes"]
    planes = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), np.uint8)
    planes = planes.reshape(count, channels, height, width).astype(np.int64)
    folded = sum(plane << (8 * k) for k, plane in enumerate(planes))
    codes = (folded >> 1) ^ -(folded & 1)
    for channel in codes:
        for y in range(height):
            for x in range(width):
                channel[y, x] += _predict(channel, y, x)
    codes = np.stack([codes[1] + codes[0], codes[0], codes[2] + codes[0]], -1) if channels == 3 else codes[0]
    values = packed["soft"] * np.sinh(codes * packed["step"]) if packed["soft"] else codes * packed["step"]
    return np.where(codes == packed["nan"], np.nan, values).astype(np.float32)


def _predict(c: NDArray[np.int64], y: int, x: int) -> int:
    if not (x and y):
        return c[y, x - 1] if x else c[y - 1, x] if y else 0
    left, above, corner = c[y, x - 1], c[y - 1, x], c[y - 1, x - 1]
    low, high = min(left, above), max(left, above)
    return low if corner >= high else high if corner <= low else left + above - corner
