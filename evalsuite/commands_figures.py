"""`evalsuite figures`, without its printing: the cells of all chosen figures in one run, then each figure from its own."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from evalsuite.commands import run_report
from evalsuite.errors import EvalsuiteError
from evalsuite.pipeline import Settings
from evalsuite.plan import Cell, Report, load_report, plan
from evalsuite.report import figures
from evalsuite.report.figures.rendered import Rendered
from evalsuite.scene import builtin
from evalsuite.store import results as store_results
from evalsuite.store.cache import write_atomic


@dataclass(frozen=True)
class Role:
    """What a paper has and we cannot ship: what it is called, and the built-in of the same kind that stands in for it."""

    called: str
    stand_in: str


#: Maps that the papers use, by the name that `--env NAME=FILE` takes.
MAPS: Mapping[str, Role] = {
    "uffizi": Role("the Uffizi gallery", "office"),
    "grace": Role("Grace Cathedral", "cathedral"),
    "galileo": Role("Galileo's tomb", "cathedral"),
    "kitchen": Role("the kitchen", "office"),
    "st-peters": Role("St Peter's", "cathedral"),
}
#: Objects; stand-ins are scenes.
MESHES: Mapping[str, Role] = {
    "bunny": Role("the bunny", "organic"),
    "bust": Role("the bust", "teapot"),
    "car": Role("the car", "torus"),
}


def given(option: str, texts: Sequence[str], roles: Mapping[str, Role]) -> dict[str, Path]:
    """["uffizi=FILE"] → {"uffizi": FILE}. Raises EvalsuiteError for an unknown role or a missing file."""
    found = {}
    for text in texts:
        name, equals, path = text.partition("=")
        if not equals or name not in roles:
            raise EvalsuiteError(
                f"{option} {text}", "no such role" if equals else "no NAME=FILE", f"NAME=FILE with NAME one of {', '.join(roles)}"
            )
        if not Path(path).is_file():
            raise EvalsuiteError(f"{option} {text}", "no such file", "a file that can be read", "check the path")
        found[name] = Path(path)
    return found


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
    planned = {figure.id: _plan(figure, maps) for figure in chosen if figure.rendered}
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
        made.append(figures.make(figure, directory, own))
    return made


def _plan(figure: figures.Figure, maps: Mapping[str, Path]) -> tuple[list[Cell], dict[str, str]]:
    """The cells of a figure, and what stands in for what in them."""
    report = load_report(str(builtin.reports_directory() / "figures" / f"{figure.id}.toml"))
    stand_ins: dict[str, str] = {}

    def put(name: str | None, roles: Mapping[str, Role], own: Mapping[str, Path]) -> str | None:
        if name not in roles:
            return name
        if name in own:
            return str(own[name])
        stand_ins[roles[name].called] = roles[name].stand_in
        return roles[name].stand_in

    groups = tuple(
        replace(
            group,
            scenes=tuple(put(name, MESHES, {}) for name in group.scenes),
            environments=tuple(put(name, MAPS, maps) for name in group.environments),
        )
        for group in report.groups
    )
    return plan(replace(report, groups=groups)), stand_ins


def claims(ids: Sequence[str], directory: Path, maps: Mapping[str, Path], step: Callable[[str], None]) -> list[dict]:
    """Measure claims, write claims.json and the page claims.html into `directory`; what claims.json has of each. step: told what
    is measured next. Raises EvalsuiteError."""
    from evalsuite.report import claims as table
    from evalsuite.report import claims_page

    chosen = table.choose(ids)
    store_results.prepare(directory)
    found = []
    for claim in chosen:
        step(claim.says)
        found.append(table.check(claim, maps))
    write_atomic(
        directory / "claims.json",
        json.dumps({"schema": "evalsuite.claims/1", "claims": found}, indent=1, ensure_ascii=False) + "\n",
    )
    claims_page.write(found, directory)
    return found
