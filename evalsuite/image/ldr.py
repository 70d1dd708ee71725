"""8- and 16-bit pictures: reading PNG and JPEG, writing PNG previews. sRGB-encoded on disk, linear in memory."""

from __future__ import annotations

import zlib
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image.color import srgb_to_linear
from evalsuite.image.files import replacing

SUFFIXES = (".png", ".jpg", ".jpeg")
_PNG = b"\x89PNG\r\n\x1a\n"
MAGIC = (_PNG[:4], b"\xff\xd8\xff")
#: Most pixels that a byte of a file holds: black of one bit a pixel, deflated.
MOST_PACKED = 8 * 1032


def check_size(path: Path, data: bytes, max_pixels: int) -> None:
    """Raises EvalsuiteError for a header that cannot be read, or says more than max_pixels or than the file can hold."""
    try:
        height, width = iio.improps(data, plugin="pillow").shape[:2]
    except Exception as error:  # as in `read`
        raise EvalsuiteError(path, f"a damaged or oversized picture ({error})", "a complete PNG or JPEG picture") from error
    if height * width > min(max_pixels, len(data) * MOST_PACKED):
        raise EvalsuiteError(path, f"{width} × {height} pixels in {len(data)} bytes", "a complete PNG or JPEG picture")


def read(path: Path, data: bytes, max_pixels: int) -> NDArray[np.float32]:
    """(H, W, 3) or (H, W) float32 linear Rec.709. Raises EvalsuiteError for damaged or oversized pictures."""
    try:
        if data.startswith(_PNG) and data[24:25] == b"\x10":
            codes = _png16(data, max_pixels)  # Pillow, below imageio, would drop the lower 8 bits without a word
        else:
            check_size(path, data, max_pixels)
            codes = iio.imread(data, plugin="pillow")
    except EvalsuiteError:
        raise
    except Exception as error:  # imageio's plugins raise OSError, SyntaxError, ValueError … on damaged files
        raise EvalsuiteError(path, f"a damaged or oversized picture ({error})", "a complete PNG or JPEG picture") from error
    encoded = codes.astype(np.float32) / np.float32(65535 if codes.dtype == np.uint16 else 1 if codes.dtype == bool else 255)
    if encoded.ndim == 3:
        encoded = encoded[..., 0] if encoded.shape[2] <= 2 else encoded[..., :3]
    return srgb_to_linear(encoded)


def write_png(path: Path, encoded: ArrayLike) -> None:
    """encoded: (H, W, 3) sRGB code values in [0, 1]; written with 8 bits, atomically."""
    codes = np.round(np.clip(np.asarray(encoded), 0, 1) * 255).astype(np.uint8)
    with replacing(Path(path)) as temporary:
        iio.imwrite(temporary, codes, extension=".png", compress_level=4)


def write_webp(path: Path, encoded: ArrayLike, quality: int = 90) -> None:
    """As `write_png`, lossy, in a quarter of the bytes: for previews."""
    codes = np.round(np.clip(np.asarray(encoded), 0, 1) * 255).astype(np.uint8)
    with replacing(Path(path)) as temporary:
        iio.imwrite(temporary, codes, extension=".webp", quality=quality)


def _png16(data: bytes, max_pixels: int) -> NDArray[np.uint16]:
    """(H, W, C) from a 16-bit, non-interlaced PNG (W3C PNG specification, third edition, §9: filtering)."""
    width, height = (int.from_bytes(data[i : i + 4], "big") for i in (16, 20))
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[data[25]]
    if data[28] or not 0 < width * height <= min(max_pixels, len(data) * MOST_PACKED):
        raise ValueError(f"interlaced, or {width} × {height} pixels")
    packed, at = bytearray(), 8
    while data[at + 4 : at + 8] != b"IEND":
        if at + 12 > len(data):
            raise ValueError("truncated")
        length = int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] == b"IDAT":
            packed += data[at + 8 : at + 8 + length]
        at += 12 + length
    lane = 2 * channels  # bytes a pixel
    size = height * (1 + width * lane)
    rows = np.frombuffer(zlib.decompressobj().decompress(packed, size), np.uint8).reshape(height, 1 + width * lane)
    out = np.zeros((height + 1, width, lane), np.uint8)
    for y, row in enumerate(rows):
        out[y + 1] = _unfilter(int(row[0]), row[1:].reshape(width, lane), out[y])
    return out[1:].reshape(height, width, channels, 2).view(">u2")[..., 0].astype(np.uint16)


def _unfilter(kind: int, row: NDArray[np.uint8], above: NDArray[np.uint8]) -> NDArray[np.uint8]:
    if kind == 0:
        return row
    if kind == 1:
        return np.cumsum(row, axis=0, dtype=np.uint8)
    if kind == 2:
        return row + above
    if kind not in (3, 4):
        raise ValueError(f"filter {kind}")
    out = np.empty_like(row)
    for lane in range(row.shape[1]):
        left = corner = 0
        decoded = bytearray()
        for value, up in zip(row[:, lane].tolist(), above[:, lane].tolist(), strict=True):
            if kind == 3:
                guess = (left + up) // 2
            else:
                p = left + up - corner
                a, b, c = abs(p - left), abs(p - up), abs(p - corner)
                guess = left if a <= b and a <= c else up if b <= c else corner
            left, corner = (value + guess) & 255, up
            decoded.append(left)
        out[:, lane] = decoded
    return out
