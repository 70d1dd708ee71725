"""Figures of a table of pictures: one property downwards, one to the right, beside the same of Mitsuba and of the error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evalsuite.report.figures import grids
from evalsuite.report.figures.beside import title
from evalsuite.report.figures.rendered import ERROR, Rendered

#: Techniques by what they compute, where the rows are techniques.
FORMULAS = {"fresnel-mirror": "F L_m", "fresnel-add": "F L_m + L_d", "fresnel-blend": "F L_m + (1 − F) L_d"}


def data(cells: Rendered, down: str, right: str) -> dict[str, Any]:
    """The three tables of panels. Where the rows are LOD biases, also the Phong exponent that each stands for."""
    table = [[cells.cell(**{down: a, right: b}) for b in cells.values(right)] for a in cells.values(down)]
    exposure = table[0][-1]["exposure"]
    exponents = {f"{row[0]['parameters']['bias']:g}": row[0]["all_parameters"]["exponent"] for row in table if down == "bias"}
    return {
        "cells": cells,
        "names": [_name(row[0], down) for row in table],
        "columns": [title(cell, (right,)) for cell in table[0]],
        "image": [[cells.picture(c, "image", exposure) for c in row] for row in table],
        "truth": [[cells.picture(c, "reference", exposure) for c in row] for row in table],
        "error": [[cells.error(c) for c in row] for row in table],
        "measured": {"exponent_of_bias": exponents} if exponents else {},
    }


def _name(cell: Mapping, down: str) -> str:
    return FORMULAS.get(cell["technique"], cell["technique"]) if down == "technique" else title(cell, (down,))


def draw(data: dict[str, Any]) -> grids.Grid:
    exponents = data["measured"].get("exponent_of_bias", {})
    note = "b is hardware's LOD bias; N the Phong exponent whose lobe a mean texel of that level has." if exponents else ""
    return grids.Grid(
        [
            grids.Block(data["image"], "Real time", data["columns"], data["names"]),
            grids.Block(data["truth"], "Mitsuba 3", data["columns"], [f"N = {n:.0f}" for n in exponents.values()]),
            grids.Block(data["error"], "Error, relative RMSE", data["columns"]),
        ],
        note=data["cells"].note(note),
        scale=ERROR,
        width=11.0,
    )
