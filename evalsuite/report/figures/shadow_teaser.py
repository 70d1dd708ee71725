"""004's teaser: an environment map and the area lights that stand for its bright regions, the picture that they give in real
time, Mitsuba's and the error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from evalsuite.report.figures import grids
from evalsuite.report.figures.maps import Map
from evalsuite.report.figures.rendered import ERROR, Rendered
from evalsuite.report.figures.shadow_scenes import both
from evalsuite.report.figures.taken_apart import TakenApart

NOTE = (
    "Upper left the map, lower left what stands for it in real time: flat discs, outlined, which cast shadows, and the rest, "
    "which casts none."
)


def data(cells: Rendered, maps: Sequence[Map]) -> dict[str, Any]:
    """Of the one cell and the one map."""
    (one,) = maps
    apart = TakenApart.of(one.radiance())
    cell = cells.cell(environment=one.label)
    return {
        "cells": cells,
        "map": one,
        "apart": apart,
        "pictures": [*both(cells, cell), cells.error(cell)],
        "measured": {"lights": len(apart.found.lights), "share": apart.share, "white": apart.white},
    }


def draw(data: dict[str, Any]) -> grids.Grid:
    apart = data["apart"]
    count = len(apart.found.lights)
    words = f"{count} area lights with {100 * apart.share:.3g} % of the energy, and the rest"
    maps = [[apart.whole(f"{data['map'].title}; white: {apart.white:.3g} W m⁻² sr⁻¹")], [apart.lights(words, rest=True)]]
    titles = ("real time", "Mitsuba 3", "error, relative RMSE")
    return grids.Grid(
        [grids.Block(maps, columns=("map, and area lights",)), grids.Block([data["pictures"]], columns=titles)],
        scale=ERROR,
        note=data["cells"].note(NOTE),
        width=8.0,
    )
