"""004 Table 1: lights and frame rates of both scenes under each map, beside what the paper states of its maps."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from evalsuite.report.figures import tabular
from evalsuite.report.figures.maps import Map
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.numbers import measured


class Stated(NamedTuple):
    """Lights, and frames a second of `three-boxes` and `column` at 512 × 512 pixels."""

    lights: int
    boxes: float
    column: float


PAPER: Mapping[str, Stated] = {
    "galileo": Stated(8, 12.8, 7.5),
    "grace": Stated(10, 6.7, 4.2),
    "kitchen": Stated(4, 21.2, 5.6),
    "st-peters": Stated(17, 5.1, 4.1),
}
SCENES = ("three-boxes", "column")


def data(cells: Rendered, maps: Sequence[Map]) -> dict[str, Any]:
    rows = {}
    for one in maps:
        own = [cells.cell(scene=scene, environment=one.label) for scene in SCENES]
        rows[one.role] = {
            "environment": one.environment,
            "lights": len(own[0]["lights"]),
            "fps": {cell["scene"]: rate(cell["cost"]) for cell in own},
            "stated": PAPER[one.role]._asdict(),
        }
    sizes = {tuple(cells.read(cell, "image").shape[1::-1]) for cell in cells.cells}
    host = json.loads((cells.directory / "results.json").read_text(encoding="utf-8"))["host"]
    return {
        "cells": cells,
        "maps": maps,
        "measured": {"rows": rows, "sizes": sorted(sizes), "renderer": host["gl_renderer"], "cpu": host.get("cpu")},
    }


def rate(cost: Mapping[str, Any]) -> dict[str, Any]:
    """Frames a second of a cell's cost, with their 95 % interval; open above where the time's reaches 0. A time, which the lock
    leaves out."""
    low, high = cost.get("gpu_ms_ci95") or (None, None)
    ends = [1e3 / high if high else None, 1e3 / low if low and low > 0 else None]
    return {"value": 1e3 / cost["gpu_ms"], "ci95": ends, "timing": True}


def draw(data: dict[str, Any]) -> tabular.Table:
    found = data["measured"]
    rows = []
    for one in data["maps"]:
        row = found["rows"][one.role]
        stated = PAPER[one.role]
        rates = [measured(row["fps"][scene]) for scene in SCENES]
        rows.append([one.title, str(row["lights"]), *rates, str(stated.lights), f"{stated.boxes}", f"{stated.column}"])
    size = " and ".join(f"{w} × {h}" for w, h in found["sizes"])
    note = (
        f"shadow-wedges; one frame of {size} pixels, a sample each, on {found['renderer']}. Brackets: 95 % over the passes "
        "drawn, as quick as this machine was while references were being made. The paper: its own maps, GeForce 6800. Counts are "
        "exact."
    )
    return tabular.Table(
        [("", 1), (f"here, {size}", 3), ("the paper, 512 × 512", 3)],
        ["map", "lights", "3 boxes [frames/s]", "column [frames/s]", "lights", "3 boxes", "column"],
        rows,
        data["cells"].note(note).replace(" Brackets: 95 %.", ""),
    )
