"""Figures of one row of pictures: each above Mitsuba's and the error; and figures of several such rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR, Rendered

#: How a property is called above a column.
WORDS = {"fresnel_normal": "f_λ", "bias": "b", "exponent": "N", "eta": "n", "azimuth": "seen from", "technique": "", "scene": "",
         "environment": ""}  # fmt: skip
UNITS = {"azimuth": "°"}
#: Techniques in a word, where their ids are too long to stand above a picture.
TECHNIQUES = {
    "mirror-paraboloid": "dual paraboloid map", "mirror-paraboloid-2pass": "dual paraboloid map", "diffuse-map": "diffuse map",
    "glossy-phong-map": "Phong map", "glossy-boxmip": "box MIPs", "glossy-boxmip-seamless": "MIPs across faces",
    "fresnel-mirror": "F × mirror", "fresnel-add": "F × mirror + diffuse", "fresnel-blend": "blended", "npr-sketch": "sketch",
    "npr-cool-warm": "cool and warm", "npr-silhouette": "silhouette", "npr-hatching": "hatching",
}  # fmt: skip
#: More columns than this make another row of three.
ACROSS = 6


def data(cells: Rendered, *properties: str) -> dict[str, Any]:
    """properties: that tell the columns apart, as `exponent`, or `exponent=s` where the paper calls it s."""
    return {
        "cells": cells,
        "titles": [title(c, properties) + (", best" if c["id"] in cells.best else "") for c in cells.cells],
        "image": [cells.picture(cells.cell(id=c["id"])) for c in cells.cells],
        "truth": [cells.picture(c, "reference") for c in cells.cells],
        "error": [cells.error(c) for c in cells.cells],
        "measured": {},
    }


def title(cell: Mapping, properties: tuple[str, ...]) -> str:
    """What tells a cell apart, in words: "N = 50, b = 2.25"."""
    own = {name: cell[name] for name in ("scene", "environment")}
    own["technique"] = TECHNIQUES.get(cell["technique"], cell["technique"])
    values = {**(cell["all_parameters"] or {}), **(cell["parameters"] or {}), **own}
    parts = []
    for stated in properties:
        name, _, word = stated.partition("=")
        value, word = values.get(name), word or WORDS.get(name, name)
        if value is not None:
            text = (f"{value:.3g}".replace("-", "−") if isinstance(value, float) else str(value)) + UNITS.get(name, "")
            parts.append(text if not word else f"{word} {text}" if name in UNITS else f"{word} = {text}")
    return ", ".join(parts)


def draw(data: dict[str, Any]) -> grids.Grid:
    count = len(data["titles"])
    blocks = []
    for first in range(0, count, ACROSS):
        part = slice(first, first + ACROSS)
        rows = [data[name][part] for name in ("image", "truth", "error")]
        blocks.append(
            grids.Block(rows, "", data["titles"][part], ("real time", data.get("truths", "Mitsuba 3"), "relative RMSE"))
        )
    return grids.Grid(
        blocks,
        stacked=True,
        scale=ERROR,
        note=data["cells"].note(data.get("note", "")),
        width=max(1.75, 3.0 - 0.4 * min(count, ACROSS)) * min(count, ACROSS),
    )
