"""The cells behind figures and claims: all that a command needs in one run, then to each figure or claim its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console

from evalsuite.commands import run_report
from evalsuite.pipeline import Settings
from evalsuite.plan import Report
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
) -> dict[str, Rendered]:
    """Make the cells of reports/<report.name>/<id>.toml, of all ids in one run into `directory`/cells; id → what became of its own.
    report: what that run is called. maps: the papers' own, role → file, as far as given. Raises EvalsuiteError."""
    definitions = builtin.reports_directory() / report.name
    planned = {name: cells_of(definitions / f"{name}.toml", maps) for name in ids}
    cells = {cell.id: cell for made, _ in planned.values() for cell in made}
    if not cells:
        return {}
    results = run_report(report, list(cells.values()), settings, directory / "cells", jobs=jobs, read_cache=read_cache,
                         missing_only=False, console=console)  # fmt: skip
    run = {cell["id"]: cell for cell in results["cells"]}
    files = {cell.environment: cell.environment_path for cell in cells.values() if cell.environment}
    return {
        name: Rendered(directory / "cells", [run[cell.id] for cell in mine], stand_ins, files)
        for name, (mine, stand_ins) in planned.items()
    }
