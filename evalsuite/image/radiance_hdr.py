"""Radiance .hdr (RGBE) decoding. Own code because the common decoders return zeros for a truncated file without a word."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError

_EXPECTED = "a complete Radiance picture (32-bit_rle_rgbe, -Y … +X …)"


def decode(data: bytes, where: Path, max_pixels: int) -> NDArray[np.float32]:
    """(H, W, 3) float32 linear Rec.709 from the bytes of a .hdr file. EXPOSURE lines are not applied (as in Mitsuba).

    Raises EvalsuiteError for anything but a complete top-down RGBE picture of at most max_pixels.
    """
    end = data.find(b"\n\n")
    size = re.compile(rb"-Y (\d{1,7}) \+X (\d{1,7})\r?\n").match(data, end + 2) if end > 0 else None
    if not data.startswith((b"#?RADIANCE", b"#?RGBE")) or size is None:
        raise EvalsuiteError(where, "no Radiance header", _EXPECTED)
    if b"FORMAT=" in data[:end] and b"FORMAT=32-bit_rle_rgbe" not in data[:end]:
        raise EvalsuiteError(where, "a pixel format other than RGBE", _EXPECTED)
    height, width = int(size[1]), int(size[2])
    if not 0 < height * width <= max_pixels:
        raise EvalsuiteError(where, f"{width} × {height} pixels", f"1 to {max_pixels} pixels")
    return _to_float(_scanlines(data, size.end(), width, height, where))


def _scanlines(data: bytes, at: int, width: int, height: int, where: Path) -> NDArray[np.uint8]:
    """(H, W, 4) uint8 RGBE. Each scanline is run-length coded by component after the mark 2, 2, width, or flat."""
    marked = 8 <= width < 32768 and data[at : at + 2] == b"\2\2"
    if not marked:
        flat = np.frombuffer(data, np.uint8, offset=at)
        if flat.size != width * height * 4:  # too few: truncated; else the run-length scheme of before 1991
            raise EvalsuiteError(where, f"{flat.size} bytes of pixels for {width} × {height}", _EXPECTED)
        return flat.reshape(height, width, 4)
    if len(data) - at < height * (4 + 8 * -(-width // 127)):  # all of it runs: the shortest that there is
        raise EvalsuiteError(where, f"{len(data) - at} bytes of pixels for {width} × {height}", _EXPECTED)
    rows = np.empty((height, 4, width), np.uint8)
    for y in range(height):
        if data[at : at + 4] != bytes((2, 2, width >> 8, width & 255)):
            raise EvalsuiteError(where, f"a truncated or damaged file (row {y} of {height})", _EXPECTED)
        line = bytearray()
        at += 4
        while len(line) < 4 * width:
            code = data[at] if at + 1 < len(data) else 0
            if code > 128:
                line += data[at + 1 : at + 2] * (code - 128)
                at += 2
            else:
                line += data[at + 1 : at + 1 + code]
                at += 1 + code
            if code == 0 or at > len(data) or len(line) > 4 * width:
                raise EvalsuiteError(where, f"a truncated or damaged file (row {y} of {height})", _EXPECTED)
        rows[y] = np.frombuffer(line, np.uint8).reshape(4, width)
    return rows.transpose(0, 2, 1)


def _to_float(rgbe: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Mantissa m and shared exponent e → m · 2^(e − 136), 0 where e = 0, as in most readers (Ward's adds ½ to m)."""
    exponent = rgbe[..., 3].astype(np.int32)
    scale = np.where(exponent > 0, np.ldexp(np.float32(1), exponent - 136), np.float32(0))
    return rgbe[..., :3].astype(np.float32) * scale[..., None]
