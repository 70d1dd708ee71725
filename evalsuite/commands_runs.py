"""What `evalsuite compare RUN_A RUN_B` does, without its printing."""

from __future__ import annotations

import json
from pathlib import Path

from evalsuite.compare.run_folder import Run
from evalsuite.compare.runs import compare_runs
from evalsuite.errors import EvalsuiteError
from evalsuite.store import results as store_results
from evalsuite.store.cache import write_atomic

SCHEMA = "evalsuite.comparison/1"


def are_runs(*paths: Path) -> bool:
    """Whether all are runs: folders, or a results.json. Raises EvalsuiteError for a run beside a picture."""
    runs = [path.is_dir() or path.suffix == ".json" for path in paths]
    if any(runs) and not all(runs):
        raise EvalsuiteError(paths[runs.index(False)], "no folder", "two pictures, or the folders of two runs")
    return all(runs)


def compare_folders(a: Path, b: Path, directory: Path | None) -> dict:
    """How each cell of run B stands to that of run A, as in comparison.json; with `directory`, also that file and a page there.

    Raises EvalsuiteError for what is no run of this version and for pictures that are missing or damaged."""
    from evalsuite.report import runs as page

    first, second = _run(a), _run(b)
    sides = {side: _facts(path, run.results) for side, path, run in (("a", a, first), ("b", b, second))}
    if directory is not None:
        if (directory / "results.json").exists():
            raise EvalsuiteError(directory, "the folder of a run", "a folder of its own for the comparison", "choose another -o")
        store_results.prepare(directory)
        store_results.no_way_out(directory)
    comparison = {"schema": SCHEMA, "confidence": 0.95, **sides, **compare_runs(first, second)}
    if directory is not None:
        page.write(comparison, first, second, directory)
        write_atomic(directory / "comparison.json", json.dumps(comparison, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    return comparison


def _run(path: Path) -> Run:
    if not path.is_dir() and path.name != "results.json":
        raise EvalsuiteError(path, "no run", "the folder of a run, or its results.json")
    directory = path if path.is_dir() else path.parent
    return Run(directory, store_results.read(directory))


def _facts(path: Path, results: dict) -> dict:
    return {"path": str(path), **{name: results.get(name) for name in ("report", "title", "created")}}
