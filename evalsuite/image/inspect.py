"""Pictures that Mitsuba's native readers get, looked through before: damaged ones can end those in a crash, hold them up, or
take all memory."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr, ldr, radiance_hdr
from evalsuite.image.files import file_stamp, read_bytes


def check_picture(path: Path) -> None:
    """Raises EvalsuiteError for a damaged OpenEXR or Radiance picture, and for a PNG or JPEG whose header says more pixels than
    it can hold, by what is in the file, whatever its name. Other files are not looked at."""
    error = _problem(path, file_stamp(path))
    if error is not None:
        raise error


def is_exr(path: Path) -> bool:
    """Whether the file begins as OpenEXR does."""
    return read_bytes(path, 4) == b"\x76\x2f\x31\x01"


@lru_cache(maxsize=256)
def _problem(path: Path, stamp: tuple[int, ...]) -> EvalsuiteError | None:
    del stamp  # part of the key: a changed file is read again
    try:
        head = read_bytes(path, 4)
        if is_exr(path):
            exr.read_parts(path)
        elif head.startswith(b"#?"):
            radiance_hdr.decode(read_bytes(path), path, exr.MAX_PIXELS)
        elif head.startswith(ldr.MAGIC):
            ldr.check_size(path, read_bytes(path), exr.MAX_PIXELS)
    except EvalsuiteError as error:
        return error
    return None
