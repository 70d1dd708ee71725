"""Results on disk: `DIR/results.json` and the pictures it names. `report`, `check` and `figures` read only these."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Iterable
from pathlib import Path

from evalsuite.errors import EvalsuiteError
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
        probe.unlink()
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


def write(directory: Path, header: dict, cells: Iterable[tuple[dict, dict[str, Path]]]) -> dict:
    """Copy each cell's pictures into `directory/images/<slug>/` (unchanged ones stay) and write results.json last, in one
    step. Pictures of cells that are gone are removed. Returns what was written."""
    results = {"schema": SCHEMA, **header, "cells": []}
    images = directory / "images"
    keep = set()
    try:
        for cell, files in cells:
            folder = images / slug(cell["id"])
            keep.add(folder.name)
            folder.mkdir(parents=True, exist_ok=True)
            for name, path in files.items():
                _copy(path, folder / f"{name}.exr")
            names = {name: f"images/{folder.name}/{name}.exr" for name in files}
            results["cells"].append(cell | {"images": names})
        if (directory / "results.json").exists() and images.is_dir():
            for folder in images.iterdir():
                if folder.name not in keep and re.search(r"-[0-9a-f]{8}$", folder.name):
                    shutil.rmtree(folder)
    except OSError as error:
        raise unwritable(directory, error) from error
    write_atomic(directory / "results.json", json.dumps(results, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    return results


def _copy(source: Path, target: Path) -> None:
    status = source.stat()
    if target.exists() and (target.stat().st_size, target.stat().st_mtime_ns) == (status.st_size, status.st_mtime_ns):
        return
    fresh = target.with_name(f".new-{target.name}")
    shutil.copy2(source, fresh)
    fresh.replace(target)
