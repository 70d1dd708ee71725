"""Headroom over many cells: random effects, the best single constant, the sentence."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.compare.headroom_pool import best_constant, pooled, random_effects, summary


def test_random_effects_hold_their_mean():
    """Six maps that differ by τ = 0.3, each measured to 0.05: the interval holds the mean 95 times of 100, τ comes out."""
    random, inside, between = np.random.default_rng(0), 0, []
    for _ in range(400):
        values = 0.4 + 0.3 * random.normal(size=6) + 0.05 * random.normal(size=6)
        mean, _, tau = random_effects(values, [0.05] * 6)
        inside += mean.ci95[0] <= 0.4 <= mean.ci95[1]
        between.append(tau)
    assert 0.92 <= inside / 400 <= 0.98 and np.sqrt(np.mean(np.square(between))) == pytest.approx(0.3, rel=0.1)


def test_equal_effects_are_weighted_by_their_errors():
    mean, error, tau = random_effects([1.0, 1.0, 1.0], [0.1, 0.2, 0.2])
    assert mean.value == pytest.approx(1.0) and tau == 0.0 and error == pytest.approx((100 + 25 + 25) ** -0.5, rel=1e-4)
    assert random_effects([2.0], [0.1])[0].ci95 == pytest.approx((1.804, 2.196), abs=1e-3)


def test_a_map_with_more_cells_counts_no_more():
    few = pooled({"a": [(0.0, 0.01)] * 2, "b": [(1.0, 0.01)] * 2, "c": [(0.5, 0.01)] * 2})
    many = pooled({"a": [(0.0, 0.01)] * 40, "b": [(1.0, 0.01)] * 2, "c": [(0.5, 0.01)] * 2})
    assert few["value"] == pytest.approx(0.5, abs=1e-3) and many["value"] == pytest.approx(0.5, abs=1e-3)
    assert many["ci95"][1] - many["ci95"][0] > 1.0  # three maps are three


def entry(best, width=0.1, at_bound=False, spread=4.0):
    points = np.linspace(-spread / 2, spread / 2, 9)
    return {
        "parameter": "lod_offset", "unit": "levels", "published": 0.0, "best": best, "best_ci95": [best - width, best + width],
        "at_bound": at_bound, "whole": False, "regret": {"value": 0.1},
        "drawn": [{"value": float(x), "mse": 0.01 + (x - best) ** 2} for x in points],
    }  # fmt: skip


def test_the_best_single_constant_lies_where_the_ratios_are_least():
    found = best_constant({name: [entry(b)] for name, b in (("a", 0.8), ("b", 0.8), ("c", 0.8))})
    assert found["value"] == pytest.approx(0.8, abs=0.02) and found["rmse_ratio"]["value"] < 0.2 and not found["at_end"]
    assert found["ci95"] == pytest.approx([found["value"]] * 2)
    spread = best_constant({name: [entry(b)] for name, b in (("a", 0.3), ("b", 0.8), ("c", 1.3))})
    assert spread["ci95"][0] < spread["value"] < spread["ci95"][1]


def cell(technique, name, exponent, found):
    return {
        "technique": technique,
        "scene": "sphere",
        "environment": name,
        "parameters": {"exponent": exponent},
        "headroom": [found],
        "metrics": {"rel_bias": {"value": 0.25}},
    }


def test_the_sentence_says_what_the_cells_say():
    maps = {"office": 0.02, "cathedral": -0.01, "overcast": 0.0}
    cells = [cell("glossy-mcguire", m, s, entry(0.6 + d)) for m, d in maps.items() for s in (10, 50)]
    cells += [cell("glossy-boxmip-lod", m, s, entry(-0.4 + d)) for m, d in maps.items() for s in (10, 50)]
    cells += [cell("glossy-mcguire", "office", 500, entry(2.0, at_bound=True))]
    found = summary(cells)
    h, r = found["pools"]
    assert (h["cells"], h["open_cells"], h["maps"]) == (7, 1, 3) and r["best"]["value"] == pytest.approx(-0.4, abs=0.02)
    assert found["difference"]["value"] == pytest.approx(1.0, abs=0.01)
    assert "about h c = +0.60" in found["sentence"] and "about r c = −0.40" in found["sentence"] and "holds" in found["sentence"]
    assert "+25 % about h" in found["sentence"]
    assert (
        "does not hold"
        in summary([*cells[:6], *(cell("glossy-boxmip-lod", m, s, entry(0.1)) for m in maps for s in (10, 50))])["sentence"]
    )


def test_a_bias_is_counted_from_what_is_published_and_whole_numbers_are_not_pooled():
    moved = entry(0.8)
    moved = moved | {"parameter": "bias", "published": 3.0, "best": 3.8, "best_ci95": [3.7, 3.9],
                     "drawn": [{"value": p["value"] + 3.0, "mse": p["mse"]} for p in moved["drawn"]]}  # fmt: skip
    (pool,) = summary([cell("glossy-boxmip", "office", 20, moved)])["pools"]
    assert pool["best"]["value"] == pytest.approx(0.8) and pool["best_constant"]["value"] == pytest.approx(0.8, abs=0.02)
    (pool,) = summary([cell("diffuse-sh9", "office", 20, entry(2.0) | {"whole": True})])["pools"]
    assert pool["best"]["value"] is None and pool["best_constant"] is None


def test_without_headroom_there_is_no_summary():
    assert summary([{"technique": "a", "scene": "b", "environment": None, "headroom": []}, {}]) is None
    alone = summary([cell("diffuse-topmip", "office", 1, entry(0.5))])
    assert alone["sentence"] is None and alone["difference"] is None
