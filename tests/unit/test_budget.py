"""What a budget is spent on: time as it is written, the best allotment against all there are, groups, the spending itself."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from evalsuite import budget
from evalsuite.allotment import BATCH, SIGMAS, Group, Offer, allot, best
from evalsuite.errors import EvalsuiteError
from evalsuite.settings import Settings


@pytest.mark.parametrize(
    ("text", "seconds"), [("90s", 90), ("10m", 600), ("2h", 7200), ("1h30m", 5400), ("1H2m3s", 3723), (" 40s ", 40)]
)
def test_time_as_it_is_written(text, seconds):
    assert budget.seconds_of(text) == seconds


@pytest.mark.parametrize("text", ["", "10", "0s", "0h0m", "m", "-5s", "1.5h", "30m1h", "10 m", "ten minutes", "٣m1", "9999999s"])
def test_what_is_no_time_is_refused(text):
    with pytest.raises(EvalsuiteError, match="--budget") as caught:
        budget.seconds_of(text)
    assert caught.value.exit_code == 2 and "1h30m" in str(caught.value)


def worth(offers, chosen):
    picked = [offers[g][k] for g, k in enumerate(chosen) if k is not None]
    return sum(cost for cost, _ in picked), sum(gain for _, gain in picked)


@pytest.mark.parametrize("seed", range(30))
def test_no_allotment_is_better(seed):
    rng = np.random.default_rng(seed)
    groups = [
        sorted((int(cost), float(gain)) for cost, gain in zip(rng.integers(1, 30, 3), rng.uniform(0, 2, 3), strict=True))
        for _ in range(4)
    ]
    seconds = int(rng.integers(1, 80))
    every = itertools.product([None, 0, 1, 2], repeat=4)
    most = max(gain for cost, gain in (worth(groups, chosen) for chosen in every) if cost <= seconds)
    cost, gain = worth(groups, allot(groups, seconds, steps=seconds))
    assert cost <= seconds and gain == pytest.approx(most)
    # Of seconds that do not divide, what is rounded up is lost at most.
    cost, coarse = worth(groups, allot(groups, seconds, steps=1000))
    fitting = max(gain for cost, gain in map(lambda c: worth(groups, c), itertools.product([None, 0, 1, 2], repeat=4))
                  if cost <= seconds * (1 - 4 / 1000))  # fmt: skip
    assert cost <= seconds and coarse >= fitting - 1e-12


def test_without_time_nothing_is_taken():
    assert allot([[(1.0, 1.0)], []], 0.0) == [None, None] == allot([[(1.0, 1.0)], []], -3.0)
    assert allot([], 10.0) == []


def test_pairs_expected_to_be_decided_are_those_that_are():
    """Against experiments: a true difference, the pilot's and the fresh one's noise."""
    rng = np.random.default_rng(0)
    sigma, error = 0.5, 0.02
    true = rng.uniform(-20, 20, 4_000_000)
    seen = true + sigma * rng.normal(size=true.size)
    for difference, finer in ((0.3, 0.005), (0.9, 0.01), (0.0, 0.004)):
        alike = true[abs(seen - difference) < 0.02]
        fresh = sigma * finer / error
        decided = abs(alike + fresh * rng.normal(size=alike.size)) > SIGMAS * fresh
        assert Group("g", (0,), error, ((difference, sigma),)).decided(finer) == pytest.approx(decided.mean(), abs=0.03)
    assert Group("g", (0,), error).decided(0.001) == 0.0


def test_a_finer_reference_gains_more_and_says_why():
    group = Group("g", (0, 1), 0.04, ((0.1, 0.2),), (0.5, 0.1))
    gains = [group.gain(error) for error in (0.04, 0.02, 0.01, 0.005)]
    assert gains == sorted(gains) and gains[-1] < 1.1
    assert "of 1 undecided" in group.why(0.01)
    assert replace(group, pairs=()).why(0.01) == "intervals of ±50% of the value"
    assert replace(group, pairs=()).gain(0.02) == pytest.approx(0.05 * 0.6 / 2)


def test_undecided_pairs_come_first_and_a_batch_leaves_time_to_learn():
    offers = (Offer(0.01, 4096, 10.0),)
    wide = [Group(f"w{k}", (k,), 0.1, (), (1.0,), offers) for k in range(5)]
    close = Group("close", (9, 10), 0.1, ((1.0, 0.5),), (0.1,), offers)
    jobs = best([*wide, close], 30.0)
    assert jobs[0][0].name == "close" and sum(offer.seconds for _, offer in jobs) <= 30.0 * BATCH + 10
    assert best(wide, 9.0) == [] and len(best(wide, 10.0)) == 1 and len(best(wide, 1000.0)) == 5


@pytest.mark.parametrize(("known", "foretold", "finest", "error"), [
    (True, 20.0, 0.001, 0.02), (True, 40.0, 0.001, 0.1), (False, 20.0, 0.001, 0.1), (True, 20.0, 0.05, 0.05),
    (False, 0.0, 0.3, 0.3),
])  # fmt: skip
def test_the_pilot_is_a_draft_where_that_is_known_to_fit(monkeypatch, known, foretold, finest, error):
    monkeypatch.setattr(budget.forecast, "at_hand", lambda run, cells: known)
    monkeypatch.setattr(budget.forecast, "forecast", lambda run, cells: SimpleNamespace(seconds=(foretold, 0.0, 99.0)))
    run = SimpleNamespace(settings=Settings(target_error=finest, cap=1 << 19), progress=None)
    run.twin = lambda settings, progress: SimpleNamespace(settings=settings)
    assert budget.pilot(run, [], 90.0).settings.target_error == error
    assert budget.pilot(run, [], 90.0).settings.cap <= 1 << 15


class Made:
    """A run whose references take `pace` times as long as foretold; nothing is rendered."""

    def __init__(self, pace):
        self.pace, self.now, self.warnings = pace, 20.0, []
        self.settings = SimpleNamespace(target_error=0.001, cap=1 << 15, seed=3)
        self.progress = SimpleNamespace(warn=self.warnings.append)


def spent(monkeypatch, run, seconds, groups):
    """`budget.spend` with what it reaches out for put by numbers."""

    def make(run, cells, jobs):
        run.now += run.pace * sum(offer.seconds for _, offer in jobs)
        return [[({"notes": [], "cost": {"reference_spp": 64}}, {})] * len(group.cells) for group, _ in jobs]

    entry = lambda run, cells, group, offer, fresh: {"group": group.name, "error": offer.error}  # noqa: E731
    monkeypatch.setattr(budget, "decide", lambda run, made, confidence: (list(made), []))
    monkeypatch.setattr(budget, "_groups", lambda made, comparisons: groups)
    monkeypatch.setattr(budget._Prices, "of", lambda *_: SimpleNamespace(offers=lambda group: group.offers))
    monkeypatch.setattr(budget, "_make", make)
    monkeypatch.setattr(budget, "_entry", entry)
    cells = [({"status": "scored", "mask_pixels": 1000}, {})] * 60
    return budget.spend(run, run, [None] * 60, cells, seconds, lambda: run.now)[2]


def groups(count, seconds=(2.0, 8.0)):
    offers = tuple(Offer(0.02 / 2**k, 1 << 15, s) for k, s in enumerate(seconds))
    return [Group(f"g{k}", (k,), 0.04, ((0.1 * k, 0.2),), (0.5,), offers) for k in range(count)]


@pytest.mark.parametrize("pace", [0.5, 1.0, 1.5, 2.0])
def test_it_ends_in_time_whatever_references_take(monkeypatch, pace):
    run = Made(pace)
    found = spent(monkeypatch, run, 100.0, groups(12))
    assert run.now < 115.0 and found["taken_s"] == run.now
    # What is left is not enough for the least of all offers, or nothing is left to do.
    assert len(found["spent"]) == 12 or run.now > 100.0 - 13.5 - 4 * pace - 0.2 * 70
    assert len({one["group"] for one in found["spent"]}) == len(found["spent"]), "each has one fresh look"


def test_time_that_references_do_not_take_goes_to_others(monkeypatch):
    """Twice as fast as foretold: what the first batch saves makes later ones finer, two thirds of the time are used."""
    run = Made(0.5)
    found = spent(monkeypatch, run, 100.0, groups(60, (1.0, 3.0)))
    assert run.now > 65 and len(found["spent"]) == 60


def test_a_budget_that_the_pilot_uses_up_is_said(monkeypatch):
    run = Made(1.0)
    found = spent(monkeypatch, run, 15.0, groups(12))
    assert found["spent"] == [] and len(run.warnings) == 1 and "nothing is left" in run.warnings[0]
    run = Made(1.0)
    assert spent(monkeypatch, run, 100.0, [])["spent"] == [] and run.warnings == []


def test_groups_are_cells_of_one_reference_with_what_is_undecided():
    def cell(name, reference, value=1.0, ends=(0.8, 1.2), status="scored"):
        metric = {"value": value, "ci95": list(ends)}
        return {"id": name, "status": status, "reference_id": reference, "reached_error": 0.03, "metrics": {"rel_rmse": metric},
                "scene": "s", "mapping": [], "parameters": {}, "target": "t"}, {}  # fmt: skip

    def pair(better, worse, value, half, decided):
        return {"better": better, "worse": worse, "difference": {"value": value, "ci95": [value - half, value + half]},
                "decided": decided}  # fmt: skip

    made = [cell("a", "x"), cell("b", "x", 0.1, (0.0, 0.5)), cell("c", "y", None, (None, None)), cell("d", "x"), cell("e", "y"),
            cell("f", "z", status="failed")]  # fmt: skip
    pairs = [pair("a", "b", 0.5, 1.0, False), pair("b", "d", 3.0, 1.0, True)]
    comparisons = [{"pairs": pairs}, {"pairs": [pair("c", "e", 0.0, 0.0, False)]}]
    one, other = budget._groups(made, comparisons)
    assert one.cells == (0, 1, 3) and other.cells == (2, 4) and one.error == 0.03
    assert one.pairs == ((0.5, pytest.approx(1.0 / SIGMAS)),) and other.pairs == (), "equal pictures cannot be told apart"
    assert one.widths == pytest.approx((0.2, 1.0, 0.2)) and other.widths == pytest.approx((1.0, 0.2))
    assert budget._undecided(comparisons) == 1
