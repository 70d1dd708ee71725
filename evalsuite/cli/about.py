"""What there is and whether it works: list …, doctor."""

from __future__ import annotations

from pathlib import Path

import typer
from rich.markup import escape

from evalsuite.cli.app import (
    Json,
    app,
    out,
    print_json,
    print_table,
)

list_app = typer.Typer(no_args_is_help=True, help="What there is: scenes, techniques, targets, reports, figures, claims.")
app.add_typer(list_app, name="list")


@list_app.command("scenes")
def list_scenes(as_json: Json = False) -> None:
    """Built-in scenes, with the parameters that -p sets."""
    from evalsuite.scene import builtin
    from evalsuite.scene.dependencies import parameters

    rows = [{k: str(v) for k, v in row.items()} for row in builtin.list_scenes()]
    for row in rows:
        row["parameters"] = ", ".join(f"{name}={value}" for name, value in parameters(Path(row["path"])).items())
    print_json(rows) if as_json else print_table(rows, ["name", "description", "parameters"])


@list_app.command("techniques")
def list_techniques(as_json: Json = False) -> None:
    """Every technique with its paper, equation, parameters, assumptions and target."""
    from evalsuite.gpu import registry

    rows = [registry.find(name).to_json() for name in registry.names()]
    if as_json:
        print_json(rows)
        return
    for row in rows:
        out.print(f"[bold]{row['id']}[/bold]  {escape(row['title'])}", highlight=False)
        facts = {
            "paper": row["paper"],
            "equations": row["equations"],
            "target": row["target"],
            "stands for": ", ".join(row["stands_for"]),
            "parameters": "; ".join(f"{p['name']} = {p['default']} ({p['meaning']})" for p in row["parameters"]),
            "assumes": " · ".join(row["assumptions"]),
        }
        for name, text in facts.items():
            out.print(f"  {name + ':':<12}{escape(str(text))}", highlight=False, soft_wrap=True)


@list_app.command("targets")
def list_targets(as_json: Json = False) -> None:
    """What Mitsuba renders as truth, in order."""
    from evalsuite.plan import TARGETS

    rows = [{"name": name, "description": text} for name, text in TARGETS.items()]
    print_json(rows) if as_json else print_table(rows, ["name", "description"])


@list_app.command("figures")
def list_figures(as_json: Json = False) -> None:
    """The papers' figures that `evalsuite figures` draws."""
    from evalsuite.report.figures import FIGURES

    rows = [{"id": f.id, "paper": f.paper, "title": f.title} for f in FIGURES.values()]
    print_json(rows) if as_json else print_table(rows, ["id", "title", "paper"])


@list_app.command("claims")
def list_claims(as_json: Json = False) -> None:
    """The papers' statements that `evalsuite claims` checks."""
    from evalsuite.report.claims import CLAIMS

    rows = [{"id": c.id, "says": c.says, "where": c.where} for c in CLAIMS.values()]
    print_json(rows) if as_json else print_table(rows, ["id", "says", "where"])


@list_app.command("reports")
def list_reports(as_json: Json = False) -> None:
    """Report definitions."""
    from evalsuite import plan
    from evalsuite.scene import builtin

    definitions = [plan.load_report(str(path)) for path in sorted(builtin.reports_directory().glob("*.toml"))]
    rows = [{"name": d.name, "title": d.title, "cells": len(plan.plan(d))} for d in definitions]
    print_json(rows) if as_json else print_table(rows, ["name", "title", "cells"])


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what this machine has (OpenGL, Mitsuba, LLVM), what it lacks and how to get it; exit code 3 when it lacks something."""
    from evalsuite.commands import examine

    result = examine()
    if as_json:
        print_json(result)
    else:
        for line in result["checks"]:
            mark = "[green]ok[/green]     " if line["ok"] else "[red]missing[/red]"
            out.print(f"{mark} {escape(line['name'])}: {escape(line['text'])}", highlight=False, soft_wrap=True)
            if not line["ok"] and line["fix"]:
                out.print(f"        {escape(line['fix'])}", highlight=False, soft_wrap=True)
    if not all(line["ok"] for line in result["checks"]):
        raise typer.Exit(3)
