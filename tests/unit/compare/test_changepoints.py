"""Changes of level: no more false ones than stated, and a step is found as soon as its size allows."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from evalsuite.compare.changepoints import _partition, levels, threshold

ALARM = 0.01


def found(values, errors=1.0, noises=None, alarm=ALARM):
    """(first of each level after the first, levels)."""
    count = len(values)
    errors = np.broadcast_to(errors, count).tolist()
    made = levels(list(values), errors, list(range(count)) if noises is None else noises, alarm)
    assert [level.first for level in made] == [0, *(level.last + 1 for level in made[:-1])] and made[-1].last == count - 1
    return [level.first for level in made[1:]], made


def histories(count, seed):
    """Histories of 2 to 200 checks without change, whose errors differ tenfold."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        errors = rng.uniform(0.1, 1.0, rng.integers(2, 200))
        yield 5.0 + errors * rng.standard_normal(len(errors)), errors


@pytest.mark.parametrize("alarm", [0.01, 0.2])
def test_false_alarms_are_no_more_than_stated(alarm):
    false = sum(bool(found(values, errors, alarm=alarm)[0]) for values, errors in histories(1000, 7))
    assert false <= 1000 * alarm


def test_the_stated_rate_is_not_out_of_reach():
    """Two checks have but one pair of levels: there the bound is the rate."""
    rng = np.random.default_rng(3)
    false = sum(bool(found(rng.standard_normal(2), alarm=0.2)[0]) for _ in range(2000))
    assert 0.2 * 2000 == pytest.approx(false, abs=4 * np.sqrt(2000 * 0.2 * 0.8))


def test_seeds_that_come_back_are_no_change():
    """Fifty checks with one seed and fifty with another: many numbers, two measurements."""
    rng, false = np.random.default_rng(5), 0
    for _ in range(500):
        noise, drift = rng.standard_normal(4), 0.01 * rng.standard_normal(100)
        seeds = [0, 1] * 25 + [2, 3] * 25 if rng.random() < 0.5 else [0] * 50 + [1] * 50
        false += bool(found(noise[seeds] + drift, noises=seeds)[0])
    assert false <= 500 * ALARM


@pytest.mark.parametrize(("sigmas", "within", "power"), [(8, 1, 0.9), (6, 2, 0.9), (4, 5, 0.95), (3, 10, 0.95)])
def test_a_step_is_found(sigmas, within, power):
    """After 30 checks a step of so many standard errors of one check; seen at the latest so many checks after."""
    rng, hits = np.random.default_rng(11), 0
    for _ in range(200):
        values = rng.standard_normal(30 + within)
        values[30:] += sigmas
        changes, _ = found(values)
        hits += len(changes) == 1 and abs(changes[0] - 30) <= 1
    assert hits >= 200 * power


def test_one_check_may_be_a_level():
    values = np.random.default_rng(2).standard_normal(40)
    values[20] += 12
    assert found(values)[0] == [20, 21]


def test_a_step_without_noise_is_found_with_one_seed():
    """The same bits again and again, then others beyond the intervals: a real change, at the last check already."""
    changes, made = found([4.1] * 16 + [5.0], 0.1, [0] * 17)
    assert changes == [16]
    assert made[0].error == pytest.approx(0.1) and made[1].value == pytest.approx(5.0)
    assert found([4.1] * 16 + [4.3], 0.1, [0] * 17)[0] == [], "within the intervals"
    assert found([4.1] * 16 + [4.3] * 200, 0.1, [0] * 216)[0] == [], "however often the same is measured"


def test_levels_average_what_is_independent_and_no_more():
    values = [1.0, 2.0, 3.0, 3.0]
    _, [level] = found(values, 10.0)
    assert level.error == pytest.approx(10 / np.sqrt(4)) and level.value == pytest.approx(9 / 4)
    _, [level] = found(values, 10.0, [0, 0, 1, 1])
    assert level.error == pytest.approx(10 / np.sqrt(2)) and level.value == pytest.approx(2.25)


def test_partition_is_the_best_of_all():
    rng = np.random.default_rng(1)
    for _ in range(20):
        x, s = rng.standard_normal(8) + 3 * (np.arange(8) > 4), rng.uniform(0.5, 1.5, 8)

        def cost(ends, x=x, s=s):
            pieces = [slice(a, b) for a, b in zip([0, *ends], [*ends, 8], strict=True)]
            means = [np.average(x[p], weights=s[p] ** -2) for p in pieces]
            return sum((((x[p] - m) / s[p]) ** 2).sum() for p, m in zip(pieces, means, strict=True)) + 4.0 * len(ends)

        every = [list(c) for k in range(8) for c in itertools.combinations(range(1, 8), k)]
        assert _partition(x, s, 4.0) == min(every, key=cost)


def test_short_series():
    assert levels([], [], [], ALARM) == []
    assert found([1.0])[0] == [] and found([1.0, 1.0])[0] == [] and found([0.0, 9.0])[0] == [1]
    assert threshold(2, 0.05) == pytest.approx(1.959964)
