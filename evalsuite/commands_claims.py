"""`evalsuite claims`, without its printing: the cells of all chosen claims in one run, then each claim measured."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rich.console import Console

from evalsuite import commands_rendered
from evalsuite.pipeline import Settings
from evalsuite.plan import Report
from evalsuite.report import claims as table
from evalsuite.report import claims_page
from evalsuite.report.figures import lock
from evalsuite.store import results as store_results
from evalsuite.store.cache import write_atomic


def check(
    ids: Sequence[str],
    directory: Path,
    maps: Mapping[str, Path],
    settings: Settings,
    step: Callable[[str], None],
    *,
    jobs: int | None,
    read_cache: bool,
    console: Console,
) -> list[dict]:
    """Measure claims, write claims.json and the page claims.html into `directory`, with the run of all their cells in
    `directory`/cells; what claims.json has of each. maps: the papers' own, role → file, as far as given. step: told what is
    measured next. Raises EvalsuiteError."""
    chosen = table.choose(ids)
    store_results.prepare(directory)
    report = Report("claims", "The papers' claims", "The cells behind the claims, each against Mitsuba's truth.", ())
    cells = commands_rendered.render(report, [c.id for c in chosen if c.rendered], directory, maps, settings, jobs=jobs,
                                     read_cache=read_cache, console=console)  # fmt: skip
    found = []
    for claim in chosen:
        step(claim.says)
        own = cells.get(claim.id)
        found.append({**table.check(claim, maps, own), "results": lock.results_of(own.cells, own.directory) if own else {}})
    write_atomic(
        directory / "claims.json",
        json.dumps({"schema": "evalsuite.claims/1", "claims": found}, indent=1, ensure_ascii=False) + "\n",
    )
    claims_page.write(found, directory)
    return found
