"""Results on disk: `DIR/results.json` and the pictures it names. `report`, `check` and `figures` read only these."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock

from evalsuite.errors import EvalsuiteError
from evalsuite.image.files import UNFINISHED
from evalsuite.store import kept
from evalsuite.store.cache import unwritable, write_atomic
from evalsuite.store.json_file import read_json

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


#: Folders and files that a run writes into, whatever they are links to: the others it replaces.
OURS = ("images", "cells", "static", "pictures", "rankings", "envelopes", "history.sqlite", ".lock", ".changing")


def no_way_out(directory: Path) -> None:
    """Raises EvalsuiteError where a link in an output folder leads out of it: what is written there, or tidied away, would be
    elsewhere."""
    root = Path(directory).resolve()
    for name in OURS:
        found = [Path(directory, name)]
        for folder, folders, _ in os.walk(found[0]):
            found += [Path(folder, one) for one in folders]
        for path in found:
            if path.is_symlink() and not path.resolve().is_relative_to(root):
                raise EvalsuiteError(path, f"a link to {path.resolve()}", "an output folder that keeps to itself", "remove it")


def read(directory: Path) -> dict:
    """results.json of a folder. Raises EvalsuiteError when absent, broken or of another schema."""
    path = directory / "results.json"
    try:
        data = read_json(path)
    except FileNotFoundError:
        raise EvalsuiteError(path, "no such file", "results of an earlier run", "type `evalsuite run` first") from None
    except (OSError, ValueError) as error:
        raise EvalsuiteError(path, f"a file that does not read ({error})", "results.json", "run again") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        got = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise EvalsuiteError(path, f"schema {got!r}", SCHEMA, "run again with this version")
    check_cells(path, data.get("cells"))
    return data


def check_cells(where: object, cells: object) -> None:
    """Raises EvalsuiteError unless these are cells with what is read of every one: an id of its own, a status, metrics with
    their intervals."""
    if not isinstance(cells, list) or not all(map(_well_formed, cells)):
        raise EvalsuiteError(where, "cells without an id, a status or whole metrics", "a run's results", "run again")
    for cell in cells:
        for name, place in (cell.get("images") or {}).items():
            if not (_plain_name(name) and _within(place)):
                raise EvalsuiteError(where, f"{place!r} as {name} of {cell['id']}", "a picture in its folder", "run again")
    if len({cell["id"] for cell in cells}) < len(cells):
        raise EvalsuiteError(where, "two cells of one id", "a run's results", "run again")


def _well_formed(cell: object) -> bool:
    if not isinstance(cell, dict) or not all(isinstance(cell.get(name), str) for name in ("id", "status")):
        return False
    named = [cell.get(name) or {} for name in ("metrics", "images", "all_parameters", "cost")]
    if not all(isinstance(one, dict) for one in named) or (cell["status"] == "scored" and not cell.get("metrics")):
        return False
    truths = cell.get("truths") or {}
    if not isinstance(truths, dict) or not all(map(_plain_name, (*truths, *truths.values(), cell.get("environment_id") or "0"))):
        return False
    return all(map(_metric, named[0].values()))


def _plain_name(name: object) -> bool:
    """Whether it names a file or folder in the one it is put in."""
    return isinstance(name, str) and re.fullmatch(r"[\w=+-][\w.=+-]*", name) is not None


def _within(place: object) -> bool:
    """Whether it is a path that stays below where it begins, as far as its words tell."""
    return isinstance(place, str) and all(map(_plain_name, place.split("/")))


def _metric(metric: object) -> bool:
    if not isinstance(metric, dict) or not isinstance(metric.get("ci95"), list) or len(metric["ci95"]) != 2:
        return False
    return all(v is None or type(v) in (int, float) for v in (metric.get("value", ""), *metric["ci95"]))


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
_LEFTOVER = re.compile(re.escape(UNFINISHED) + r"\w{8}(\.\w+)?")


def _sweep(directory: Path) -> None:
    for top in (directory, *(directory / name for name in OURS)):
        for folder, folders, files in os.walk(top):
            for name in filter(_LEFTOVER.fullmatch, files):
                Path(folder, name).unlink(missing_ok=True)
            if top == directory:
                folders.clear()  # of those beside ours nothing is known


def write(directory: Path, header: dict, cells: Iterable[tuple[dict, dict[str, Path]]]) -> dict:
    """Keep each cell's pictures under `directory/images/` (`store.kept`; unchanged ones stay) and write results.json last, in one
    step. Pictures of cells that are gone are removed. Returns what was written. Raises Unwritable."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        _sweep(directory)
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
