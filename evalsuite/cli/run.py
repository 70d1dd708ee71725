"""Reports: run, check, bless."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from evalsuite.cli.app import (
    LARGEST_SEED,
    Env,
    Jobs,
    Json,
    NoCache,
    Param,
    Quality,
    RepairEnv,
    Scheduler,
    Seed,
    Size,
    TargetError,
    WorstError,
    app,
    err,
    error_of,
    out,
    print_json,
    print_table,
    size_of,
    worst_error_of,
)
from evalsuite.errors import EvalsuiteError


@app.command()
def run(
    report: Annotated[str, typer.Argument(help="Report name or .toml file.")] = "accuracy",
    scene: Annotated[
        list[str] | None, typer.Option(help="Scene name or Mitsuba XML file, instead of the report's. Repeatable.")
    ] = None,
    technique: Annotated[
        list[str] | None, typer.Option("--technique", "-t", help="Technique id or glob, or your own .glsl file. Repeatable.")
    ] = None,
    param: Param = None,
    env: Env = None,
    target: Annotated[list[str] | None, typer.Option(help="A name from `evalsuite list targets`. Repeatable.")] = None,
    quality: Quality = None,
    target_error: TargetError = None,
    worst_error: WorstError = None,
    size: Size = None,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Output folder; default reports/build/REPORT.")] = None,
    seed: Seed = 0,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    no_cache: NoCache = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list the cells, and say what they will take.")] = False,
    missing_only: Annotated[
        bool, typer.Option("--missing-only", help="Keep the cells that the output folder has scored.")
    ] = False,
    repair_env: RepairEnv = False,
    until_decided: Annotated[
        bool, typer.Option("--until-decided", help="Sample on where noise could change the order of techniques, up to the cap.")
    ] = False,
    budget: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="About how long to take, as 90s, 10m, 1h30m: samples go where they decide most."),
    ] = None,
    cap: Annotated[
        int | None,
        typer.Option(metavar="SPP", max=1 << 31, help="Samples per pixel at which a reference stops; default: the quality's."),
    ] = None,
    no_ledger: Annotated[bool, typer.Option("--no-ledger", help="Do not split errors by cause: quicker.")] = False,
    headroom: Annotated[bool, typer.Option("--headroom", help="Also search the best value of each free parameter.")] = False,
    as_json: Json = False,
) -> None:
    """Render and compare all cells of a report; write results.json, pictures and the page."""
    from evalsuite import plan as planning
    from evalsuite.budget import FINEST, seconds_of
    from evalsuite.commands import run_report

    definition = planning.load_report(report)
    choice = planning.Choice(scene or (), technique or (), env, target or (), planning.parse_parameters(param or []), headroom)
    cells = planning.plan(definition, choice)
    for option, given in (("--until-decided", until_decided), ("--worst-error", worst_error is not None)):
        if budget is not None and given:
            raise EvalsuiteError("--budget", f"{option} beside it", "one of the two")
    budget_s = None if budget is None else seconds_of(budget)
    # What is asked for beside a budget is the finest to go to.
    error, usual = error_of(quality or (FINEST if budget_s and target_error is None else None), target_error)
    if cap is not None and cap < 32:
        raise EvalsuiteError(f"--cap {cap}", "too few", "32 samples per pixel or more: the fewest that know their own scatter")
    directory = out_dir or Path("reports", "build", definition.name)
    from evalsuite.pipeline import Settings

    settings = Settings(error, cap or usual, size_of(size) or definition.size, seed, repair_env, ledger=not no_ledger)
    settings = replace(settings, worst_error=worst_error_of(worst_error))
    if dry_run:
        _foretell(cells, settings, {"jobs": jobs, "scheduler": scheduler, "read_cache": not no_cache}, as_json)
        return
    results = run_report(
        definition,
        cells,
        settings,
        directory,
        jobs=jobs,
        scheduler=scheduler,
        read_cache=not no_cache,
        missing_only=missing_only,
        until_decided=until_decided,
        budget_s=budget_s,
        choice=choice,
        console=err,
    )
    if as_json:
        print_json(results)
    else:
        from evalsuite.report.table import results_table

        out.print(results_table(results))
        print((directory / "index.html").resolve())
    if results["cells"] and not any(cell["status"] == "scored" for cell in results["cells"]):
        worst = next((c for c in results["cells"] if c["status"] != "skipped"), results["cells"][0])
        raise EvalsuiteError(
            worst["id"], worst["message"], "at least one cell that can be scored", "see the page for each cell's reason"
        )


def _foretell(cells: Sequence, settings: object, how: dict, as_json: bool) -> None:
    """Print the cells, and what making them will take as far as earlier runs tell."""
    from evalsuite.commands import predict
    from evalsuite.forecast import in_words

    found = predict(cells, settings, console=err, **how)
    if as_json:
        print_json({"cells": [cell.id for cell in cells], "forecast": found})
        return
    print_table([{"cell": cell.id} for cell in cells], ["cell"], f"{len(cells)} cells")
    print(in_words(found) if found else "no earlier run in the store to go by: what these take is not foretold")


@app.command()
def check(
    report: Annotated[str, typer.Argument(help="Report name or .toml file.")] = "accuracy",
    baseline: Annotated[Path | None, typer.Option(help="Default: reports/REPORT.baseline.json, or beside the .toml.")] = None,
    junit: Annotated[Path | None, typer.Option(metavar="FILE.xml", help="Also write JUnit XML, a test case a cell.")] = None,
    summary: Annotated[Path | None, typer.Option(metavar="FILE.md", help="Also write the ten worst as Markdown.")] = None,
    history: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Past checks, for trends; default history.sqlite in the output folder.")
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 4 where noise leaves a cell open.")] = False,
    no_run: Annotated[bool, typer.Option("--no-run", help="Judge the results that the output folder has.")] = False,
    scene: Annotated[list[str] | None, typer.Option(help="As for `run`; default: as blessed. Repeatable.")] = None,
    technique: Annotated[
        list[str] | None, typer.Option("--technique", "-t", help="As for `run`; default: as blessed. Repeatable.")
    ] = None,
    param: Param = None,
    env: Env = None,
    target: Annotated[list[str] | None, typer.Option(help="As for `run`; default: as blessed. Repeatable.")] = None,
    quality: Quality = None,
    target_error: TargetError = None,
    size: Size = None,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Output folder; default reports/build/REPORT.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, max=LARGEST_SEED, help="Another seed than the baseline's.")] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    no_cache: NoCache = False,
    repair_env: RepairEnv = False,
    no_ledger: Annotated[bool, typer.Option("--no-ledger", help="Do not split errors by cause: quicker.")] = False,
    as_json: Json = False,
) -> None:
    """Hold a report against its blessed baseline; exit code 1 where a cell is further from the truth, missing or failed."""
    from evalsuite import commands_gate as gate
    from evalsuite import plan as planning
    from evalsuite.gate import outlets

    error = error_of(quality, target_error) if quality or target_error is not None else None
    choice = planning.Choice(scene or (), technique or (), env, target or (), planning.parse_parameters(param or []))
    found = gate.check(
        report,
        baseline or gate.baseline_path(report),
        gate.Asked(choice, error, size_of(size), seed, repair_env, no_ledger),
        out_dir or gate.default_directory(report),
        gate.Outlets(junit, summary, history),
        strict=strict,
        render=not no_run,
        jobs=jobs,
        scheduler=scheduler,
        read_cache=not no_cache,
        console=err,
    )
    if os.environ.get("GITHUB_ACTIONS") == "true":
        for line in outlets.annotations(found):
            print(line, file=sys.stderr)  # the runner reads both streams
    if as_json:
        print_json(found)
    else:
        rows = [{"verdict": r["verdict"], "cell": r["id"], "why": r["reason"]} for r in outlets.worst(found)]
        if rows:
            print_table(rows, ["verdict", "cell", "why"])
        print(outlets.headline(found))
        if any(r["verdict"] == "closer" or not r["passed"] for r in found["cells"]):
            print(f"to accept: {found['bless']} CELL … [--reason TEXT]")
    raise typer.Exit(found["exit_code"])


@app.command()
def bless(
    report: Annotated[str, typer.Argument(help="Report name or .toml file.")] = "accuracy",
    cells: Annotated[list[str] | None, typer.Argument(metavar="[CELL]…", help="Ids or globs; default: all scored.")] = None,
    baseline: Annotated[Path | None, typer.Option(help="Default: reports/REPORT.baseline.json, or beside the .toml.")] = None,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Folder of the results; default reports/build/REPORT.")] = None,
    reason: Annotated[str | None, typer.Option(help="Why; needed for what is further from the truth.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would change.")] = False,
    undo: Annotated[bool, typer.Option("--undo", help="Bring back the baseline before the last bless.")] = False,
    as_json: Json = False,
) -> None:
    """Accept the last run's results as the baseline, cell by cell."""
    from evalsuite import commands_gate as gate

    file = baseline or gate.baseline_path(report)
    if undo and cells:
        raise EvalsuiteError("--undo", f"the cell '{cells[0]}'", "no cells: the whole last bless is undone")
    if undo:
        rows = gate.undo(file, dry_run=dry_run)
        print_json(rows) if as_json else print_table(rows, ["id", "was", "is"])
    else:
        rows = gate.bless(file, out_dir or gate.default_directory(report), cells or [], reason=reason, dry_run=dry_run)
        shown = [{"was": row["verdict"], "cell": row["id"], "why": row["reason"]} for row in rows]
        print_json(rows) if as_json else print_table(shown, ["was", "cell", "why"])
    if not as_json:
        done = "would be changed" if dry_run else "changed"
        print(f"{len(rows)} {'cell' if len(rows) == 1 else 'cells'} {done}\n{file}")
