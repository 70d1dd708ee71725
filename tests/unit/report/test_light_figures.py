"""The figures of area lights out of environment maps: closed forms, and numbers that are those of the cells given."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evalsuite.image import exr
from evalsuite.image.color import tone_map
from evalsuite.lights.decompose import LUMINANCE, PAPER, decompose, radii
from evalsuite.math.sphere import latlong_directions
from evalsuite.report import figures
from evalsuite.report.figures import light_filter, lights_found, shadow_rates, shadow_scenes, shadow_teaser, tabular
from evalsuite.report.figures.maps import Map, stand_ins
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.figures.taken_apart import YELLOW, TakenApart
from evalsuite.report.latex import escape
from evalsuite.scene.builtin import reports_directory
from evalsuite.stand_ins import cells_of, named

ROLES = ("galileo", "grace", "kitchen", "st-peters")


def test_the_filter_integrates_as_stated():
    """∫ weight 2π sin θ dθ by the trapezoid rule is the closed form at every θ; the whole is 11 − 10 Ω(r_o)/Ω(r_i)."""
    for inner in radii(PAPER)[[0, 10, 19]]:
        theta = np.linspace(0.0, 2.0 * inner, 200_001)
        ring = light_filter.weights(theta, inner) * 2.0 * np.pi * np.sin(theta)
        summed = np.concatenate([[0.0], np.cumsum(0.5 * (ring[1:] + ring[:-1]) * np.diff(theta))])
        centre = 2.0 * np.pi * (1.0 - np.cos(inner))
        np.testing.assert_allclose(light_filter.cumulative(theta, inner), summed / centre, atol=1e-3)
        whole = 11.0 - 10.0 * (1.0 - np.cos(inner / 0.75)) / (1.0 - np.cos(inner))
        assert light_filter.cumulative(theta[-1:], inner)[0] == pytest.approx(whole, rel=1e-9)
        # A positive response needs a centre brighter than its surround by 10 (Ω(r_o) − Ω(r_i))/Ω(r_i), 7.8 for small filters.
        assert np.sign(light_filter.response(inner, inner, 1.0 / (1.01 - whole))) == 1
        assert np.sign(light_filter.response(inner, inner, 1.0 / (0.99 - whole))) == -1


def test_a_disc_s_own_radius_responds_most():
    inner = np.radians(np.linspace(1.0, 17.0, 1601))
    for degrees in (2.0, 5.0, 12.0):
        values = light_filter.response(inner, np.radians(degrees), 0.001)
        assert np.degrees(inner[np.argmax(values)]) == pytest.approx(degrees, abs=0.011)


def test_what_is_measured_on_a_map_is_the_closed_form(monkeypatch):
    monkeypatch.setattr(light_filter, "DISCS", 4)
    data = light_filter.data()
    sizes, disc = data["sizes"], np.radians(light_filter.DISC_DEG)
    clear = np.abs(np.log(sizes / disc)) > 0.1  # off the disc's own edge, which crosses texels
    clear &= np.abs(np.log(sizes / PAPER.inner / disc)) > 0.1
    top = light_filter.response(disc, disc, 0.0)
    for ground, values in data["responses"].items():
        np.testing.assert_allclose(values[clear], light_filter.response(sizes, disc, ground)[clear], atol=0.01 * top)
    low, high = data["measured"]["light_over_disc"]["ci95"]
    assert low < data["measured"]["light_over_disc"]["value"] < high < data["measured"]["step"] * 1.1
    assert 1.0 <= data["measured"]["picked_deg"]["0"] / light_filter.DISC_DEG < data["measured"]["step"]


def lamps(*centres: tuple[float, float, float]) -> np.ndarray:
    """(64, 128, 3) lamps of 8 degrees in the dark."""
    directions = latlong_directions(64, 128)
    lit = np.zeros((64, 128), bool)
    for centre in centres:
        lit |= directions @ (np.asarray(centre) / np.linalg.norm(centre)) > np.cos(np.radians(8.0))
    return np.where(lit[..., None], (9.0, 6.0, 3.0), 0.01).astype(np.float32)


def test_lights_are_drawn_where_they_are():
    apart = TakenApart.of(lamps((1, 0.4, 0), (0, 0.2, -1)))
    lit = 2 * 2 * np.pi * (1 - np.cos(np.radians(8.0))) * (np.array([9.0, 6.0, 3.0]) @ LUMINANCE)
    assert len(apart.found.lights) == 2 and apart.share == pytest.approx(lit / (lit + 0.01 * 4 * np.pi), rel=0.02)
    pixels = apart.lights().pixels
    directions = latlong_directions(*pixels.shape[:2])
    ring = (pixels == YELLOW).all(-1)
    discs = [(np.asarray(light.direction), np.degrees(light.angular_radius)) for light in apart.found.lights]
    off = np.min([np.degrees(np.arccos(np.clip(directions @ centre, -1, 1))) - radius for centre, radius in discs], axis=0)
    assert ring.sum() > 30 and np.abs(off[ring]).max() < 99 / 64
    assert pixels[off > 4].max() == 0 and pixels[off < -4].max() > 200, "flat discs before black"
    assert apart.lights(rest=True).pixels[off > 4].min() > 0
    inside = (directions @ np.asarray(apart.found.lights[0].direction)) > np.cos(np.radians(5.0))
    assert apart.rest().pixels[inside].max() == 0 and apart.whole().pixels[inside].min() > 0


@pytest.fixture
def cells(tmp_path):
    """Eight cells: scene by scene, brighter from map to map, with errors and times of their own; and the maps' files."""
    made, maps = [], []
    for k, role in enumerate(ROLES):
        file = tmp_path / f"{role}.exr"
        exr.write(file, lamps(*[(np.cos(2 * i), 0.5, np.sin(2 * i)) for i in range(k)]))
        maps.append(Map(role, role.title(), str(file), k == 0))
    for s, scene in enumerate(shadow_rates.SCENES):
        for k, one in enumerate(maps):
            folder = tmp_path / f"{scene}-{one.role}"
            folder.mkdir()
            for name, value in (("image", 0.1 + 0.2 * k), ("reference", 0.2 + 0.2 * k), ("mask", 1.0)):
                exr.write(folder / f"{name}.exr", np.full((16, 16, 3), value, np.float32))
            error = 0.01 * (1 + k + 4 * s)
            made.append({
                "id": f"{scene}/{one.role}", "scene": scene, "environment": one.label, "technique": "shadow-wedges",
                "target": "direct", "parameters": {}, "status": "scored", "exposure": 1.0, "message": None,
                "lights": [{}] * (3 + k), "images": {n: f"{folder.name}/{n}.exr" for n in ("image", "reference", "mask")},
                "cost": {"gpu_ms": 100.0 * (1 + k + 4 * s), "gpu_ms_ci95": [90.0 * (1 + k + 4 * s), 110.0 * (1 + k + 4 * s)]},
                "metrics": {"rel_rmse": {"value": error, "ci95": [0.9 * error, 1.1 * error]}},
            })  # fmt: skip
    (tmp_path / "results.json").write_text(json.dumps({"host": {"gl_renderer": "llvmpipe X", "cpu": "a CPU"}, "cells": made}))
    sampled = [
        c
        | {
            "id": f"{c['id']}/sampled",
            "technique": "shadow-sampled",
            "metrics": {"rel_rmse": {"value": 0.001, "ci95": [0, 0.002]}},
        }
        for c in made
    ]
    return Rendered(tmp_path, made, {"Galileo": "galileo"}), maps, sampled


def test_the_table_has_the_cells_numbers(cells, tmp_path):
    data = shadow_rates.data(*cells[:2])
    found = data["measured"]["rows"]
    assert [found[role]["lights"] for role in ROLES] == [3, 4, 5, 6]
    rate = {"value": 5.0, "ci95": [pytest.approx(1e3 / 220), pytest.approx(1e3 / 180)], "timing": True}
    assert found["grace"]["fps"]["three-boxes"] == rate
    assert found["grace"]["fps"]["column"]["value"] == pytest.approx(1e3 / 600)
    assert [found[role]["stated"]["lights"] for role in ROLES] == [8, 10, 4, 17]
    table = shadow_rates.draw(data)
    grace = table.rows[1]
    assert grace[0] == "Grace" and grace[1] == "4" and grace[2].startswith("5.00") and grace[4:] == ["10", "6.7", "4.2"]
    assert "llvmpipe X" in table.note and "16 × 16" in table.note and "galileo for Galileo" in table.note
    assert shadow_rates.rate({"gpu_ms": 10.0, "gpu_ms_ci95": [-1.0, 21.0]})["ci95"] == [pytest.approx(1e3 / 21), None]


def test_a_table_is_the_same_as_latex_html_and_picture(cells, tmp_path):
    figure = figures.FIGURES["004-table1"]
    paths, _ = figures.make(figure, tmp_path / "out", *cells[:2])
    names = {path.name for path in paths}
    assert names == {f"004-table1.{kind}" for kind in ("png", "pdf", "json", "html", "tex")} and all(p.is_file() for p in paths)
    page, latex = (
        (tmp_path / "out" / name).read_text("utf-8") for name in ("004-table1.html", "latex/004-table1/004-table1.tex")
    )
    assert page.count("<tr>") == 6 and "<td>21.2</td>" in page and 'colspan="3"' in page
    assert latex.count(r"\\") == 6 and r"\begin{tabular}{lrrrrrr}" in latex and "21.2" in latex and r"\cmidrule(lr){5-7}" in latex


def test_a_table_s_words_are_escaped(tmp_path):
    table = tabular.Table([("a & b", 2)], ["x_1", "<y>"], [["50 %", "<£>"]], "n")
    tabular.write(table, tmp_path / "t.tex")
    tabular.write(table, tmp_path / "t.html")
    assert escape("white: 1 W m⁻² sr⁻¹, 5 × 5 …").isascii()
    latex, page = ((tmp_path / f"t.{kind}").read_text("utf-8") for kind in ("tex", "html"))
    assert r"a \& b" in latex and r"x\_1 & \textless{}y\textgreater{} \\" in latex and r"50 \%" in latex
    assert "a &amp; b" in page and "&lt;y&gt;" in page and "&lt;£&gt;" in page
    words = {text.get_text() for text in tabular.draw(table).texts}
    assert {"a & b", "x_1", "<y>", "50 %", "<£>", "n"} == words


def test_both_scenes_stand_under_all_maps(cells):
    rendered, maps, sampled = cells
    data = shadow_scenes.data(Rendered(rendered.directory, [*sampled, *rendered.cells], rendered.stand_ins), maps)
    assert data["measured"]["sampled_fps"]["column"]["galileo"]["value"] == pytest.approx(2.0)
    grid = shadow_scenes.draw(data)
    assert [block.title for block in grid.blocks] == [shadow_scenes.TITLES[s] for s in shadow_rates.SCENES]
    for s, block in enumerate(grid.blocks):
        assert block.names == ["real time", "1024 shadow maps", "Mitsuba 3", "error of real time"]
        assert block.columns[0] == maps[0].title and len(block.columns) == 4
        ours, theirs, truth, error = block.rows
        shown = [255 * tone_map([(0.1 + 0.2 * k) / (0.2 + 0.2 * k)], 0.9)[0] for k in range(4)]
        np.testing.assert_allclose([p.pixels[0, 0, 0] for p in ours], shown, atol=0.51)
        # One exposure a column: what is darker than the truth stays so, and the truth is just below white.
        assert all(a.pixels[0, 0, 0] < b.pixels[0, 0, 0] == 243 for a, b in zip(ours, truth, strict=True))
        assert truth[1].caption == f"white: {0.4 / 0.9:.3g} W m⁻² sr⁻¹"
        assert [p.caption.split("\N{NO-BREAK SPACE}")[0] for p in error] == [f"{1 + k + 4 * s}.00" for k in range(4)]
        assert {p.caption.split("\N{NO-BREAK SPACE}")[0] for p in theirs} == {"0.100"}
    assert "galileo for Galileo" in grid.note and grid.scale is not None


def test_the_figures_share_their_cells():
    planned = {}
    for name in ("004-teaser", "004-table1", "004-fig3"):
        made, replaced = cells_of(reports_directory() / "figures" / f"{name}.toml", {})
        planned[name] = {cell.id for cell in made}
        assert set(replaced.values()) == {one.environment for one in named(figures.FIGURES[name].maps, {})}
    assert planned["004-teaser"] < planned["004-table1"] < planned["004-fig3"]
    assert [len(ids) for ids in planned.values()] == [1, 8, 16]


def test_maps_and_their_lights(cells):
    maps = cells[1]
    data = lights_found.data(maps)
    assert [len(one["lights"]) for one in data["measured"]["maps"].values()] == [0, 1, 2, 3]
    assert data["measured"]["stand_ins"] == {"Galileo": maps[0].environment}
    (block,) = lights_found.draw(data).blocks
    assert [len(row) for row in block.rows] == [4, 4, 4]
    assert block.rows[1][1].caption.startswith("1 light, ") and block.rows[1][3].caption.endswith("(the paper's: 17)")
    assert stand_ins(maps[1:]) == "" and f"{maps[0].environment} for Galileo" in lights_found.draw(data).note


def test_the_teaser_is_of_its_map(cells):
    rendered, maps, _ = cells
    one = Rendered(rendered.directory, [rendered.cells[2]], {})
    data = shadow_teaser.data(one, [maps[2]])
    assert data["measured"]["lights"] == len(decompose(maps[2].radiance()).lights) == 2
    left, right = shadow_teaser.draw(data).blocks
    assert len(left.rows) == 2 and len(right.rows[0]) == 3 and right.rows[0][2].caption.startswith("3.00")
