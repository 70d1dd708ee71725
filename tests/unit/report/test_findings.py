"""Findings in words: each says what the data say with its interval, and "undecided" where noise could turn it round."""

from __future__ import annotations

import copy

import pytest

from evalsuite.report import findings as module
from evalsuite.report.findings import findings


def metric(value, low, high):
    return {"value": value, "ci95": [low, high]}


def cell(technique, value, low, high, reference="one", **more):
    identity = f"ball/{technique}/office/unoccluded"
    metrics = {"rel_rmse": metric(value, low, high), "flip": metric(value / 2, low / 2, high / 2)}
    return {"id": identity, "scene": "ball", "environment": "office", "technique": technique, "parameters": {"env": "office"},
            "target": "unoccluded", "status": "scored", "reference_id": reference, "metrics": metrics} | more  # fmt: skip


def found(results, title):
    one = [f for f in findings(results) if f.title == title]
    return one[0] if one else None


def words(finding):
    return finding.text.replace("\N{NO-BREAK SPACE}", " ")


@pytest.fixture
def run():
    """Three techniques against one reference: exact, 5 and 20 %."""
    cells = [cell("exact", 0.0, 0.0, 0.001), cell("fair", 0.05, 0.049, 0.051), cell("poor", 0.2, 0.19, 0.21)]
    names = {c["id"]: c["technique"] for c in cells}
    ranks = {"rel_rmse": {"exact": [1, 1], "fair": [2, 2], "poor": [3, 3]}}
    group = {
        "scene": "ball",
        "target": "unoccluded",
        "reference_id": "one",
        "shared": {"env": "office"},
        "cells": names,
        "ranks": ranks,
    }
    return {"cells": cells, "rankings": {"groups": [group], "flips": []}}


def test_best_and_worst_with_intervals_and_links(run):
    one = found(run, "Best and worst against one truth")
    assert "best exact (ball, office, unoccluded) 0 % [0 … 0.100]" in words(one)
    assert "worst poor (ball, office, unoccluded) 20.0 % [19.0 … 21.0]" in words(one)
    assert [to for _, to in one.parts if to] == ["ball/exact/office/unoccluded", "ball/poor/office/unoccluded"]
    assert not one.undecided and "undecided" not in words(one)


def test_a_tie_for_the_first_place_is_undecided(run):
    run["rankings"]["groups"][0]["ranks"]["rel_rmse"] |= {"exact": [1, 2], "fair": [1, 2]}
    one = found(run, "Best and worst against one truth")
    assert "0 % [0 … 0.100], undecided; worst" in words(one) and "21.0], undecided" not in words(one)


def test_largest_error_is_undecided_where_intervals_meet(run):
    assert words(found(run, "Largest error")).startswith("poor (ball, office, unoccluded): relative RMSE 20.0 %")
    run["cells"][1]["metrics"]["rel_rmse"] = metric(0.15, 0.1, 0.195)
    one = found(run, "Largest error")
    assert one.undecided and words(one).startswith("Undecided beside 15.0 % [10.0 … 19.5] of fair")


def test_where_the_largest_error_is(run):
    region = {"pixels": 10, "share": metric(0.6, 0.5, 0.7), "metrics": {"rel_rmse": metric(1.0, 0.9, 1.1)}}
    run["cells"][2] |= {"mask_pixels": 100, "regions": {"grazing": region}}
    assert "Pixels of the grazing, 10 % of the object's pixels, hold 60.0 % [50.0 … 70.0] of its squared error" in words(
        found(run, "Largest error")
    )
    region["share"] = metric(0.6, 0.05, 0.9)  # could be less than its part of the pixels
    assert "grazing" not in words(found(run, "Largest error"))


@pytest.fixture
def caused(run):
    def cause(name, value, half):
        largest = {"cell": "ball/poor/office/unoccluded", "fraction": value}
        return {"rung": name, "fraction": metric(value, value - half, value + half), "largest": largest, "order": None}

    run["cells"][2]["ledger"] = [{"rung": "lobe", "rel_rmse": metric(0.18, 0.17, 0.19)}]
    run["causes"] = [
        {"technique": "poor", "cells": 1, "undecided": 0, "causes": [cause("lobe", 0.7, 0.05), cause("filter kernel", 0.3, 0.05)]}
    ]
    return run


def test_costliest_assumption(caused):
    one = found(caused, "What costs most")
    assert words(one).startswith("Lobe: 70.0 % [65.0 … 75.0] of the squared error of poor, mean over 1 cell")
    assert "relative RMSE of 18.0 % [17.0 … 19.0]" in words(one) and not one.undecided


def test_costliest_assumption_is_undecided_where_shares_overlap(caused):
    caused["causes"][0]["causes"][1]["fraction"] = metric(0.3, -0.1, 0.7)
    one = found(caused, "What costs most")
    assert one.undecided and "undecided between lobe (70.0 % [65.0 … 75.0]) and filter kernel (30.0 % [−10.0 … 70.0])" in words(
        one
    )


def pool(technique, value, low, high, parameter="lod_offset"):
    best = metric(value, low, high) | {
        "between_maps": 0.1,
        "by_map": {"a": metric(value, low, high), "b": metric(value, low, high)},
    }
    constant = metric(0.3, 0.2, 0.4) | {"rmse_ratio": metric(0.8, 0.7, 0.9), "at_end": False}
    return {"technique": technique, "parameter": parameter, "unit": "level", "maps": 2, "cells": 6, "open_cells": 1, "best": best,
            "best_constant": constant, "rel_bias": 0.0, "regret": None}  # fmt: skip


def test_mcguires_constant_for_each_lobe(run):
    pools = [pool("glossy-mcguire", 1.2, 1.0, 1.4), pool("glossy-boxmip-lod", 0.1, -0.1, 0.3)]
    run["headroom_summary"] = {"pools": pools}
    one = found(run, "Best constant in McGuire's level")
    text = words(one)
    assert "lobe about h: 1.20 [1.00 … 1.40] level beside the published lod_offset, over 2 maps" in text
    assert "leaves 80.0 % [70.0 … 90.0] of the RMSE" in text
    assert "lobe about r: undecided, as its interval holds the published choice: 0.100 [−0.100 … 0.300]" in text
    assert {to for _, to in one.parts if to} == {"#headroom"} and findings(run)[0] is not None
    assert findings(run)[0].title == one.title, "it comes first"
    pools[0]["best"] |= {"value": None, "ci95": [None, None]}
    assert "lobe about h: undecided, no best lod_offset within what was searched" in words(found(run, one.title))


def crossing(decided=True, **more):
    return {"scene": "ball", "target": "unoccluded", "environment": "office", "axis": "exponent", "at": {"face_size": 8.0},
            "value": 40.0, "ci95": [38.0, 42.0] if decided else [None, 42.0], "between": [10, 160], "better_below": "fair",
            "better_above": "poor", "decided": decided, "same_truth": True} | more  # fmt: skip


def test_crossovers(run):
    run["envelopes"] = {"crossovers": [crossing(False), crossing(ci95=[20.0, 80.0]), crossing()]}
    one = found(run, "Crossovers")
    assert "fair is nearer to the truth below 40.0 [38.0 … 42.0], poor above" in words(one), "the narrowest comes first"
    assert "2 of 3 crossovers are decided" in words(one) and len(one.lines) == 2
    run["envelopes"] = {"crossovers": [crossing(False)]}
    assert found(run, "Crossovers").undecided and "All 1 are undecided" in words(found(run, "Crossovers"))


def test_metrics_that_disagree(run):
    a, b = run["cells"][1]["id"], run["cells"][2]["id"]
    run["cells"][1]["metrics"]["flip"] = metric(0.3, 0.29, 0.31)
    flip = {"a": a, "b": b, "prefer_a": ["rel_rmse"], "prefer_b": ["rel_bias", "flip"], "strength": 0.5}
    run["rankings"]["flips"] = [flip]
    text = words(found(run, "Metrics disagree"))
    assert "rel_rmse: 5.00 % [4.90 … 5.10] beside 20.0 % [19.0 … 21.0]" in text
    assert "by flip: 0.300 [0.290 … 0.310] beside 0.100 [0.0950 … 0.105]" in text
    flip["strength"] = 0.0  # rests on the bias alone
    assert found(run, "Metrics disagree") is None


def test_orders_that_noise_could_change(run):
    ids = [c["id"] for c in run["cells"]]
    open_ = {"better": ids[1], "worse": ids[2], "difference": metric(1e-3, -1e-3, 3e-3), "decided": False}
    sure = {"better": ids[0], "worse": ids[1], "difference": metric(1e-3, 5e-4, 2e-3), "decided": True}
    same = {"better": ids[0], "worse": ids[1], "difference": metric(0.0, 0.0, 0.0), "decided": False}
    run["comparisons"] = [{"pairs": [sure, open_, same]}]
    one = found(run, "Orders that noise could change")
    assert one.undecided and words(one).startswith("1 of 2 neighbours")
    assert "poor (ball, office, unoccluded) less fair (ball, office, unoccluded): 0.00100 [−0.00100 … 0.00300]" in words(one)
    run["comparisons"] = [{"pairs": [sure, same]}]
    assert found(run, "Orders that noise could change") is None


def test_what_is_right_within_the_noise(run):
    text = words(found(run, "Right within the noise"))
    assert text.startswith("1 of 3 cells") and "relative RMSE 0 % [0 … 0.100]" in text
    run["cells"][0]["metrics"]["rel_rmse"] = metric(0.001, 0.0005, 0.0015)
    assert found(run, "Right within the noise") is None


def test_cells_without_a_score_come_first(run):
    run["cells"].append(cell("broken", 0.0, 0.0, 0.0, status="failed", message="no <picture>", metrics={}))
    one = findings(run)[0]
    assert words(one).startswith("1 of 4 cells have no score (1 failed)") and "no <picture>" in one.lines[0][1][0]


def test_nothing_is_said_of_nothing():
    assert findings({"cells": []}) == [] and findings({}) == []


def test_at_most_eight_and_by_weight(caused):
    everything = copy.deepcopy(caused)
    everything["headroom_summary"] = {"pools": [pool("glossy-mcguire", 1.2, 1.0, 1.4), pool("split-sum", 1.0, 0.5, 1.5, "lobes")]}
    everything["envelopes"] = {"crossovers": [crossing()]}
    ids = [c["id"] for c in everything["cells"]]
    everything["rankings"]["flips"] = [
        {"a": ids[1], "b": ids[2], "prefer_a": ["rel_rmse"], "prefer_b": ["flip"], "strength": 0.5}
    ]
    everything["comparisons"] = [
        {"pairs": [{"better": ids[1], "worse": ids[2], "difference": metric(1e-3, -1e-3, 3e-3), "decided": False}]}
    ]
    everything["cells"].append(cell("broken", 0.0, 0.0, 0.0, status="failed", metrics={}))
    said = findings(everything)
    assert len(said) == module.MOST and [f.weight for f in said] == sorted((f.weight for f in said), reverse=True)
    for one in said[1:]:  # the first counts cells
        assert "[" in one.text and any(to for _, to in one.parts), "a number with its interval, and where it stands"
