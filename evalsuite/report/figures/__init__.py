"""The papers' figures: one visible table. matplotlib is imported when a figure is drawn, not before."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from evalsuite.errors import unknown
from evalsuite.image.files import replacing
from evalsuite.report import latex
from evalsuite.report.figures import grids, tabular
from evalsuite.report.figures.maps import Map
from evalsuite.report.figures.rendered import Rendered


@dataclass(frozen=True)
class Figure:
    """A figure of a paper, or one that holds a paper's choice against ours. id: <paper>-fig<number>, or what it is about. title:
    what it shows. module: in this folder, with arguments after colons; `data()` computes what is shown (arrays and plain values,
    with `measured` for the JSON file), `draw(data)` returns a matplotlib Figure, a `grids.Grid` or a `tabular.Table`. rendered:
    whether it is made of cells, those of reports/figures/<id>.toml, which then are `data`'s first argument (`rendered.Rendered`).
    maps: roles of the maps it is about, which then are the next one (a list of `maps.Map`)."""

    id: str
    paper: str
    title: str
    module: str
    rendered: bool = False
    maps: tuple[str, ...] = ()


_NOTES = "Heidrich: Environment Maps and Their Applications (course notes), Fig {}"
_MCGUIRE = "McGuire, Evangelakos, Wilcox, Donow, Mara: Plausible Blinn-Phong Reflection of Standard Cube MIP-Maps, 2013, Eq 12"
_MCGUIRE_FIG = (
    "McGuire, Evangelakos, Wilcox, Donow, Mara: Plausible Blinn-Phong Reflection of Standard Cube MIP-Maps, 2013, Fig {}"
)
_KAUTZ = "Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, Fig {}"
_HS98 = "Heidrich and Seidel: View-Independent Environment Maps, 1998, Fig {}"
_LIGHTS = "Environment maps as area lights (dynamic shadows by penumbra wedges), {}"
_PROBES = ("galileo", "grace", "kitchen", "st-peters")

_FIGURES = (
    Figure("001-fig1", _NOTES.format(1), "Sphere map from the centre of a coloured cube", "map_pictures:sphere:coloured-cube"),
    Figure(
        "001-fig4",
        _NOTES.format(4),
        "Sampling rates of sphere, cube and dual paraboloid maps over direction",
        "sampling_rates",
    ),
    Figure(
        "001-fig5",
        _NOTES.format(5),
        "Dual paraboloid map from the centre of a coloured cube",
        "map_pictures:paraboloid:coloured-cube",
    ),
    Figure("001-fig6", _NOTES.format(6), "Dual paraboloid map of an office", "map_pictures:paraboloid:office"),
    Figure(
        "001-fig12",
        _NOTES.format(12),
        "A circle in a paraboloid map is not quite a circle on the sphere",
        "circle_distortion",
    ),
    Figure("002-fig1", _HS98.format(1), "Sphere map from the centre of a coloured cube", "map_pictures:sphere:coloured-cube"),
    Figure(
        "002-fig4",
        _HS98.format(4),
        "Dual paraboloid map from the centre of a coloured cube",
        "map_pictures:paraboloid:coloured-cube",
    ),
    Figure("002-fig5", _HS98.format(5), "Dual paraboloid map of an office", "map_pictures:paraboloid:office"),
    Figure(
        "002-fig3",
        _HS98.format(3),
        "Solid angle of a paraboloid map's texel over the angle from the viewing direction",
        "paraboloid",
    ),
    Figure("headroom-mcguire", _MCGUIRE, "Best constant in McGuire's level over maps, exponents and lobes", "headroom_mcguire"),
    Figure(
        "headroom-boxmip",
        _KAUTZ.format(5),
        "LOD bias of box-filtered MIPs and the Phong exponent it stands for",
        "headroom_boxmip",
    ),
    Figure("000-fig3", _KAUTZ.format(3), "Fresnel and LOD bias on three objects", "beside:scene:fresnel_normal:bias", True),
    Figure("000-fig4", _KAUTZ.format(4), "Cube faces show at a high LOD bias", "beside:technique:bias", True),
    Figure("000-fig5", _KAUTZ.format(5), "Phong map and box-filtered MIPs", "beside:technique:exponent:bias", True),
    Figure("001-fig8", _NOTES.format(8), "Fresnel: weighted mirror, plus diffuse, blended", "table:technique:eta", True),
    Figure("001-fig14", _NOTES.format(14), "Phong filtering in every frame", "beside:environment:exponent", True),
    Figure("001-fig15", _NOTES.format(15), "Non-photorealistic maps", "beside:technique", True),
    Figure("003-fig2", _MCGUIRE_FIG.format(2), "McGuire's level over the exponent", "beside:exponent=s", True),
    Figure("001-fig7", _NOTES.format(7), "Mirrors seen from two sides", "beside:scene:azimuth", True),
    Figure("001-fig9", _NOTES.format(9), "Diffusely prefiltered map", "prefiltered:1:technique", True),
    Figure("001-fig10", _NOTES.format(10), "Map prefiltered for N = 100", "prefiltered:100:scene:exponent", True),
    Figure("001-fig11", _NOTES.format(11), "Sphere maps of three views warped to another", "warping"),
    Figure("001-fig13", _NOTES.format(13), "Filtering methods, N = 100", "filtering_methods"),
    Figure("002-fig6", _HS98.format(6), "One map, a sphere from two sides", "beside:azimuth", True),
    Figure("002-fig7", _HS98.format(7), "The seam between the two maps", "seam", True),
    Figure("002-fig8", _HS98.format(8), "A torus with a dual paraboloid map", "beside:technique", True),
    Figure("003-fig1", _MCGUIRE_FIG.format(1), "Highlights from the map and from direct lights", "highlights", True),
    Figure("003-fig3", _MCGUIRE_FIG.format(3), "A bump-mapped crate", "beside:exponent=s", True),
    Figure("000-fig6", _KAUTZ.format(6), "Fresnel term and LOD bias, a grid of both", "table:bias:fresnel_normal", True),
    Figure("004-fig1", _LIGHTS.format("Fig 1"), "The filter that finds lights, and which size a disc gets", "light_filter"),
    Figure("004-fig2", _LIGHTS.format("Fig 2"), "Maps and the area lights found in them", "lights_found", maps=_PROBES),
    Figure("004-teaser", _LIGHTS.format("teaser"), "Map, area lights, real time, truth", "shadow_teaser", True, ("grace",)),
    Figure("004-fig3", _LIGHTS.format("Fig 3"), "Two scenes under four maps", "shadow_scenes", True, _PROBES),
    Figure("004-table1", _LIGHTS.format("Table 1"), "Lights and frame rates", "shadow_rates", True, _PROBES),
)


def _place(figure: Figure) -> tuple:
    """By paper, then by number; a table after its paper's figures, what is no paper's figure last."""
    paper, _, name = figure.id.partition("-")
    return not paper.isdigit(), paper, name.startswith("table"), int("0" + re.sub(r"\D", "", name))


FIGURES: Mapping[str, Figure] = {figure.id: figure for figure in sorted(_FIGURES, key=_place)}


def choose(ids: Sequence[str]) -> list[Figure]:
    """The named figures, all where none is named. Raises EvalsuiteError for an unknown id."""
    for name in ids:
        if name not in FIGURES:
            raise unknown("figure", name, FIGURES, "`evalsuite list figures`")
    return [FIGURES[name] for name in ids] or list(FIGURES.values())


def make(figure: Figure, directory: Path, cells: Rendered | None = None, maps: Sequence[Map] = ()) -> tuple[list[Path], dict]:
    """Compute and draw a figure into `directory` (made where it is not there): <id>.png, <id>.pdf and <id>.json, the measured
    numbers; of a grid of pictures and of a table also <id>.html and latex/<id>/<id>.tex, with a standalone.tex that shows it.
    Returns the paths and the numbers. Raises EvalsuiteError for a folder that cannot be written."""
    name, *arguments = figure.module.split(":")
    module = importlib.import_module(f"{__name__}.{name}")
    own = [*([cells] if figure.rendered else []), *([maps] if figure.maps else [])]
    data = module.data(*own, *arguments)
    numbers = {"id": figure.id, "paper": figure.paper, "title": figure.title, **data["measured"]}
    if cells:
        numbers |= {"stand_ins": dict(cells.stand_ins), "cells": {c["id"]: _cell(c) for c in cells.cells}}
    described = module.draw(data)
    kind = {grids.Grid: grids, tabular.Table: tabular}.get(type(described))
    drawing = kind.draw(described) if kind else described
    paths = [directory / f"{figure.id}.{suffix}" for suffix in ("png", "pdf", "json")]
    for path in paths[:2]:
        # Without dates a figure drawn again is the same file.
        metadata = {"Title": figure.title} | ({"CreationDate": None} if path.suffix == ".pdf" else {"Software": None})
        with replacing(path) as place:
            drawing.savefig(place, format=path.suffix[1:], dpi=300 if kind else 200, metadata=metadata)
    if kind:
        folder = directory / "latex" / figure.id
        folder.mkdir(parents=True, exist_ok=True)
        for path in (directory / f"{figure.id}.html", folder / f"{figure.id}.tex"):
            with replacing(path) as place:
                kind.write(described, place)
            paths.append(path)
        with replacing(folder / "standalone.tex") as place:
            place.write_text(
                latex.standalone(figure.id, kind.words_of(described), getattr(described, "width", 6.5)), encoding="utf-8"
            )
    with replacing(paths[2]) as place:
        place.write_text(json.dumps(numbers, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return paths, numbers


def _cell(cell: Mapping) -> dict:
    """What of a cell a figure's numbers rest on."""
    names = ("rel_rmse", "rel_bias", "flip")
    metrics = {
        name: {k: cell["metrics"][name][k] for k in ("value", "ci95")} for name in names if name in (cell["metrics"] or {})
    }
    return {"status": cell["status"], "reference": cell.get("reference_id"), "reproduce": cell.get("reproduce"), **metrics}
