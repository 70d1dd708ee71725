"""What `evalsuite check` and `evalsuite bless` do, without their printing."""

from __future__ import annotations

import datetime
import json
import os
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from evalsuite import plan as planning
from evalsuite.commands import run_report
from evalsuite.compare.run_folder import Run
from evalsuite.errors import EvalsuiteError
from evalsuite.gate import baseline as baselines
from evalsuite.gate import bless as blessing
from evalsuite.gate import history, outlets
from evalsuite.gate import trends as trending
from evalsuite.gate.baseline import Baseline
from evalsuite.gate.verdict import CONFIDENCE, VERDICTS, judge
from evalsuite.pipeline import Settings
from evalsuite.plan import QUALITY, Choice
from evalsuite.store import results as store_results
from evalsuite.store.cache import write_atomic

SCHEMA = "evalsuite.check/1"


@dataclass(frozen=True)
class Asked:
    """What the command line says; None and empty: as the baseline was made. error: (target error, cap)."""

    choice: Choice = field(default_factory=Choice)
    error: tuple[float, int] | None = None
    size: tuple[int, int] | None = None
    seed: int | None = None
    repair_env: bool = False
    no_ledger: bool = False


@dataclass(frozen=True)
class Outlets:
    """Files to write a check to; None: not asked for. history: None is `history.sqlite` in the output folder."""

    junit: Path | None = None
    summary: Path | None = None
    history: Path | None = None


def baseline_path(report: str) -> Path:
    """Beside a report's file; for a report by name `reports/NAME.baseline.json`, where the working folder keeps its reports."""
    path = planning.report_path(report)
    return (path.parent if report.endswith(".toml") else Path("reports")) / f"{path.stem}.baseline.json"


def check(
    report: str,
    baseline: Path,
    asked: Asked,
    directory: Path,
    outlets_: Outlets,
    *,
    strict: bool = False,
    render: bool = True,
    jobs: int | None = None,
    scheduler: str | None = None,
    read_cache: bool = True,
    console: Console,
) -> dict:
    """Render the cells as the baseline's were (with `render`: else the folder's results are judged as they are), hold them
    against it, write check.json and what else is asked for; returns the check. Raises EvalsuiteError for bad input."""
    blessed = baselines.read(baseline)
    for path in filter(None, (outlets_.junit, outlets_.summary)):
        store_results.prepare(path.parent)
    if render:
        how = {"jobs": jobs, "scheduler": scheduler, "read_cache": read_cache, "console": console}
        _run(report, blessed, asked, directory, how)
    store_results.no_way_out(directory)
    run = Run(directory, store_results.read(directory))
    complete = _choice_of(run.results.get("run") or {}) == _choice_of(blessed.run)
    rows = judge(run, blessed, complete)
    facts = {c["id"]: {"wall_s": (c.get("cost") or {}).get("wall_s"), "seed": c.get("seed")} for c in run.results["cells"]}
    counts = {verdict: sum(row["verdict"] == verdict for row in rows) for verdict in VERDICTS}
    passed = all(row["passed"] for row in rows)
    name = planning.report_path(report).stem
    found = {
        "schema": SCHEMA,
        "report": name,
        "baseline": str(baseline),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "host": run.results.get("host") or {},
        "confidence": CONFIDENCE,
        "complete": complete,
        "passed": passed,
        "exit_code": 1 if not passed else 4 if strict and counts["inconclusive"] else 0,
        "bless": _bless_command(report, baseline, directory),
        "counts": counts,
        "cells": [row | facts.get(row["id"], {"wall_s": None, "seed": None}) for row in rows],
    }
    write_atomic(directory / "check.json", json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    try:
        past = outlets_.history or directory / "history.sqlite"
        history.append(past, found, _commit())
        _trends(history.read(past, name, trending.LAST), run.results, directory)
    except EvalsuiteError as error:  # a lost line of a trend is no reason to fail a gate
        console.print(f"warning: {escape(str(error))}", style="yellow", highlight=False, soft_wrap=True)
    if outlets_.junit:
        write_atomic(outlets_.junit, outlets.junit(found))
    if outlets_.summary:
        write_atomic(outlets_.summary, outlets.markdown(found))
    if os.environ.get("GITHUB_STEP_SUMMARY"):
        with open(os.environ["GITHUB_STEP_SUMMARY"], "a", encoding="utf-8") as stream:  # other steps write there too
            stream.write(outlets.markdown(found))
    return found


def _trends(checks: Sequence[history.Check], results: Mapping, directory: Path) -> None:
    """Write trends.json and trends.html, and lead to it from the page of the run."""
    from evalsuite.report import page
    from evalsuite.report import trends as trend_page

    found = trending.trends(results.get("report") or directory.name, checks)
    write_atomic(directory / "trends.json", json.dumps(found, ensure_ascii=False, allow_nan=False) + "\n")
    first = not (directory / "trends.html").exists()
    trend_page.write(found, results, directory)
    if first and (directory / "index.html").exists():  # it was written without the way there
        page.write(results, directory)


def _run(report: str, blessed: Baseline, asked: Asked, directory: Path, how: Mapping) -> None:
    """how: what `run_report` is told that no result depends on."""
    definition = planning.load_report(report)
    made = blessed.run
    choice = asked.choice if asked.choice != Choice() else _choice_of(made)
    error, cap = asked.error or (made.get("target_error"), made.get("cap"))
    if error is None or cap is None:
        error, cap = QUALITY["draft"]
    size = asked.size or (tuple(made["size"]) if made.get("size") else definition.size)
    seed = made.get("seed", 0) if asked.seed is None else asked.seed
    ledger = bool(made.get("ledger")) and not asked.no_ledger
    settings = Settings(
        error,
        cap,
        size,
        seed,
        asked.repair_env or bool(made.get("repair_env")),
        ledger=ledger,
        worst_error=made.get("worst_error"),
    )
    cells = planning.plan(definition, choice)
    run_report(definition, cells, settings, directory, choice=choice, missing_only=False, **how)


def _choice_of(made: Mapping) -> Choice:
    """The choice of cells that a run remembers."""
    return planning.choice_from_json(made.get("choice") or {})


def _bless_command(report: str, baseline: Path, directory: Path) -> str:
    words = ["evalsuite", "bless", report]
    if baseline != baseline_path(report):
        words += ["--baseline", str(baseline)]
    if directory != default_directory(report):
        words += ["--out", str(directory)]
    return shlex.join(words)


def _commit() -> str | None:
    """Commit of the checkout that the user stands in, with `-dirty` for local changes."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10).stdout.strip() or None
    except (OSError, subprocess.TimeoutExpired):
        return None


def default_directory(report: str) -> Path:
    return Path("reports", "build", planning.report_path(report).stem)


def bless(
    baseline: Path, directory: Path, patterns: Sequence[str], *, reason: str | None = None, dry_run: bool = False
) -> list[dict]:
    """Accept the results of a folder; the rows of the check that were. With `dry_run` nothing is written. Raises EvalsuiteError
    for bad input, and where something worse lacks a reason."""
    if baseline.suffix != ".json":
        raise EvalsuiteError(baseline, f"the extension '{baseline.suffix}'", ".json", "its pictures go beside it, in a folder")
    old = baselines.read(baseline) if baseline.exists() else None
    before = old or Baseline(baseline)
    run = Run(directory, store_results.read(directory))
    rows = blessing.choose(judge(run, before), patterns, baseline)
    blessing.require_reason(rows, reason)
    if not dry_run and rows:
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        new, records = blessing.blessed(run, before, rows, reason, now)
        blessing.store(new, records, old)
    return rows


def undo(baseline: Path, *, dry_run: bool = False) -> list[dict]:
    """Bring back the state before the last bless: what each cell becomes."""
    before, now = blessing.undo(baseline, dry_run)
    was = before.cells if before else {}
    changed = [name for name in {**now.cells, **was} if now.cells.get(name) != was.get(name)]
    return [{"id": name, "was": _said(now.cells.get(name)), "is": _said(was.get(name))} for name in changed]


def _said(cell: Mapping | None) -> str:
    return "not blessed" if cell is None else f"blessed {cell.get('blessed')}: {cell.get('reason')}"
