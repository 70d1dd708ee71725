"""Plain file handling for pictures: whole reads that fail clearly, writes that are never seen half done."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from evalsuite.errors import EvalsuiteError, Unwritable

#: Beginning of the name of a file that is being written; a killed process leaves such.
UNFINISHED = ".new-"
FORMATS = "an .exr, .hdr, .png or .jpg picture"


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place when the block succeeds: readers never see half a file.
    Raises Unwritable if the folder cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=UNFINISHED, suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise Unwritable(path, f"no way to write there ({error.strerror})", "a folder that can be written") from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        raise Unwritable(path, f"a failed write ({error})", "a folder that can be written, with room") from error
    finally:
        temporary.unlink(missing_ok=True)


def read_bytes(path: Path, count: int = -1) -> bytes:
    """The file's bytes (the first `count`, if given). Raises EvalsuiteError if it is missing, unreadable or empty."""
    try:
        with path.open("rb") as file:
            data = file.read(count)
    except OSError as error:
        raise EvalsuiteError(path, f"no readable file ({error.strerror})", FORMATS) from error
    if not data:
        raise EvalsuiteError(path, "an empty file", FORMATS)
    return data


def file_stamp(path: Path) -> tuple[int, ...]:
    """What changes with a file's content, without reading it. The inode's own time too: a program can set the other one back.
    Raises OSError."""
    status = path.stat()
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino
