"""The papers' statements that can be checked: one visible table. What measures them is imported when it does."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from evalsuite.errors import EvalsuiteError, unknown
from evalsuite.report.claims.verdict import UNTESTED, Finding
from evalsuite.report.figures.rendered import Rendered


@dataclass(frozen=True)
class Claim:
    """id: <paper>-<what>. where: in the paper. says: in our words. measure: module:function here, which returns a
    `verdict.Finding`. figure: id of the figure that shows it. maps: whether it takes the papers' own maps, as far as given.
    rendered: whether it takes cells, those of reports/claims/<id>.toml (`rendered.Rendered`)."""

    id: str
    where: str
    says: str
    measure: str
    figure: str | None = None
    maps: bool = False
    rendered: bool = False


_KAUTZ = "Kautz, Daubert, Seidel 2004, "
_NOTES = "Heidrich, course notes, "
_HS98 = "Heidrich and Seidel 1998, "
_MCGUIRE = "McGuire et al. 2013, "
_LIGHTS = "Environment maps as area lights, "

CLAIMS: Mapping[str, Claim] = {
    claim.id: claim
    for claim in (
        Claim(
            "000-sh-texels",
            _KAUTZ + "§5.1.1",
            "8 × 8 texels a face are enough for nine SH coefficients.",
            "harmonics:eight_texels",
        ),
        Claim("000-sh-time", _KAUTZ + "§5.1.1", "The projection onto SH takes about 2 ms.", "harmonics:projection_time"),
        Claim(
            "000-bias-225",
            _KAUTZ + "Fig 5",
            "Box-filtered MIPs at b = 2.25 look like the Phong map with N = 225.",
            "levels:bias_for_phong",
            "000-fig5",
        ),
        Claim(
            "000-faces",
            _KAUTZ + "Fig 4",
            "At b = 9.4 six faces show in six colours; filtered across the faces they vanish.",
            "faces:show",
            "000-fig4",
            rendered=True,
        ),
        Claim(
            "000-speed",
            _KAUTZ + "Fig 5",
            "A single pass over box-filtered MIPs is faster than the parabolic prefilter: 500 against 25 Hz.",
            "speed:single_pass",
            "000-fig5",
            rendered=True,
        ),
        Claim("001-cube-ratio", _NOTES + "§2.2", "A cube map's sampling rate varies by 3√3.", "maps:cube", "001-fig4"),
        Claim(
            "001-paraboloid-ratio",
            _NOTES + "§2.3",
            "A paraboloid map's sampling rate varies by 4.",
            "maps:paraboloid_map",
            "002-fig3",
        ),
        Claim(
            "001-circle",
            _NOTES + "Fig 12",
            "The distortion of a filter's circle goes up to 25 % for large radii.",
            "maps:circle",
            "001-fig12",
        ),
        Claim("001-radii", _NOTES + "§3.2.5", "The smallest filter radius is half the largest.", "maps:radii"),
        Claim("001-filter-sizes", _NOTES + "§3.2.5, table", "Filter sizes for N = 10 … 500.", "maps:filter_sizes"),
        Claim("001-shrink-factors", _NOTES + "§3.2.5, table", "Shrink factors for N = 10 … 500.", "maps:shrink_factors"),
        Claim(
            "001-frame-rates",
            _NOTES + "§3.2.5, table",
            "Filtered anew in every frame, narrower lobes cost more: from 25 Hz for N = 10 to 9 Hz for N = 500.",
            "speed:frame_rates",
            "001-fig14",
            rendered=True,
        ),
        Claim(
            "002-all-views",
            _HS98 + "§1 and §4",
            "One dual paraboloid map serves all views; a sphere map the one it was made for.",
            "views:one_map",
            "002-fig6",
            rendered=True,
        ),
        Claim(
            "003-highlights",
            _MCGUIRE + "§5 and Fig 1",
            "At level m(s), lights in the map have highlights like those of direct lights.",
            "highlights:similar",
            "003-fig1",
        ),
        Claim(
            "003-constant",
            _MCGUIRE + "§5",
            "A constant environment comes out exact, with k_L and k_G as they are.",
            "constant:exact",
            rendered=True,
        ),
        Claim(
            "003-centres-corners",
            _MCGUIRE + "§4",
            "The error is least at the faces' centres and high exponents, worst at corners and low exponents.",
            "mcguire_maps:centres_corners",
            "003-fig2",
        ),
        Claim(
            "003-flat-boxy",
            _MCGUIRE + "§4",
            "Maps that are flat at low frequencies come out well, those like a Cornell box slightly too shiny.",
            "mcguire_maps:flat_boxy",
            "headroom-mcguire",
        ),
        Claim(
            "004-counts",
            _LIGHTS + "Table 1",
            "Galileo has 8 lights, Grace 10, the kitchen 4, St Peter's 17.",
            "area_lights:counts",
            maps=True,
        ),
        Claim("004-time", _LIGHTS + "§4", "Decomposing a map takes 0.5 to 1.5 hours.", "area_lights:seconds"),
        Claim(
            "004-larger",
            _LIGHTS + "§5",
            "The lights are slightly larger than the regions they stand for.",
            "area_lights:larger",
        ),
        Claim(
            "004-softer",
            _LIGHTS + "§5",
            "Shadows are slightly softer than the reference's.",
            "softness:softer",
            "004-fig3",
            rendered=True,
        ),
    )
}


def choose(ids: Sequence[str]) -> list[Claim]:
    """The named claims, all where none is named. Raises EvalsuiteError for an unknown id."""
    for name in ids:
        if name not in CLAIMS:
            raise unknown("claim", name, CLAIMS, "`evalsuite list claims`")
    return [CLAIMS[name] for name in ids] or list(CLAIMS.values())


def check(claim: Claim, maps: Mapping[str, Path], cells: Rendered | None = None) -> dict:
    """Measure a claim; what claims.json has of it. cells: its own, where it is rendered."""
    module, function = claim.measure.split(":")
    measure = getattr(importlib.import_module(f"{__name__}.{module}"), function)
    try:
        finding = measure(cells) if claim.rendered else measure(maps) if claim.maps else measure()
    except EvalsuiteError as error:  # a cell without a score is this claim's trouble alone
        if not claim.rendered:
            raise
        finding = Finding(UNTESTED, "", str(error))
    method = " ".join((measure.__doc__ or "").split())
    return {
        "id": claim.id,
        "where": claim.where,
        "says": claim.says,
        "figure": claim.figure,
        "method": method,
        "command": f"evalsuite claims {claim.id}",
        "cells": [cell["id"] for cell in cells.cells] if cells else [],
        "stand_ins": dict(cells.stand_ins) if cells else {},
        **asdict(finding),
    }
