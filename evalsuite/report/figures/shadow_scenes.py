"""004 Fig 3: both scenes under each map: real time, the paper's own reference method, Mitsuba, and the errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evalsuite.report.figures import grids
from evalsuite.report.figures.grids import Panel
from evalsuite.report.figures.maps import Map
from evalsuite.report.figures.rendered import ERROR, Rendered, said
from evalsuite.report.figures.shadow_rates import SCENES, rate

TITLES = {"three-boxes": "3 boxes, 38 triangles", "column": "Column, 440 triangles"}
OURS, SAMPLED = "shadow-wedges", "shadow-sampled"


def data(cells: Rendered, maps: Sequence[Map]) -> dict[str, Any]:
    scenes, rates = {}, {}
    for scene in SCENES:
        ours = [cells.cell(scene=scene, environment=one.label, technique=OURS) for one in maps]
        pairs = [both(cells, c) for c in ours]
        theirs = [cells.cell(scene=scene, environment=one.label, technique=SAMPLED) for one in maps]
        scenes[scene] = {
            "real time": [ours for ours, _ in pairs],
            "1024 shadow maps": [both(cells, c, said(c))[0] for c in theirs],
            "Mitsuba 3": [truth for _, truth in pairs],
            "error of real time": [cells.error(c) for c in ours],
        }
        rates[scene] = {one.role: rate(c["cost"]) for one, c in zip(maps, theirs, strict=True)}
    return {"cells": cells, "maps": maps, "scenes": scenes, "measured": {"sampled_fps": rates, "stated_sampled_fps": 0.1}}


def both(cells: Rendered, cell: Mapping, caption: str = "") -> tuple[Panel, Panel]:
    """A cell's image and reference at one exposure, at which 98 of 100 of the reference's pixels on the object stay below white:
    a shadow does not show in what is clamped. caption: of the image."""
    reference, mask = cells.read(cell, "reference"), cells.read(cell, "mask").mean(-1) > 0.5
    brightest = float(np.quantile(reference[mask].max(-1), 0.98)) if mask.any() else 0.0
    exposure = 0.9 / brightest if brightest > 0 else None
    white = f"white: {1 / (exposure or cell['exposure']):.3g} W m⁻² sr⁻¹"
    return cells.picture(cell, "image", exposure, caption), cells.picture(cell, "reference", exposure, white)


def draw(data: dict[str, Any]) -> grids.Grid:
    columns = [one.title for one in data["maps"]]
    blocks = [_block(TITLES[scene], rows, columns) for scene, rows in data["scenes"].items()]
    note = (
        "Real time: shadow-wedges. 1024 shadow maps: of structured importance samples of the whole map, the paper's reference "
        "method; beneath, its relative RMSE. Beneath the error maps, that of real time. One exposure a column."
    )
    return grids.Grid(blocks, scale=ERROR, note=data["cells"].note(note), width=13.0)


def _block(title: str, rows: Mapping[str, list], columns: Sequence[str]) -> grids.Block:
    return grids.Block(list(rows.values()), title, columns, list(rows))
