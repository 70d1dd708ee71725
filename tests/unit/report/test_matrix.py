"""The overview's data: rounded outwards of nothing, complete, small, and marked where noise decides."""

from __future__ import annotations

import json

import pytest

from evalsuite.report import matrix, plots
from evalsuite.report.page import METRICS


def cell(name, low, high, **more):
    value = (low + high) / 2
    metric = {"value": value, "ci95": [low, high]}
    return {"id": f"s/{name}/t", "scene": "s", "environment": "office", "technique": name, "target": "t", "status": "scored",
            "parameters": {"env": "office", "exponent": 10, "flag": True}, "reference_id": "one", "cost": {"gpu_ms": 1.23456789},
            "metrics": {"rel_rmse": metric, "rel_rmse_full": metric, "rel_bias": metric},
            "regions": {"grazing": {"pixels": 3, "metrics": {"rel_rmse": metric}}}} | more  # fmt: skip


def data(results):
    section = matrix.section(results, METRICS)
    assert "<" not in section["data"]
    return json.loads(section["data"])


def score(given, region, name, k=0):
    m = [n for n, *_ in given["metrics"]].index(name)
    return given["cells"][k]["scores"][given["regions"].index(region)][m]


def test_every_region_and_metric_with_interval():
    given = data({"cells": [cell("<script>", 0.123456789, 0.2)]})
    assert given["regions"] == ["object", "full picture", "grazing"] and given["targets"] == ["t"]
    for region in given["regions"]:
        assert score(given, region, "rel_rmse") == [0.16173, 0.12346, 0.2]
    assert score(given, "grazing", "flip") == 0 and score(given, "object", "flip") == 0
    (one,) = given["cells"]
    assert one["technique"] == "<script>" and one["scene"] == "s, office" and one["ms"] == 1.2346
    assert one["parameters"] == {"exponent": 10, "flag": "yes"}
    assert dict((n, k) for n, _, _, k in given["metrics"])["rel_bias"] == "signed"


def test_open_ends_and_missing_values():
    given = data({"cells": [cell("a", 0.1, 0.2, metrics={"psnr": {"value": 30.0, "ci95": [29.0, None]},
                                                         "flip": {"value": None, "ci95": [None, None]}})]})  # fmt: skip
    assert score(given, "object", "psnr") == [30, 29, None] and score(given, "object", "flip") == 0


def test_overlapping_intervals_are_marked_within_one_reference_only():
    cells = [cell("a", 0.1, 0.2), cell("b", 0.19, 0.3), cell("c", 0.31, 0.4), cell("d", 0.1, 0.2, reference_id="two")]
    given = data({"cells": cells})
    assert [len(score(given, "grazing", "rel_rmse", k)) for k in range(4)] == [4, 4, 3, 3]
    within = [cell("wide", 0.1, 0.9), cell("first", 0.2, 0.3), cell("second", 0.4, 0.5)]
    assert [len(score(data({"cells": within}), "grazing", "rel_rmse", k)) for k in range(3)] == [4, 4, 4]


def test_signed_metrics_tie_by_magnitude():
    cells = [cell("a", -0.2, -0.1), cell("b", 0.15, 0.3), cell("c", 0.5, 0.6)]
    assert [len(score(data({"cells": cells}), "object", "rel_bias", k)) for k in range(3)] == [4, 4, 3]


def test_rankings_know_better_over_the_object():
    cells = [cell("a", 0.1, 0.2), cell("b", 0.19, 0.3)]
    names = {c["id"]: c["technique"] for c in cells}
    group = {"reference_id": "one", "cells": names, "ranks": {"rel_rmse": {"a": [1, 1], "b": [2, 2]}}}
    given = data({"cells": cells, "rankings": {"groups": [group]}})
    assert len(score(given, "object", "rel_rmse")) == 3 and len(score(given, "full picture", "rel_rmse")) == 4
    group["ranks"]["rel_rmse"] = {"a": [1, 2], "b": [1, 2]}
    assert len(score(data({"cells": cells, "rankings": {"groups": [group]}}), "object", "rel_rmse")) == 4


def test_truths_are_named_apart():
    cells = [cell(n, 0.1, 0.2, reference_id=r) for r in ("one", "two") for n in ("a", "b")]
    given = data({"cells": [*cells, cell("alone", 0.1, 0.2, reference_id="three")]})
    assert given["truths"] == ["s, office, t, exponent 10, flag yes", "s, office, t, exponent 10, flag yes #2"]
    assert [c["truth"] for c in given["cells"]] == [0, 0, 1, 1, None]


def test_three_hundred_cells_stay_small():
    metrics = {n + e: {"value": 1.23456789e-5, "ci95": [1.1234567e-5, 1.3456789e-5]} for n, *_ in METRICS for e in ("", "_full")}
    regions = {r: {"pixels": 9, "metrics": {n: metrics[n] for n in ("mse", "rmse", "rel_rmse", "relmse", "mae", "smape", "bias",
                                                                    "rel_bias")}} for r in matrix.ORDER}  # fmt: skip
    cells = [cell(f"technique-{k}", 0.1, 0.2, metrics=metrics, regions=regions, reference_id=str(k)) for k in range(300)]
    assert len(matrix.section({"cells": cells}, METRICS)["data"]) < 1.3e6


class TestLedger:
    ROWS = (
        {"technique": "t", "cells": 2, "undecided": 0, "causes": [
            {"rung": "lobe", "fraction": {"value": 0.8, "ci95": [0.7, 0.9]}, "order": None},
            {"rung": "texels", "fraction": {"value": 0.3, "ci95": [0.2, 0.4]}, "order": 0.05},
            {"rung": "arithmetic", "fraction": {"value": -0.1, "ci95": [-0.2, 0.0]}, "order": None},
        ]},
    )  # fmt: skip

    def test_bars_stack_to_the_whole(self):
        ends = {one["rung"]: (left, right) for left, right, one in plots._stacked(self.ROWS[0]["causes"])}
        assert ends["lobe"] == (0, 0.8) and ends["texels"] == pytest.approx((0.8, 1.1)) and ends["arithmetic"] == (-0.1, 0)

    def test_hovering_tells_share_and_interval(self):
        item = json.dumps(
            plots.ledger(self.ROWS, {"lobe": "#111111", "texels": "#222222", "arithmetic": "#333333"}), ensure_ascii=False
        )
        assert "80 [70 … 90] %" in item and "± 5 %" in item and "share of squared error [%]" in item
        assert plots.ledger([{"technique": "t", "causes": []}], {}) is None
