"""`evalsuite figures`, without its printing: the cells of all chosen figures in one run, then each figure from its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console

from evalsuite.commands import run_report
from evalsuite.pipeline import Settings
from evalsuite.plan import Report
from evalsuite.report import figures
from evalsuite.report.figures.rendered import Rendered
from evalsuite.scene import builtin
from evalsuite.stand_ins import cells_of, named
from evalsuite.store import results as store_results


def make(
    ids: Sequence[str],
    directory: Path,
    maps: Mapping[str, Path],
    settings: Settings,
    *,
    jobs: int | None,
    read_cache: bool,
    console: Console,
) -> list[tuple[list[Path], dict]]:
    """Draw figures into `directory`, with the run of all their cells in `directory`/cells; paths and measured numbers of each.
    maps: the papers' own, role → file, as far as given. Raises EvalsuiteError."""
    chosen = figures.choose(ids)
    store_results.prepare(directory)
    definitions = builtin.reports_directory() / "figures"
    planned = {f.id: cells_of(definitions / f"{f.id}.toml", maps) for f in chosen if f.rendered}
    cells = {cell.id: cell for made, _ in planned.values() for cell in made}
    run: dict[str, Mapping] = {}
    if cells:
        report = Report("figures", "The papers' figures", "The cells behind the figures, each against Mitsuba's truth.", ())
        results = run_report(report, list(cells.values()), settings, directory / "cells", jobs=jobs, read_cache=read_cache,
                             missing_only=False, console=console)  # fmt: skip
        run = {cell["id"]: cell for cell in results["cells"]}
    made = []
    for figure in chosen:
        own = None
        if figure.rendered:
            mine, stand_ins = planned[figure.id]
            own = Rendered(directory / "cells", [run[cell.id] for cell in mine], stand_ins)
        made.append(figures.make(figure, directory, own, named(figure.maps, maps)))
    return made
