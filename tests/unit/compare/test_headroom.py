"""The best parameter and the regret of the published one: found where the optimum is known, and intervals that hold it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from evalsuite.compare.headroom import headroom, mean_square, reference
from evalsuite.compare.headroom_search import Range, bracket, next_value, vertex

LOD = Range(-6.0, 6.0, 1.0, 0.0)
SIZE = 24


def chain(size=SIZE, levels=8, seed=3):
    """(L, P, 3): a picture and ever stronger blurs of it, as a MIP chain looked up level by level."""
    sharp = np.random.default_rng(seed).gamma(2.0, 0.5, (size, size, 3))
    blurs = [gaussian_filter(sharp, (0.5 * 2 ** (k / 1.5), 0.5 * 2 ** (k / 1.5), 0), mode="wrap") for k in range(levels)]
    return np.stack(blurs).reshape(levels, -1, 3)


CHAIN = chain()


def picture(c, base=3.3):
    """The technique: trilinear at level base + c, clamped to the chain."""
    level = np.clip(base + c, 0.0, len(CHAIN) - 1.0)
    low = min(int(level), len(CHAIN) - 2)
    return (low + 1 - level) * CHAIN[low] + (level - low) * CHAIN[low + 1]


def noisy(truth, sigma, seed, grey=True):
    """A reference of relative standard error sigma per pixel, from two halves of 16 samples, its error estimated from them."""
    random = np.random.default_rng(seed)
    samples = random.standard_normal((32, len(truth), 1 if grey else 3))
    scale = sigma * truth * np.sqrt(32)
    halves = [truth + scale * samples[k::2].mean(0) for k in (0, 1)]
    return reference((halves[0], halves[1]), scale * samples.std(0, ddof=1) / np.sqrt(32))


def searched(truth, where=LOD, draw=picture):
    pictures, errors = {}, {}
    while (value := next_value(where, errors)) is not None:
        assert value not in errors and len(errors) < 25
        pictures[value] = draw(value)
        errors[value] = mean_square(pictures[value], truth)
    return headroom(where, pictures, truth)


def test_a_parabola_has_its_vertex_where_it_is():
    three = (-0.5, 0.25, 2.0)
    found, second = vertex(three, tuple(3.0 * (x - 0.4) ** 2 + 1.0 for x in three))
    assert found == pytest.approx(0.4) and second == pytest.approx(6.0)


def test_a_known_optimum_is_found():
    """Truth: the technique's own picture at c = 0.7, and noise."""
    found = searched(noisy(picture(0.7), 0.02, 0))
    lo, hi = found.best_ci95
    assert lo <= 0.7 <= hi and hi - lo < 0.1 and found.best == pytest.approx(0.7, abs=0.05)
    assert found.regret.ci95[0] > 0 and not found.at_bound
    exact = np.sqrt(np.square(picture(0.0) - picture(0.7)).mean()) / picture(0.7).mean()
    assert found.regret.ci95[0] <= exact <= found.regret.ci95[1]
    assert found.regret.value == pytest.approx(exact, rel=0.2)  # the root of a mean square near 0 is noisy
    assert found.best_rel_rmse.value < 0.2 * found.published_rel_rmse.value
    assert len(found.drawn) <= 15


def test_where_the_published_choice_is_best_there_is_no_regret():
    for seed in range(5):
        found = searched(noisy(picture(0.0), 0.03, seed))
        assert found.best_ci95[0] <= 0.0 <= found.best_ci95[1]
        assert found.regret.ci95[0] == 0.0 and found.regret.ci95[1] > 0.0


@pytest.mark.parametrize(("best", "sigma", "grey"), [(0.7, 0.05, True), (0.42, 0.2, False), (-1.55, 0.1, True)])
def test_intervals_hold_the_optimum(best, sigma, grey):
    """200 noise seeds. The truth is not in the family: it has structure of its own that no level has."""
    truth = picture(best) * (1.0 + 0.1 * np.random.default_rng(9).standard_normal((SIZE * SIZE, 1)))
    grid = np.linspace(best - 0.4, best + 0.4, 801)
    exact = [float(np.square(picture(c) - truth).mean()) for c in grid]
    optimum, least = grid[int(np.argmin(exact))], min(exact)
    regret = (np.sqrt(np.square(picture(0.0) - truth).mean()) - np.sqrt(least)) / truth.mean()
    inside, of_regret = 0, 0
    for seed in range(200):
        found = searched(noisy(truth, sigma, seed, grey))
        inside += found.best_ci95[0] <= optimum <= found.best_ci95[1]
        of_regret += found.regret.ci95[0] <= regret <= found.regret.ci95[1]
    assert 0.90 <= inside / 200 <= 0.99, inside / 200
    assert of_regret / 200 >= 0.90, of_regret / 200


def test_each_pixels_own_choice_is_bounded_from_both_sides():
    """Truth: half the picture at one level, half at another. Without noise the bound is exact, with noise it is in the interval
    and nearer than a choice that is scored by the noise it was made by."""
    mixed = np.where((np.arange(SIZE * SIZE) % 2 == 0)[:, None], picture(1.0), picture(-1.0))
    pictures = {c: picture(c) for c in (-2.0, -1.0, 0.0, 0.5, 1.0, 2.0)}
    quiet = headroom(LOD, pictures, reference((mixed, mixed), np.zeros_like(mixed)))
    assert quiet.per_pixel_rel_rmse.value == pytest.approx(0.0, abs=1e-9) and quiet.best_rel_rmse.value > 0.05
    truth = mixed + 0.05
    quiet = headroom(LOD, pictures, reference((truth, truth), np.zeros_like(truth)))
    exact = quiet.per_pixel_rel_rmse.value
    held = 0
    for seed in range(40):
        found = headroom(LOD, pictures, noisy(truth, 0.05, seed)).per_pixel_rel_rmse
        held += found.ci95[0] <= exact <= found.ci95[1]
        assert found.value >= 0.95 * exact
    assert held >= 36


def test_where_nothing_changes_any_more_the_interval_is_open():
    """Truth: past the end of the chain, where all levels are the same."""
    found = searched(noisy(CHAIN[-1], 0.02, 0), draw=lambda c: picture(c, base=6.0))
    assert found.best_ci95[1] == LOD.high and found.best_ci95[0] > 0.5 and found.at_bound


def test_a_constant_family_says_nothing():
    found = searched(noisy(CHAIN[2], 0.02, 0), draw=lambda c: CHAIN[0])
    assert found.best == 0.0 and found.best_ci95 == (-6.0, 6.0) and found.regret.value == 0.0 and found.at_bound


def test_whole_numbers_are_all_tried_until_nothing_changes():
    """A cap on lights: from 5 on the picture is that of 64."""
    where = Range(0, 64, 1, 64, whole=True)
    lights = np.cumsum(np.random.default_rng(1).gamma(1.0, 0.1, (6, 200, 3)), 0)
    found = searched(noisy(lights[3], 0.01, 0), where, lambda n: lights[min(int(n), 5)])
    assert sorted(found.drawn) == [0, 1, 2, 3, 4, 5, 64]
    assert found.best == 3 and found.best_ci95 == (3, 3) and not found.at_bound and found.regret.ci95[0] > 0
    blurred = searched(noisy(0.5 * (lights[3] + lights[4]), 1.0, 0), where, lambda n: lights[min(int(n), 5)])
    assert blurred.best_ci95[0] <= 3 and blurred.best_ci95[1] >= 4


def test_the_search_follows_a_far_optimum_to_the_bound():
    errors = {}
    while (value := next_value(LOD, errors)) is not None:
        errors[value] = (value - 9.0) ** 2
    assert max(errors) == 6.0 and bracket(LOD, errors) is None
