"""Results on disk: `DIR/results.json` and the pictures it names. `report`, `check` and `figures` read only these."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock

from evalsuite.errors import EvalsuiteError
from evalsuite.store import kept
from evalsuite.store.cache import unwritable, write_atomic

SCHEMA = "evalsuite.results/1"


def slug(cell_id: str) -> str:
    """A folder name for a cell: readable, safe on every file system, and unique through a hash of the id."""
    readable = re.sub(r"[^A-Za-z0-9.=+-]+", "_", cell_id).strip("._")[:80]
    return f"{readable}-{hashlib.sha256(cell_id.encode()).hexdigest()[:8]}"


def prepare(directory: Path) -> None:
    """Make the output folder and prove that it can be written, before anything is rendered for it."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        probe = directory / ".writable"
        probe.write_text("")
        probe.unlink(missing_ok=True)  # another run's, just as well
    except OSError as error:
        raise unwritable(directory, error) from error


def read(directory: Path) -> dict:
    """results.json of a folder. Raises EvalsuiteError when absent, broken or of another schema."""
    path = directory / "results.json"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise EvalsuiteError(path, "no such file", "results of an earlier run", "type `evalsuite run` first") from None
    except (OSError, ValueError) as error:
        raise EvalsuiteError(path, f"a file that does not read ({error})", "results.json", "run again") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        got = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise EvalsuiteError(path, f"schema {got!r}", SCHEMA, "run again with this version")
    return data


@contextmanager
def writing(directory: Path) -> Iterator[None]:
    """One run at a time writes to a folder; another waits, and then writes its own over it."""
    try:
        lock = FileLock(directory / ".lock", poll_interval=0.02, mode=0o666)
        lock.acquire()
    except OSError as error:
        raise unwritable(directory, error) from error
    try:
        yield
    finally:
        lock.release()


def finished(directory: Path) -> bool:
    """Whether the pictures are those that results.json speaks of: a run killed between the two leaves them apart."""
    return (directory / "results.json").exists() and not (directory / _CHANGING).exists()


#: There while pictures change.
_CHANGING = ".changing"
#: What a killed run was writing.
_LEFTOVER = re.compile(r"\.(new|index|results|check)-\w{8}(\.\w+)?")


def write(directory: Path, header: dict, cells: Iterable[tuple[dict, dict[str, Path]]]) -> dict:
    """Keep each cell's pictures under `directory/images/` (`store.kept`; unchanged ones stay) and write results.json last, in one
    step. Pictures of cells that are gone are removed. Returns what was written. Raises Unwritable."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for path in directory.iterdir():
            if _LEFTOVER.fullmatch(path.name):
                path.unlink(missing_ok=True)
        placed = [(cell, kept.paths(cell, files, slug(cell["id"])), files) for cell, files in cells]
        ours = any((directory / name).exists() for name in ("results.json", _CHANGING))
        (directory / _CHANGING).touch()
        kept.write(directory, [(names, files) for _, names, files in placed], ours)
        results = {"schema": SCHEMA, **header, "cells": [cell | {"images": names} for cell, names, _ in placed]}
        write_atomic(directory / "results.json", json.dumps(results, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
        (directory / _CHANGING).unlink()
    except OSError as error:
        raise unwritable(directory, error) from error
    return results
