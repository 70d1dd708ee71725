"""003 Fig 1: highlights of lamps in the environment map beside those of the same lamps as direct lights.

The map's lamps, found as in 004, are taken out and shaded from their centres by Mitsuba (target `discs-centre`, which also
counts what hides them), the remainder about them by its integral. Beside it McGuire's look-ups in the whole map, and Mitsuba's
integral over the whole map (`unoccluded`). All three have the BRDF of Eq 13.
"""

from __future__ import annotations

from typing import Any

from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR, Rendered

DIRECT, WHOLE = "discs-centre", "unoccluded"


def data(cells: Rendered) -> dict[str, Any]:
    """A row an exponent: picture, both truths, and the errors against them."""
    rows, exponents = [], cells.values("exponent")
    for exponent in exponents:
        direct, whole = (cells.cell(exponent=exponent, target=target) for target in (DIRECT, WHOLE))
        exposure = whole["exposure"]
        rows.append([
            cells.picture(whole, "image", exposure), cells.picture(direct, "reference", exposure),
            cells.picture(whole, "reference", exposure), cells.error(direct), cells.error(whole),
        ])  # fmt: skip
    return {"cells": cells, "rows": rows, "names": [f"s = {e:g}" for e in exponents], "measured": {}}


def draw(data: dict[str, Any]) -> grids.Grid:
    columns = ("map, real time", "direct lights, Mitsuba", "map, Mitsuba", "off direct lights", "off the map's integral")
    note = data["cells"].note("Beneath errors: relative RMSE.")
    return grids.Grid([grids.Block(data["rows"], "", columns, data["names"])], scale=ERROR, width=8.5, note=note)
