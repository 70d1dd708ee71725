"""What earlier work took: `costs.jsonl` in the store, a line a reference rendered and a line a run, for `run --dry-run` to go by.

Nothing rests on it: a line that cannot be read is passed over, and where the file cannot be written it is left as it is."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from evalsuite.errors import EvalsuiteError

NAME = "costs.jsonl"
#: Of the file's end, what is read [bytes]; some ten thousand lines. A file of twice that is cut to it.
LATEST = 4 << 20


def append(root: Path, rows: Iterable[Mapping]) -> None:
    """Add rows, plain values each, to the file in the store `root`."""
    text = "".join(json.dumps(dict(row)) + "\n" for row in rows).encode()
    if not text:
        return
    with contextlib.suppress(OSError, EvalsuiteError):
        root.mkdir(parents=True, exist_ok=True)
        # One write to a file opened for appending: lines of runs at the same time do not mix.
        handle = os.open(root / NAME, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            os.write(handle, text)
            long = os.fstat(handle).st_size > 2 * LATEST
        finally:
            os.close(handle)
        if long:
            from evalsuite.store.cache import write_atomic

            write_atomic(root / NAME, _end(root / NAME))


def read(root: Path) -> list[dict]:
    """The rows of the file's end, oldest first; none where there is no file."""
    rows = []
    with contextlib.suppress(OSError):
        for line in _end(root / NAME).splitlines():
            with contextlib.suppress(ValueError, RecursionError):
                row = json.loads(line)
                if isinstance(row, dict):
                    rows.append(row)
    return rows


def _end(path: Path) -> bytes:
    with path.open("rb") as file:
        file.seek(max(0, os.fstat(file.fileno()).st_size - LATEST))
        text = file.read()
    return text if len(text) < LATEST else text[text.find(b"\n") + 1 :]
