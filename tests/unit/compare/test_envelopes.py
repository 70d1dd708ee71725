"""Planes, crossovers and Pareto fronts of made-up results, whose answers are known in closed form."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from evalsuite.compare import crossover, envelopes, pareto
from evalsuite.compare.statistics import Metric

EXPONENTS, FREQUENCIES = (10.0, 40.0, 160.0, 640.0), (2, 8, 32)
MATERIAL = [{"name": "exponent", "kind": "material"}, {"name": "face_size", "kind": "technique"}]


def cell(technique, error, width=0.0, reference="r", gpu=1.0, env=None, **parameters):
    value = {"value": error, "ci95": [error * (1 - width), error * (1 + width)]}
    return {
        "scene": "sphere", "target": "unoccluded", "technique": technique, "environment": env,
        "parameters": ({"env": env} if env else {}) | parameters, "metrics": {"rel_rmse": value}, "reference_id": reference,
        "cost": {"gpu_ms": gpu, "prepare_ms": 10 * gpu}, "technique_info": {"parameters": MATERIAL},
    }  # fmt: skip


def sweep(technique, law, width=0.0, face_sizes=(None,), reference="r{n:g}-{f}", **more):
    """A technique with error law(exponent, frequency, face size) over the whole sweep."""
    cells = []
    for n, f, w in itertools.product(EXPONENTS, FREQUENCIES, face_sizes):
        own = {"exponent": n} | ({"face_size": w} if w else {})
        cells.append(cell(technique, law(n, f, w), width, reference.format(n=n, f=f), env=f"band-{f}", **own, **more))
    return cells


def one_plane(*cells) -> envelopes.Plane:
    (plane,) = envelopes.planes([c for some in cells for c in some])
    return plane


def test_a_plane_of_two_power_laws_crosses_where_they_do():
    """0.01 (N/10)^½ and 0.04 (ℓ/2)^−½ (N/10)^−½: equal at N = 40 (ℓ/2)^−½."""
    plane = one_plane(
        sweep("rising", lambda n, f, w: 0.01 * (n / 10) ** 0.5, 0.01),
        sweep("falling", lambda n, f, w: 0.04 * (n / 10) ** -0.5 * (f / 2) ** -0.5, 0.01),
    )
    assert (plane.x, plane.y) == ("exponent", "frequency")
    along = [c for c in crossover.crossovers(plane) if c["axis"] == "exponent"]
    assert [c["at"] for c in along] == [{"frequency": 2.0}, {"frequency": 8.0}]  # beyond the sweep at 32
    for one in along:
        expected = 40 * (one["at"]["frequency"] / 2) ** -0.5
        assert one["value"] == pytest.approx(expected, rel=1e-9)
        # d = ln N + const; both are known to 1 %: ln 1.01/0.99 either way
        assert one["ci95"] == pytest.approx([expected * 0.99 / 1.01, expected * 1.01 / 0.99], rel=1e-9)
        assert one["decided"] and one["same_truth"]
        assert (one["better_below"], one["better_above"]) == ("rising", "falling")


def test_along_the_other_axis_too():
    plane = one_plane(
        sweep("flat", lambda n, f, w: 0.02, 0.01), sweep("fine", lambda n, f, w: 0.01 * (f / 2) ** 0.75, 0.01)
    )  # fmt: skip
    found = crossover.crossovers(plane)
    assert len(found) == len(EXPONENTS) and {c["axis"] for c in found} == {"frequency"}
    assert [c["value"] for c in found] == pytest.approx([2 * 2 ** (1 / 0.75)] * 4)
    assert {(c["better_below"], c["better_above"]) for c in found} == {("fine", "flat")}


def test_wide_intervals_leave_a_crossing_undecided_and_open():
    plane = one_plane(
        sweep("a", lambda n, f, w: 0.01 * (n / 10) ** 0.02, 0.1), sweep("b", lambda n, f, w: 0.0103, 0.1)
    )  # fmt: skip
    found = [c for c in crossover.crossovers(plane) if c["axis"] == "exponent"]
    assert len(found) == 3 and all(c["ci95"] == [None, None] and not c["decided"] for c in found)


def test_an_interval_that_reaches_to_zero_is_as_wide_as_the_grid():
    zero = (np.array([0.01, 0.02, 0.04]), np.array([0.009, 0.0, 0.039]), np.array([0.011, 0.022, 0.041]))
    flat = tuple(np.full(3, v) for v in (0.021, 0.0209, 0.0211))
    (one,) = crossover.crossings([1, 2, 4], zero, flat)
    assert one["between"] == [2.0, 4.0] and one["decided"]
    assert 1.0 < one["ci95"][0] < 2.0 and one["ci95"][1] == 4.0  # only the last point tells the two apart above


def test_exact_ties_are_no_crossing_but_may_lie_on_one():
    same = tuple(np.array([0.01, 0.02, 0.03]) for _ in range(3))
    assert crossover.crossings([1, 10, 100], same, same) == []
    line = tuple(np.array([0.005, 0.02, 0.06]) for _ in range(3))
    (one,) = crossover.crossings([1, 10, 100], line, same)
    assert one["value"] == pytest.approx(10) and one["first_below"]


def test_a_linear_axis():
    rising, flat = (tuple(np.array(v) for _ in range(3)) for v in ([1.0, math.e], [math.sqrt(math.e)] * 2))
    (one,) = crossover.crossings([-1, 1], rising, flat, log=False)
    assert one["value"] == pytest.approx(0.0, abs=1e-12)


def test_slices_meet_only_their_own_and_who_has_no_such_parameter():
    plane = one_plane(
        sweep("map", lambda n, f, w: 0.01 * w, face_sizes=(8, 32)), sweep("plain", lambda n, f, w: 0.02)
    )  # fmt: skip
    assert [c.label for c in plane.contenders] == ["map, face_size 8", "map, face_size 32", "plain"]
    met = [(values, a.label, b.label) for values, a, b in envelopes.pairs(plane)]
    assert met == [({"face_size": 8.0}, "map, face_size 8", "plain"), ({"face_size": 32.0}, "map, face_size 32", "plain")]


def test_other_truths_share_a_plane_only_over_a_common_material_parameter():
    phong = sweep("phong-like", lambda n, f, w: 0.01)
    blinn = sweep("blinn-like", lambda n, f, w: 0.02, reference="other-{n:g}-{f}")
    plane = one_plane(phong, blinn)
    assert not crossover.same_truth(*plane.contenders)
    for c in (*phong, *blinn):  # the same two axes, but none of the material's
        c["technique_info"] = {"parameters": []}
    assert [len(p.contenders) for p in envelopes.planes([*phong, *blinn])] == [1, 1]


def test_cells_without_a_score_are_gaps():
    cells = sweep("a", lambda n, f, w: 0.01)
    cells[4]["metrics"] = {}
    (plane,) = envelopes.planes(cells)
    assert np.isnan(plane.contenders[0].value).sum() == 1


def test_one_axis_is_no_plane():
    assert envelopes.planes([cell("a", 0.1, exponent=n) for n in EXPONENTS]) == []
    assert envelopes.planes([cell("a", 0.1, exponent=10.0, env=e) for e in ("office", "cathedral")]) == []


def test_cells_that_state_other_numbers_are_another_sweep():
    """Of one technique, two angles here and two rings there span no plane; beside a real plane they change nothing."""
    apart = [cell("a", 0.1, azimuth=v) for v in (0.0, 130.0)] + [cell("a", 0.1, ring=v) for v in (0.0, 2.0)] + [cell("a", 0.1)]
    assert envelopes.planes(apart) == []
    law = sweep("a", lambda n, f, w: n * f)
    (plane,) = envelopes.planes([*law, *apart])
    np.testing.assert_array_equal(plane.contenders[0].value, one_plane(law).contenders[0].value)


def test_the_pareto_front_of_known_points():
    def exact(error, cost):
        return Metric(error, (error, error)), Metric(cost, (cost, cost))

    # cheap and bad, dear and good, a middle one on the front, one behind it, one that equals another
    points = [exact(0.4, 1), exact(0.1, 10), exact(0.2, 3), exact(0.3, 4), exact(0.2, 3)]
    assert [on for on, _ in pareto.front(points)] == [True, True, True, False, True]
    assert [decided for _, decided in pareto.front(points)] == [True, True, False, True, False]


def test_the_front_is_undecided_where_intervals_overlap():
    points = [(Metric(0.2, (0.1, 0.3)), Metric(1, (1, 1))), (Metric(0.25, (0.2, 0.3)), Metric(2, (2, 2)))]
    assert pareto.front(points) == [(True, True), (False, False)]


def test_accuracy_over_a_plane_and_its_interval():
    value = np.array([0.03, 0.04])
    metric = pareto.over_plane(value, value * 0.9, value * 1.1)
    assert metric.value == pytest.approx(math.sqrt(0.0025 / 2))
    up = math.hypot(0.0009 * 0.21, 0.0016 * 0.21) / 2
    assert metric.ci95[1] == pytest.approx(math.sqrt(0.00125 + up))
    down = math.hypot(0.0009 * 0.19, 0.0016 * 0.19) / 2
    assert metric.ci95[0] == pytest.approx(math.sqrt(0.00125 - down))


def test_cost_is_a_mean_with_students_interval():
    cost = pareto.mean_cost(np.array([1.0, 2.0, 3.0]))
    assert cost.value == 2 and cost.ci95 == pytest.approx((0.0, 2 + 4.30265 / math.sqrt(3)), rel=1e-5)  # cut at 0
    assert pareto.mean_cost(np.array([1.0])).ci95 == (0.0, math.inf)


def test_pareto_of_a_plane():
    plane = one_plane(
        sweep("quick", lambda n, f, w: 0.1), [c | {"cost": {"gpu_ms": 5.0}} for c in sweep("exact", lambda n, f, w: 0.01)],
        [c | {"cost": {"gpu_ms": 6.0}} for c in sweep("slow", lambda n, f, w: 0.02)],
    )  # fmt: skip
    (entry,) = pareto.pareto(plane)  # nothing says what preparing the others costs
    assert entry["cost"] == "gpu_ms" and entry["cells"] == 12
    assert {p["contender"]: (p["on_front"], p["decided"]) for p in entry["points"]} == {
        "quick": (True, True),
        "exact": (True, True),
        "slow": (False, True),
    }
