"""A cell's plots: what Bokeh is given."""

from __future__ import annotations

import json

import pytest

from evalsuite.report import cell_plots


def metric(value, half=0.0):
    return {"value": value, "ci95": [value - half, value + half]}


BINS = [
    {"edges": [0.0, 0.5], "pixels": 9, "rel_rmse": metric(0.2, 0.05), "rel_bias": metric(-0.1)},
    {"edges": [0.5, 1.0], "pixels": 7, "rel_rmse": {"value": None, "ci95": [None, None]}, "rel_bias": metric(0.1, 5.0)},
]


def test_curves_have_values_in_percent_and_their_intervals():
    made = cell_plots.contents({"curves": {"n_dot_v": {"bins": BINS}}})
    assert list(made) == ["n_dot_v"] and made["n_dot_v"]["figure"] == "curve"
    given = made["n_dot_v"]["given"]
    rmse, bias = given["rel_rmse"], given["rel_bias"]
    assert given["y-range"]["start"] < -10.0 and 20.0 < given["y-range"]["end"] < 30.0, "an interval may leave it"
    assert (rmse["x0"], rmse["x1"], rmse["y"]) == ([0.0], [0.5], [20.0]), "a bin without a value is left out"
    assert rmse["low"] == [pytest.approx(15.0)] and rmse["high"] == [pytest.approx(25.0)]
    assert bias["y"] == [-10.0, 10.0] and bias["high"][1] == pytest.approx(510.0)
    assert rmse["says"] == ["20.0 % [15.0 … 25.0]"]
    assert bias["range"][1] == "0.5 … 1, 7 pixels"


def test_the_ledgers_bars_carry_sign_and_interval():
    rungs = [
        {"rung": "visibility", "from": "direct", "to": "unoccluded", "fraction": 0.9, "fraction_ci95": [0.8, 1.0]},
        {"rung": "kernel", "from": "unoccluded", "to": "t", "fraction": -0.1, "fraction_ci95": [None, None]},
        {"rung": "none", "from": "a", "to": "b", "fraction": None, "fraction_ci95": None},
    ]
    given = cell_plots.contents({"ledger": rungs})["ledger"]["given"]
    bars = given["bars"]
    assert given["y-range"]["factors"] == ["kernel", "visibility"]
    assert bars["y"] == ["visibility", "kernel"] and bars["x"] == [90.0, -10.0]
    assert bars["low"] == [80.0, -10.0] and bars["high"] == [100.0, -10.0]
    assert bars["colour"] == [cell_plots.MORE, cell_plots.LESS]
    assert "noise decides" in bars["says"][1]


@pytest.mark.parametrize("value", [0.0, 1e-9, 3.0, -0.2, 1e6])
def test_any_magnitude_has_a_plot(value):
    bins = [{"edges": [0.2, 0.3], "pixels": 1, "rel_rmse": metric(abs(value)), "rel_bias": metric(value)}]
    text = json.dumps(cell_plots.contents({"curves": {"face_angle": {"bins": bins}}}), allow_nan=False)
    assert "angle to the cube face" in text


def test_a_cell_without_scores_has_no_plots():
    assert cell_plots.contents({"status": "failed"}) == {}


def test_figures_have_the_parts_that_are_filled():
    """Names that the page looks for are names that the figures have."""
    figures = cell_plots.figures()
    rungs = [{"rung": "a", "from": "b", "to": "c", "fraction": 1.0, "fraction_ci95": [0.9, 1.1]}]
    made = cell_plots.contents({"curves": {"n_dot_v": {"bins": BINS}}, "ledger": rungs})
    for one in made.values():
        known = json.dumps(figures[one["figure"]])
        assert all(f'"name": "{name}"' in known for name in one["given"])
    assert all(f'"name": "{name}"' in json.dumps(figures["histogram"]) for name in ("errors", "noise", "x-axis"))
