"""The cells behind figures and claims: all that a command needs in one run, then to each figure or claim its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from evalsuite.commands import run_report
from evalsuite.pipeline import Settings
from evalsuite.plan import Cell, Report
from evalsuite.report.figures.rendered import Rendered
from evalsuite.scene import builtin
from evalsuite.stand_ins import cells_of


def render(
    report: Report,
    ids: Sequence[str],
    directory: Path,
    maps: Mapping[str, Path],
    settings: Settings,
    *,
    jobs: int | None,
    read_cache: bool,
    console: Console,
    scenes: Mapping[str, Path] | None = None,
) -> dict[str, Rendered]:
    """Make the cells of reports/<report.name>/<id>.toml, of all ids in one run into `directory`/cells; id → what became of its
    own, with one more cell, at the best value found, for each whose headroom is searched. report: what that run is called. maps:
    the papers' own, role → file, as far as given; scenes: the same with their meshes. Raises EvalsuiteError."""
    definitions = builtin.reports_directory() / report.name
    planned = {name: cells_of(definitions / f"{name}.toml", maps, scenes) for name in ids}
    cells = {cell.id: cell for made, _ in planned.values() for cell in made}
    if not cells:
        return {}

    def run(wanted: Iterable[Cell]) -> dict[str, Mapping]:
        made = run_report(report, list(wanted), settings, directory / "cells", jobs=jobs, read_cache=read_cache,
                          missing_only=False, console=console)  # fmt: skip
        return {cell["id"]: cell for cell in made["cells"]}

    searched = {name: cell for name, cell in cells.items() if cell.headroom}
    best = {name: _best(searched[name], made) for name, made in run(searched.values()).items()} if searched else {}
    cells |= {cell.id: cell for cell in best.values() if cell}
    made = run(cells.values())
    files = {cell.environment: cell.environment_path for cell in cells.values() if cell.environment}

    def own(mine: Sequence[Cell]) -> list[Mapping]:
        return [made[cell.id] for one in mine for cell in (one, best.get(one.id)) if cell]

    ids_of_best = frozenset(cell.id for cell in best.values() if cell)
    return {
        name: Rendered(directory / "cells", own(mine), stand_ins, files, ids_of_best)
        for name, (mine, stand_ins) in planned.items()
    }


def _best(cell: Cell, made: Mapping) -> Cell | None:
    """The cell with the first of its free parameters at its best, as the search found it."""
    if not made["headroom"]:
        return None
    found = made["headroom"][0]
    return replace(cell, parameters={**cell.parameters, found["parameter"]: found["best"]}, headroom=False)
