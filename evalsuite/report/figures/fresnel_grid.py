"""001 Fig 8: rows are the Fresnel-weighted mirror, the same plus diffuse, and the blend; columns are refractive indices."""

from __future__ import annotations

from typing import Any

from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR, Rendered

ROWS = {"fresnel-mirror": "F L_m", "fresnel-add": "F L_m + L_d", "fresnel-blend": "F L_m + (1 − F) L_d"}


def data(cells: Rendered) -> dict[str, Any]:
    """The three grids of panels."""
    indices = cells.values("eta")
    table = [[cells.cell(technique=t, eta=n) for n in indices] for t in ROWS]
    exposure = table[0][-1]["exposure"]
    made = {name: [[cells.picture(c, name, exposure) for c in row] for row in table] for name in ("image", "reference")}
    return {"cells": cells, "indices": indices, **made, "error": [[cells.error(c) for c in row] for row in table], "measured": {}}


def draw(data: dict[str, Any]) -> grids.Grid:
    columns = [f"n = {n:g}" for n in data["indices"]]
    return grids.Grid(
        [
            grids.Block(data["image"], "Real time", columns, tuple(ROWS.values())),
            grids.Block(data["reference"], "Mitsuba 3", columns),
            grids.Block(data["error"], "Error, relative RMSE", columns),
        ],
        note=data["cells"].note(),
        scale=ERROR,
        width=10.0,
    )
