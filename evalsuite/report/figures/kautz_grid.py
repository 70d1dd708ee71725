"""000 Fig 6: f_λ from left to right, LOD bias b downwards, on one object; beside it Mitsuba's pictures and the error."""

from __future__ import annotations

from typing import Any

from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR, Rendered


def data(cells: Rendered) -> dict[str, Any]:
    """The three grids of panels, and the Phong exponent that each bias stands for."""
    normal, biases = cells.values("fresnel_normal"), cells.values("bias")
    table = [[cells.cell(fresnel_normal=f, bias=b) for f in normal] for b in biases]
    exposure = table[0][0]["exposure"]
    exponents = [row[0]["all_parameters"]["exponent"] for row in table]
    return {
        "cells": cells,
        "normal": normal,
        "biases": biases,
        "image": [[cells.picture(c, "image", exposure) for c in row] for row in table],
        "truth": [[cells.picture(c, "reference", exposure) for c in row] for row in table],
        "error": [[cells.error(c) for c in row] for row in table],
        "measured": {"exponent_of_bias": {f"{b:g}": n for b, n in zip(biases, exponents, strict=True)}},
    }


def draw(data: dict[str, Any]) -> grids.Grid:
    columns = [f"f_λ = {f:g}" for f in data["normal"]]
    exponents = data["measured"]["exponent_of_bias"]
    names = [f"b = {b:g}" for b in data["biases"]]
    return grids.Grid(
        [
            grids.Block(data["image"], "Box-filtered MIPs, one pass", columns, names),
            grids.Block(data["truth"], "Mitsuba 3", columns, [f"N = {exponents[f'{b:g}']:.0f}" for b in data["biases"]]),
            grids.Block(data["error"], "Error, relative RMSE", columns),
        ],
        note=data["cells"].note("b is hardware's LOD bias; N the Phong exponent whose lobe a mean texel of that level has."),
        scale=ERROR,
        width=11.0,
    )
