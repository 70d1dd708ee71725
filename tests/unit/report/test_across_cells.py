"""The page's sections across cells: there with their pictures, words and scales when a run has something to say, else absent."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from evalsuite.compare import compare
from evalsuite.compare import envelopes as planes
from evalsuite.compare.findings import findings
from evalsuite.image import exr, ldr
from evalsuite.report import envelope_plots, envelopes, page, rankings, territories

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "compare"))
import synthetic_results as synthetic
from test_envelopes import sweep


def written(directory: Path, cells: list[dict]) -> dict:
    results = {"schema": "evalsuite.results/1", "cells": cells, "host": {}}
    results |= findings([(c, {name: directory / path for name, path in c["images"].items()}) for c in cells])
    page.write(results, directory)
    return results


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    directory = tmp_path_factory.mktemp("swept")
    cells = [
        *sweep("rising", lambda n, f, w: 0.01 * (n / 10) ** 0.5, 0.02, face_sizes=(8, 32)),
        *sweep("falling$<b>", lambda n, f, w: 0.04 * (n / 10) ** -0.5, 0.02, reference="own-{n:g}-{f}"),
    ]
    for k, cell in enumerate(cells):
        cell |= {"id": f"cell {k}", "status": "failed", "images": {}, "certificate": None, "message": ""}
    return directory, written(directory, cells)


def test_envelopes_have_figures_words_and_numbers(swept):
    directory, results = swept
    html = (directory / "index.html").read_text(encoding="utf-8")
    section = html[html.index('id="envelopes"') : html.index('<p class="foot">')]
    for name in ("contours-1", "best-1", "pareto-1"):
        svg = (directory / "envelopes" / f"{name}.svg").read_text(encoding="utf-8")
        assert svg.count("<path") > 20 and (directory / "envelopes" / f"{name}.png").stat().st_size > 5000
        assert f'src="envelopes/{name}.svg" alt="' in section and f'href="envelopes/{name}.png"' in section
    assert "falling$&lt;b&gt;" in section and "<b>" not in section
    decided = [c for c in results["envelopes"]["crossovers"] if c["decided"]]
    assert len(decided) == 6 and section.count("<td>exponent</td>") == 6  # two face sizes, three frequencies
    assert all(c["value"] == pytest.approx(40) for c in decided) and "each its own" in section
    assert "on the front" in section.lower()
    json.dumps(results, allow_nan=False)
    assert "Where metrics disagree" not in html, "none of these share a reference and a score"


def test_figures_are_drawn_again_byte_for_byte(swept):
    directory, results = swept
    files = sorted((directory / "envelopes").iterdir())
    before = [f.read_bytes() for f in files]
    envelopes.section(results, directory)
    assert [f.read_bytes() for f in files] == before


def test_panels_show_what_was_measured(swept):
    """The colour at a measured point is that of its error: the contours are drawn from the right cells."""
    _, results = swept
    (plane,) = planes.planes(results["cells"])
    assert [c.label for c in plane.contenders] == ["rising, face_size 8", "rising, face_size 32", "falling$<b>"]
    fine = np.exp(territories.interpolate(plane, np.log(plane.contenders[0].value)))
    assert fine[0, 0] == pytest.approx(0.01) and fine[-1, -1] == pytest.approx(0.01 * 8)
    assert fine[-1, 0] == pytest.approx(0.01) and fine[0, -1] == pytest.approx(0.01 * 8)
    middle = territories.FINE // 2
    assert fine[middle, middle] == pytest.approx(0.01 * np.sqrt(territories.fine(plane.xs)[middle] / 10))
    figure = envelopes.contours(plane)
    assert [a.get_visible() for a in figure.axes[:4]] == [True, True, True, False]
    axes = envelopes.winners(plane, territories.of(plane)).axes
    assert all(a.get_xlabel() == "exponent of the lobe" and a.get_xscale() == "log" for a in axes)


def test_who_is_best_is_who_was_measured_best(swept):
    _, results = swept
    (plane,) = planes.planes(results["cells"])
    rivals = territories.of(plane)
    assert rivals
    for values, one in rivals:
        for j, y in ((0, 0), (-1, -1)):
            for i, x in ((0, 0), (-1, -1)):
                least = min(one.members, key=lambda c, j=j, i=i: c.value[j, i])
                assert one.members[one.best[y, x]].label == least.label
        for at in one.crossings():
            row = list(plane.ys).index(at.y)
            a, b = (np.interp(np.log(at.value), np.log(plane.xs), np.log(c.value[row])) for c in (at.a, at.b))
            assert a == pytest.approx(b, abs=1e-6) and at.low <= at.value <= at.high
        drawn = json.dumps(envelope_plots.winner(one, values, envelopes._colours(plane), envelopes.AXES))
        assert all(repr(at.value) in drawn for at in one.crossings())
    assert any(one.crossings() for _, one in rivals)


def test_levels_hold_all_values():
    assert list(envelopes._levels(np.array([0.013, 0.3]))) == [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
    same = envelopes._levels(np.array([0.02, 0.02]))
    assert len(same) >= 2 and same[0] <= 0.02 <= same[-1], "one value still has a scale"


def test_a_plain_run_has_neither(tmp_path):
    cells = [synthetic.cell(tmp_path, "sphere", "glossy-mcguire", 10.0)]
    results = written(tmp_path, cells)
    html = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert results["envelopes"] is results["rankings"] is None
    assert 'id="envelopes"' not in html and 'id="rankings"' not in html
    assert not (tmp_path / "envelopes").exists() and not (tmp_path / "rankings").exists()
    page.write({k: v for k, v in results.items() if k not in ("envelopes", "rankings")}, tmp_path)  # results of before


def test_a_flip_shows_where_who_is_nearer(tmp_path):
    cells = [synthetic.cell(tmp_path, "sphere", t, 10.0) for t in ("glossy-mcguire", "glossy-boxmip")]
    _, reference, *_, mask = synthetic.pictures()

    # Right but for a hundredth of the pixels, which are far off; the other is wrong everywhere by little.
    spot = np.zeros_like(mask)
    spot[40:44, 40:44] = True
    other = np.where(spot[..., None], reference * 8, reference * 1.001)
    exr.write(tmp_path / cells[1]["images"]["image"], other)
    cells[1] |= compare(other, reference, 0.01 * reference, mask=mask).to_json()
    for cell in cells:
        cell["reference_id"] = "one"
    results = written(tmp_path, cells)
    (flip,) = results["rankings"]["flips"]
    assert "rel_rmse" in flip["prefer_a"] and "mae" in flip["prefer_b"]
    assert flip["pixels"]["b"]["most_pixels"]["value"] < 0.01 < flip["pixels"]["a"]["most_pixels"]["value"]
    html = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Where metrics disagree" in html and "is nearer to the truth in" in html and "Colour scale: (|A − truth|" in html
    (shown,) = rankings.section(results, tmp_path)["flips"]
    png = tmp_path / shown.preview
    colours = ldr.read(png, png.read_bytes(), 10**6)
    assert colours[42, 42, 2] > colours[42, 42, 0], "blue: A is nearer in B's spot"
    assert colours[48, 20, 0] > colours[48, 20, 2], "red: B elsewhere"
    (tmp_path / cells[0]["images"]["image"]).write_bytes(b"damaged")
    (shown,) = rankings.section(results, tmp_path)["flips"]
    assert shown.preview is None and "image.exr" in shown.problem
    page.write(results, tmp_path)
    assert "image.exr" in (tmp_path / "index.html").read_text(encoding="utf-8")
