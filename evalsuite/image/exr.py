"""Pictures on disk: OpenEXR in full, Radiance .hdr and PNG/JPEG for reading.

Arrays are (H, W, 3) float32 linear Rec.709, row 0 at the top; a map of one channel is (H, W).
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import ArrayLike, NDArray

from evalsuite.errors import EvalsuiteError, Unwritable
from evalsuite.image import ldr, radiance_hdr, rounding
from evalsuite.image.files import FORMATS, read_bytes, replacing

#: Largest picture read [pixels]: a 16k × 8k environment. A damaged header can ask for terabytes, which must not be tried.
MAX_PIXELS = 1 << 27
#: Most channels of such a picture, and what one byte of a file can hold of half floats [bytes], with DWA and without: black
#: pictures measure 11 700 and 900.
MAX_CHANNELS, MOST_PACKED = 8, {True: 1 << 16, False: 1 << 12}

Image = NDArray[np.float32]


def write(
    path: Path | str,
    image: ArrayLike | Mapping[str, ArrayLike],
    header: Mapping[str, object] | None = None,
    compression: str = "ZIP",
) -> None:
    """Write one picture, or several named parts, as OpenEXR, atomically: float32 but for HALF.

    image: (H, W, 3) linear Rec.709 or (H, W), or {part name: such an array}; the first part is what other programs show.
    header: extra attributes of the first part (str, int, float). NaN and Inf are kept. compression: ZIP, lossless, PXR24,
    which keeps 15 bits of a float's mantissa, or HALF: ZIP of half floats.
    Raises Unwritable if the folder cannot be written or is full, EvalsuiteError if an array has another shape.
    """
    path = Path(path)
    parts = image if isinstance(image, Mapping) else {"image": image}
    kind = OpenEXR.PXR24_COMPRESSION if compression == "PXR24" else OpenEXR.ZIP_COMPRESSION
    fixed = {"compression": kind, "type": OpenEXR.scanlineimage}
    pieces = [_part(path, name, array, (header or {}) if i == 0 else {}, fixed) for i, (name, array) in enumerate(parts.items())]
    for piece in pieces if compression == "HALF" else ():
        for channel in piece.channels.values():
            channel.pixels = channel.pixels.astype(np.float16)
    with replacing(path) as temporary:
        with OpenEXR.File(pieces) as file:
            file.write(str(temporary))
        _require_whole(path, temporary)


def _require_whole(path: Path, written: Path) -> None:
    """The library keeps silent when the last of what it has buffered finds the disk full."""
    try:
        read_parts(written)
    except EvalsuiteError as error:
        raise Unwritable(path, "a write cut short", "a folder with space left", "make room, or choose another") from error


def read(path: Path | str, part: str | None = None) -> Image:
    """Read .exr (the first part, or the one named), .hdr, .png or .jpg as (H, W, 3) float32 linear Rec.709.

    A single channel is repeated three times, alpha is dropped, 8- and 16-bit pictures are decoded from sRGB. NaN and Inf
    are kept. Raises EvalsuiteError for a missing, truncated, damaged or oversized file.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind == ".exr":
        parts = read_parts(path)
        if part is not None and part not in parts:
            raise EvalsuiteError(path, f"parts {', '.join(parts)}", f"a part named {part}")
        array = parts[part] if part is not None else next(iter(parts.values()))
    elif kind == ".hdr":
        array = radiance_hdr.decode(read_bytes(path), path, MAX_PIXELS)
    elif kind in ldr.SUFFIXES:
        array = ldr.read(path, read_bytes(path), MAX_PIXELS)
    else:
        raise EvalsuiteError(path, f"a file ending in '{path.suffix}'", FORMATS)
    return array if array.ndim == 3 else np.repeat(array[..., None], 3, axis=2)


def read_parts(path: Path | str) -> dict[str, Image]:
    """All parts of an OpenEXR file by name: (H, W, 3) for colours, (H, W) for parts of one channel."""
    path = Path(path)
    read_bytes(path, 4)
    expected = "a complete OpenEXR picture"
    with _quiet() as said:
        try:
            with OpenEXR.File(str(path), header_only=True) as file:
                headers = [dict(p.header) for p in file.parts]
            for header in headers:
                _check_header(path, header)
            with OpenEXR.File(str(path), separate_channels=True) as file:
                parts = {
                    str(header.get("name", f"part {i}")): _channels(path, p.channels)
                    for i, (header, p) in enumerate(zip(headers, file.parts, strict=False))
                }
        except EvalsuiteError:
            raise
        except Exception as error:  # the library raises RuntimeError, ValueError, TypeError … on damaged files
            raise EvalsuiteError(path, f"a damaged file ({error})", expected) from error
    # A part whose pixels cannot be read is dropped by the library with a printed warning.
    if len(parts) < len(headers) or not parts:
        raise EvalsuiteError(path, f"a truncated or damaged file ({' '.join(said.getvalue().split())[:120]})", expected)
    return parts


def read_header(path: Path | str) -> dict[str, object]:
    """The attributes of the first part, without reading pixels."""
    path = Path(path)
    read_bytes(path, 4)
    with _quiet():
        try:
            with OpenEXR.File(str(path), header_only=True) as file:
                return dict(file.parts[0].header)
        except Exception as error:
            raise EvalsuiteError(path, f"a damaged file ({error})", "a complete OpenEXR picture") from error


def coarsest(paths: Iterable[Path | str]) -> Callable[[Image], Image]:
    """The rounding that makes pictures of the store and of a run's folder alike to the last bit: that of the coarsest file."""
    bits = min(map(significant_bits, paths), default=23)
    return lambda picture: rounding.significant(picture, bits)


def significant_bits(path: Path | str) -> int:
    """Bits after the leading one that a picture was rounded to; 23, all that a float has, where its file states none."""
    return int(read_header(path).get(rounding.BITS, 23))


def _part(path: Path, name: str, array: ArrayLike, header: Mapping[str, object], fixed: Mapping[str, object]) -> OpenEXR.Part:
    # A non-contiguous array would be written wrong without a word.
    pixels = np.ascontiguousarray(array, dtype=np.float32)
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = np.ascontiguousarray(pixels[..., 0])
    if not (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)) or 0 in pixels.shape:
        raise EvalsuiteError(path, f"an array of shape {pixels.shape}", "(H, W, 3) or (H, W)")
    attributes = {key: _attribute(path, key, value) for key, value in header.items()}
    return OpenEXR.Part({**attributes, **fixed}, {"RGB" if pixels.ndim == 3 else "Y": pixels}, name)


def _attribute(path: Path, key: str, value: object) -> str | int | float:
    """A plain value that the library stores as it is: it refuses NumPy scalars and wraps integers beyond 32 bits."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, bool) or (isinstance(value, int) and abs(value) >= 2**31):
        return str(value)
    if not isinstance(value, str | int | float):
        raise EvalsuiteError(path, f"header {key} of type {type(value).__name__}", "str, int or float")
    return value


def _check_header(path: Path, header: Mapping[str, object]) -> None:
    low, high = (np.asarray(v, dtype=np.int64) for v in header["dataWindow"])
    width, height = (int(n) for n in high - low + 1)
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise EvalsuiteError(path, f"{width} × {height} pixels", f"1 to {MAX_PIXELS} pixels")
    check_claim(path, header)
    if "deep" in str(header.get("type", "")):
        raise EvalsuiteError(path, "deep data", "a flat picture")


def check_claim(path: Path, header: Mapping[str, object]) -> None:
    """Raises EvalsuiteError for a header that says more pixels than its file can hold, before room is made for them."""
    low, high = (np.asarray(v, dtype=np.int64) for v in header["dataWindow"])
    width, height = (int(n) for n in high - low + 1)
    claimed = 2 * width * height * max(1, len(header.get("channels", ())))
    size, packed = path.stat().st_size, MOST_PACKED["DWA" in str(header.get("compression"))]
    if claimed > size * packed or claimed > 2 * MAX_CHANNELS * MAX_PIXELS:
        raise EvalsuiteError(path, f"{width} × {height} pixels in {size} bytes", "a complete OpenEXR picture", "it is damaged")
    tile = header.get("tiles")
    if tile is not None and int(tile.xSize) * int(tile.ySize) > MAX_PIXELS:
        raise EvalsuiteError(path, f"tiles of {tile.xSize} × {tile.ySize} pixels", f"at most {MAX_PIXELS} pixels")


def _channels(path: Path, channels: Mapping[str, OpenEXR.Channel]) -> Image:
    """R, G, B (of the unnamed layer, else of the first that has all three), else Y, else the only channel."""
    layers = ["", *sorted({name.rpartition(".")[0] + "." for name in channels if "." in name})]
    for layer in layers:
        names = [layer + c for c in "RGB"]
        if all(name in channels for name in names):
            return np.stack([_plane(path, channels[name]) for name in names], axis=-1)
    single = "Y" if "Y" in channels else next(iter(channels)) if len(channels) == 1 else None
    if single is None or {"RY", "BY"} & set(channels):
        raise EvalsuiteError(path, f"channels {', '.join(channels) or 'none'}", "R, G, B or Y")
    return _plane(path, channels[single])


def _plane(path: Path, channel: OpenEXR.Channel) -> Image:
    if channel.pixels is None or (channel.xSampling, channel.ySampling) != (1, 1):
        raise EvalsuiteError(path, f"channel {channel.name} missing or subsampled", "a value for every pixel")
    return np.asarray(channel.pixels, dtype=np.float32)


_redirecting = threading.Lock()  # file descriptors belong to the whole process: one redirection at a time


@contextlib.contextmanager
def _quiet() -> Iterator[io.StringIO]:
    """Catch what the OpenEXR library prints about damaged files: through Python on stdout, from C on stderr."""
    said = io.StringIO()
    with _redirecting:
        sys.stderr.flush()
        kept = os.dup(2)
        try:
            with open(os.devnull, "w") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            with contextlib.redirect_stdout(said):
                yield said
        finally:
            os.dup2(kept, 2)
            os.close(kept)
