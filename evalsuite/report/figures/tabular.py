"""Figures that are tables: described once, drawn by matplotlib (PNG, PDF) and written as LaTeX (booktabs) and HTML."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evalsuite.report.figures import style
from evalsuite.report.figures.grids import wrapped
from evalsuite.report.latex import escape

LOOK = """
table { border-collapse: collapse; border-top: 2px solid; border-bottom: 2px solid; font: 10pt sans-serif }
td, th { padding: 2px 10px; text-align: right; white-space: nowrap }
tr > :first-child { text-align: left }
th[colspan] { text-align: center }
thead tr:last-child { border-bottom: 1px solid }
tbody th { font-weight: normal }
p { font: 9pt sans-serif; max-width: 60em }
"""


@dataclass(frozen=True)
class Table:
    """groups: of columns, (heading, how many), from left to right. columns: their headings. rows: of words; first column to the
    left, the others to the right. note: beneath."""

    groups: Sequence[tuple[str, int]]
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


def draw(table: Table) -> Any:
    """A matplotlib Figure."""
    size, line = 9.0, 0.24
    wide = [max(len(row[k]) for row in (table.columns, *table.rows)) + 3 for k in range(len(table.columns))]
    width = 0.075 * sum(wide)
    note = wrapped(table.note, int(17 * width)) if table.note else ""
    height = line * (len(table.rows) + 3) + 0.13 * (len(note.splitlines()) + 1)
    figure = style.figure(width, height)
    figure.set_layout_engine("none")
    ends = [sum(wide[: k + 1]) / sum(wide) for k in range(len(wide))]
    starts = [0.0, *ends[:-1]]

    def put(k: int, y: float, text: str, **how: Any) -> None:
        x, side = (starts[0] + 0.01, "left") if k == 0 else (ends[k] - 0.01, "right")
        figure.text(x, 1 - y / height, text.replace("$", r"\$"), fontsize=size, ha=side, va="center", **how)

    def rule(first: int, last: int, y: float, weight: float) -> None:
        x = (starts[first] + (0.01 if first else 0.005), ends[last] - 0.005)
        figure.add_artist(_line(x, 1 - y / height, weight))

    at, last = 0, len(wide) - 1
    rule(0, last, 0.3 * line, 1.2)
    for title, count in table.groups:
        if title:
            middle = 0.5 * (starts[at] + ends[at + count - 1])
            figure.text(middle, 1 - 0.9 * line / height, title, fontsize=size, ha="center", va="center")
            rule(at, at + count - 1, 1.4 * line, 0.5)
        at += count
    for k, title in enumerate(table.columns):
        put(k, 1.95 * line, title, fontweight="bold")
    rule(0, last, 2.45 * line, 0.8)
    for number, row in enumerate(table.rows):
        for k, text in enumerate(row):
            put(k, (3.0 + number) * line, text)
    rule(0, last, (2.6 + len(table.rows)) * line, 1.2)
    figure.text(0.01, 1 - (2.85 + len(table.rows)) * line / height, note, fontsize=6.5, va="top", color="0.25")
    return figure


def _line(x: tuple[float, float], y: float, weight: float) -> Any:
    from matplotlib.lines import Line2D

    return Line2D(x, (y, y), color="black", linewidth=weight)


def words_of(table: Table) -> str:
    """What stands beneath."""
    return table.note


def write(table: Table, place: Path) -> None:
    """LaTeX (needs booktabs) or HTML (one file), by the suffix. Raises OSError."""
    place.write_text(_as_latex(table) if place.suffix == ".tex" else _as_html(table), encoding="utf-8")


def _as_latex(table: Table) -> str:
    def line(cells: Sequence[str]) -> str:
        return " & ".join(cells) + r" \\"

    at, groups, rules = 1, [], []
    for title, count in table.groups:
        groups.append(rf"\multicolumn{{{count}}}{{c}}{{{escape(title)}}}")
        rules += [rf"\cmidrule(lr){{{at}-{at + count - 1}}}"] if title else []
        at += count
    lines = [
        *(f"% {part}" for part in wrapped(table.note, 100).splitlines()),
        rf"\begin{{tabular}}{{l{'r' * (len(table.columns) - 1)}}}",
        r"\toprule",
        line(groups),
        "".join(rules),
        line([escape(text) for text in table.columns]),
        r"\midrule",
        *(line([escape(text) for text in row]) for row in table.rows),
        r"\bottomrule",
        r"\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _as_html(table: Table) -> str:
    groups = "".join(f'<th colspan="{count}">{html.escape(title)}</th>' for title, count in table.groups)
    columns = "".join(f'<th scope="col">{html.escape(text)}</th>' for text in table.columns)
    rows = "".join(
        f'<tr><th scope="row">{html.escape(row[0])}</th>{"".join(f"<td>{html.escape(text)}</td>" for text in row[1:])}</tr>\n'
        for row in table.rows
    )
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><style>{LOOK}</style></head>\n<body><table>\n'
        f"<thead><tr>{groups}</tr>\n<tr>{columns}</tr></thead>\n<tbody>\n{rows}</tbody></table>\n"
        f"<p>{html.escape(table.note)}</p>\n</body></html>\n"
    )
