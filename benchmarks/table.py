"""The figures as a table for the terminal."""

from __future__ import annotations

from collections.abc import Mapping

from rich.markup import escape
from rich.table import Table

STYLE = {"kept": "green", "missed": "red"}


def table(made: Mapping[str, Mapping]) -> Table:
    """name → record (`record.measured`); a row a figure."""
    rows = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("benchmark", "figure", "value [95 %]", "limit", "", "beside"):
        rows.add_column(column, overflow="fold")
    for name, record in made.items():
        if record["not_measured"]:
            rows.add_row(name, escape(record["title"]), "not measured", "", "", escape(record["not_measured"]))
        for figure in record["figures"]:
            verdict = figure["verdict"]
            shown = f"[{STYLE[verdict.split()[-1]]}]{verdict}[/]" if verdict else ""
            rows.add_row(name, escape(figure["what"]), escape(value(figure)), limit(figure), shown, escape(figure["beside"]))
    return rows


def value(figure: Mapping) -> str:
    """`1.12 [1.08, 1.15] s`."""
    number, ends = (f"{figure['value']:.3g}", ", ".join(f"{end:.3g}" for end in figure["ci95"]))
    return f"{number} [{ends}] {figure['unit']}".rstrip()


def limit(figure: Mapping) -> str:
    """`≤ 1.15`, `≥ 500`, or nothing."""
    asked = figure["limit"]
    return f"{'≥' if asked['least'] else '≤'} {asked['value']:g} {figure['unit']}".rstrip() if asked else ""
