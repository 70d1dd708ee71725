"""A native abort costs the cells that caused it and is reported; the others are scored; nothing half-written stays."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_scene import scene_xml

from evalsuite.execute.local import Lane, Workers
from evalsuite.pipeline import Run, Settings, run_cells
from evalsuite.plan import Cell
from evalsuite.store.cache import Store


class _Abort(Lane):
    """A reference lane that really aborts (SIGABRT in the worker) when it is to sample the target `path`."""

    def submit(self, function, *arguments):
        if function.endswith(":passes") and arguments[1] == "path":
            function, arguments = "os:abort", ()
        return super().submit(function, *arguments)


@pytest.fixture
def cells(tmp_path) -> list[Cell]:
    path = tmp_path / "s.xml"
    path.write_text(scene_xml())
    return [Cell("s", path, None, None, "diffuse-sh9", target=target) for target in ("path", "unoccluded", "direct")]


def test_abort_costs_one_cell_then_the_next_run_completes(cells, tmp_path):
    store = Store(tmp_path / "cache")
    with Workers(1) as workers:
        workers.reference.close()
        workers.reference = workers.passes = _Abort("reference")
        results = {cell["target"]: cell for cell, _ in run_cells(Run(store, workers, Settings()), cells)}
    assert {t: c["status"] for t, c in results.items()} == {"path": "failed", "unoccluded": "scored", "direct": "scored"}
    assert "SIGABRT" in results["path"]["message"]
    assert not [p for p in Path(tmp_path / "cache").rglob(".new-*")]

    with Workers(1) as workers:
        results = {cell["target"]: cell for cell, _ in run_cells(Run(store, workers, Settings()), cells)}
    assert {c["status"] for c in results.values()} == {"scored"}
    assert results["direct"]["cost"]["cached"] and not results["path"]["cost"]["cached"]
