"""Figures of one row of pictures: each above Mitsuba's and the error; and figures of several such rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evalsuite.plan import format_value
from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR, Rendered

#: How a property is called above a column.
WORDS = {"fresnel_normal": "f_λ", "bias": "b", "exponent": "N", "eta": "n", "technique": "", "scene": "", "environment": ""}
#: More columns than this make another row of three.
ACROSS = 6


def data(cells: Rendered, *properties: str) -> dict[str, Any]:
    """properties: that tell the columns apart; an `=` before one names it as the papers of other exponents do (s)."""
    return {
        "cells": cells,
        "titles": [_title(cells.cell(id=c["id"]), properties) for c in cells.cells],
        "image": [cells.picture(cells.cell(id=c["id"])) for c in cells.cells],
        "truth": [cells.picture(c, "reference") for c in cells.cells],
        "error": [cells.error(c) for c in cells.cells],
        "measured": {},
    }


def _title(cell: Mapping, properties: tuple[str, ...]) -> str:
    values = {
        **(cell["all_parameters"] or {}),
        **(cell["parameters"] or {}),
        **{k: cell[k] for k in ("technique", "scene", "environment")},
    }
    parts = []
    for name in properties:
        value, word = values.get(name), WORDS.get(name, name)
        if value is not None:
            text = format_value(value)
            parts.append(f"{word} = {text}" if word else text)
    return ", ".join(parts)


def draw(data: dict[str, Any]) -> grids.Grid:
    count = len(data["titles"])
    blocks = []
    for first in range(0, count, ACROSS):
        part = slice(first, first + ACROSS)
        rows = [data[name][part] for name in ("image", "truth", "error")]
        blocks.append(grids.Block(rows, "", data["titles"][part], ("real time", "Mitsuba 3", "relative RMSE")))
    return grids.Grid(blocks, stacked=True, scale=ERROR, note=data["cells"].note(), width=max(3.4, 1.75 * min(count, ACROSS)))
