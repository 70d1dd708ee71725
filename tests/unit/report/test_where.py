"""The part of a cell's page that says where the error is."""

from __future__ import annotations

import re
import time
from xml.etree import ElementTree

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
    assert where.worst({"status": "failed"}) is None and where.plots({"status": "failed"}) == []


def test_a_plot_puts_values_where_they_belong():
    bins = [
        {"edges": [0.0, 0.5], "pixels": 9, "rel_rmse": metric(0.2, 0.05), "rel_bias": metric(-0.1)},
        {"edges": [0.5, 1.0], "pixels": 9, "rel_rmse": {"value": None, "ci95": [None, None]}, "rel_bias": metric(0.1, 5.0)},
    ]
    plot = where.plot("x", bins)
    ticks = {label: at for at, label in plot.y_ticks}
    (_, _, (high,)), (_, _, (low, wide)) = plot.series
    assert (high.x0, high.x1) == (where.LEFT, low.x1) and wide.x1 == where.WIDTH - where.RIGHT
    assert high.y == ticks["20 %"] and low.y == ticks["−10 %"] and plot.zero == ticks["0 %"]
    assert ticks["20 %"] < ticks["0 %"] < ticks["−10 %"]
    unit = (ticks["0 %"] - ticks["20 %"]) / 0.2
    assert high.low - high.y == pytest.approx(0.05 * unit, abs=0.2)
    assert wide.high == where.TOP and wide.low == where.HEIGHT - where.BOTTOM  # an interval does not leave the plot
    assert high.says == "0 to 0.5, 9 pixels: relative RMSE 20 % (15 % to 25 %)"
    assert plot.x_ticks[0] == (where.LEFT, "0") and plot.x_ticks[-1] == (where.WIDTH - where.RIGHT, "1")


@pytest.mark.parametrize("value", [0.0, 1e-9, 3.0, -0.2, 1e6])
def test_any_magnitude_has_a_plot(value):
    plot = where.plot("x", [{"edges": [0.2, 0.3], "pixels": 1, "rel_rmse": metric(abs(value)), "rel_bias": metric(value)}])
    assert 1 <= len(plot.y_ticks) <= 9
    assert all(where.TOP <= bar.y <= where.HEIGHT - where.BOTTOM for _, _, bars in plot.series for bar in bars)


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
    svgs = re.findall(r"<svg.*?</svg>", html, re.DOTALL)
    assert len(svgs) == 4
    for svg in svgs:
        tree = ElementTree.fromstring(svg)
        assert tree.findall(".//title") and "rel_rmse" in svg
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
        where.worst(cell), where.plots(cell)
    assert (time.process_time() - started) / 20 < 0.02
