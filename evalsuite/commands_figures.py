"""`evalsuite figures`, without its printing: the cells of all chosen figures in one run, then each figure from its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console

from evalsuite import commands_rendered
from evalsuite.pipeline import Settings
from evalsuite.plan import Report
from evalsuite.report import figures
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
    report = Report("figures", "The papers' figures", "The cells behind the figures, each against Mitsuba's truth.", ())
    cells = commands_rendered.render(report, [f.id for f in chosen if f.rendered], directory, maps, settings, jobs=jobs,
                                     read_cache=read_cache, console=console)  # fmt: skip
    return [figures.make(figure, directory, cells.get(figure.id)) for figure in chosen]
