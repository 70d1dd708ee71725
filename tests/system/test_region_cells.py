"""Regions, blob and curves through the program: results.json and the page."""

from __future__ import annotations

import json

import lamp_and_box
import pytest

from evalsuite.image import exr


@pytest.fixture(scope="module")
def cells(evalsuite, tmp_path_factory):
    place = tmp_path_factory.mktemp("where")
    scene = lamp_and_box.write(place, 64, (-0.7, 0.6, -0.3), 64)
    done = evalsuite("run", "--scene", scene, "-t", "shadow-none", "--target", "direct", "--target", "unoccluded",
                     "--out", place / "out")  # fmt: skip
    assert done.code == 0, done.err
    cells = json.loads((place / "out" / "results.json").read_text())["cells"]
    return place / "out", {cell["target"]: cell for cell in cells}


def test_a_picture_without_shadows_errs_where_the_shadow_is(cells):
    _, by_target = cells
    cell = by_target["direct"]
    regions = cell["regions"]
    assert cell["status"] == "scored" and {"umbra", "penumbra", "unshadowed", "silhouette"} <= set(regions)
    assert sum(regions[name]["pixels"] for name in ("umbra", "penumbra", "unshadowed")) == cell["mask_pixels"]
    # Ambient light alone is 0.02 π; the lamp adds a hundred times that where its shadow should be.
    assert regions["umbra"]["metrics"]["rel_bias"]["value"] > 5.0
    assert regions["umbra"]["share"]["ci95"][0] > 0.6
    assert abs(regions["unshadowed"]["metrics"]["rel_bias"]["value"]) < 0.05
    assert cell["blob"]["mean_error"]["value"] > 0 and 0.5 < cell["blob"]["pixels"] / regions["umbra"]["pixels"] < 4.0
    assert cell["looked_up"] == "n"


def test_a_target_without_visibility_has_no_shadows(cells):
    _, by_target = cells
    cell = by_target["unoccluded"]
    assert cell["regions"] and not {"umbra", "penumbra", "unshadowed"} & set(cell["regions"])


def test_values_come_with_intervals(cells):
    _, by_target = cells
    for cell in by_target.values():
        for region in cell["regions"].values():
            for metric in (*region["metrics"].values(), region["share"]):
                lo, hi = metric["ci95"]
                assert lo <= metric["value"] <= hi
        for curve in cell["curves"].values():
            assert sum(b["pixels"] for b in curve["bins"]) == cell["mask_pixels"]


def test_the_page_shows_them(cells):
    out, by_target = cells
    html = "".join(page.read_text(encoding="utf-8") for page in (out / "cells").glob("*.html"))
    assert (
        html.count("Where the error is") == 2
        and html.count('data-figure="n_dot_v"') == html.count('data-figure="face_angle"') == 2
    )
    assert "It is densest in the <strong>umbra</strong>" in html
    sets = exr.read(out / by_target["direct"]["images"]["regions"]).astype(int)
    assert (sets >> 3 & 1).sum() > 50  # umbra
