"""004 Fig 2: environment maps, the area lights found in them, and the rest, which lights without shadows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from evalsuite.lights.description import described
from evalsuite.report.figures import grids
from evalsuite.report.figures.maps import Map, stand_ins
from evalsuite.report.figures.shadow_rates import PAPER
from evalsuite.report.figures.taken_apart import TakenApart


def data(maps: Sequence[Map]) -> dict[str, Any]:
    apart = {one.role: TakenApart.of(one.radiance()) for one in maps}
    return {
        "maps": maps,
        "apart": apart,
        "measured": {
            "stand_ins": {one.called: one.environment for one in maps if one.stand_in},
            "maps": {
                one.role: {
                    "environment": one.environment,
                    "lights": described(apart[one.role].found),
                    "share": apart[one.role].share,
                    "stated_lights": PAPER[one.role].lights,
                    "white": apart[one.role].white,
                }
                for one in maps
            },
        },
    }


def draw(data: dict[str, Any]) -> grids.Grid:
    top, middle, bottom = [], [], []
    for one in data["maps"]:
        apart = data["apart"][one.role]
        count = len(apart.found.lights)
        top.append(apart.whole(f"white: {apart.white:.3g} W m⁻² sr⁻¹"))
        lights = f"{count} light{'' if count == 1 else 's'}, {100 * apart.share:.3g} % of the energy"
        middle.append(apart.lights(f"{lights} (the paper's: {PAPER[one.role].lights})"))
        bottom.append(apart.rest(f"{100 * (1 - apart.share):.3g} % of the energy"))
    note = (
        "Latitude over longitude; one exposure a column. Flat discs, outlined, with the energy of the texels they stand for; "
        "counts and shares are exact for these maps. " + stand_ins(data["maps"])
    )
    columns = [one.title for one in data["maps"]]
    names = ("the map", "area lights found", "the rest, ambient")
    return grids.Grid([grids.Block([top, middle, bottom], "", columns, names)], note=note.strip(), width=8.0)
