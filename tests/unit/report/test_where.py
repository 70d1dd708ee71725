"""The part of a cell's page that says where the error is."""

from __future__ import annotations

import time

import numpy as np
import pytest
import synthetic_results as synthetic

from evalsuite.compare.regions import ORDER, OUTLINE
from evalsuite.report import page, scales, where


def metric(value, half=0.0):
    return {"value": value, "ci95": [value - half, value + half]}


def region(pixels, share, half=0.01):
    return {"pixels": pixels, "share": metric(share, half), "metrics": {"rel_rmse": metric(0.1), "rel_bias": metric(0.0)}}


def test_the_worst_region_is_the_densest_that_is_sure_and_large_enough():
    cell = {"mask_pixels": 1000, "regions": {
        "grazing": region(100, 0.4), "face-edge": region(200, 0.5), "face-corner": region(4, 0.3),
        "highlight": region(10, 0.08, half=0.075),
    }}  # fmt: skip
    assert where.worst(cell)["name"] == "grazing" and where.worst(cell)["times"] == pytest.approx(4.0)
    cell["regions"] = {"grazing": region(500, 0.5), "highlight": region(10, 0.08, half=0.075)}
    assert where.worst(cell) is None
    assert where.worst({"status": "failed"}) is None


def test_regions_have_flat_colours_of_their_own():
    scale = scales.regions(["grazing", "umbra"])
    colours = scale.colours(np.arange(OUTLINE + 1.0))
    np.testing.assert_allclose(colours * 255, scales.REGIONS, atol=1e-3)
    assert len(set(map(tuple, colours.tolist()))) == OUTLINE + 1 == len(ORDER) + 2
    assert "4 umbra; 7 grazing" in scale.caption and "silhouette" not in scale.caption


def test_on_the_page(tmp_path):
    results = synthetic.results(tmp_path)
    results["cells"] = results["cells"][:2]
    page.write(results, tmp_path)
    html = synthetic.cell_pages(tmp_path)
    assert html.count("Where the error is") == 2
    assert html.count('data-figure="n_dot_v"') == html.count('data-figure="face_angle"') == 2
    for name in results["cells"][0]["regions"]:
        assert f" {name}<small>" in html
    assert "It is too bright by" in html or "It is too dark by" in html
    assert len(list((tmp_path / "cells").glob("*/regions.webp"))) == 1
    blob = results["cells"][0]["blob"]
    assert f"{blob['pixels']} pixels" in html


def test_it_costs_little(tmp_path):
    results = synthetic.results(tmp_path)
    cell = results["cells"][0]
    started = time.process_time()
    for _ in range(20):
        where.worst(cell), where.numbered(cell)
    assert (time.process_time() - started) / 20 < 0.02
