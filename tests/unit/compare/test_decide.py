"""Paired differences: exact without noise, intervals that hold, ties that stay ties."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.compare.comparison import debiased_metrics
from evalsuite.compare.decide import difference, rank
from evalsuite.compare.statistics import Noisy


def quiet(picture):
    return Noisy(picture, np.zeros_like(picture), np.zeros_like(picture))


def pictures(seed=0, pixels=1500):
    """A truth (P, 3), and two pictures with nearly the same error."""
    random = np.random.default_rng(seed)
    truth = random.gamma(3.0, 0.2, (pixels, 3))
    better = truth * (1 + 0.1 * random.standard_normal(truth.shape))
    return truth, better, better + 0.01 * truth * random.standard_normal(truth.shape)


def reference(truth, relative, random, tail="normal"):
    """From sixteen samples a pixel whose channels partly move together."""
    shape = (16, len(truth))

    def draw(*more):
        if tail == "normal":
            return random.standard_normal((*shape, *more))
        return (random.lognormal(0.0, 1.0, (*shape, *more)) - np.exp(0.5)) / np.sqrt((np.e - 1) * np.e)

    samples = 4 * relative * truth * (0.8 * draw(1) + 0.6 * draw(3))
    a, b = truth + samples[::2].mean(0), truth + samples[1::2].mean(0)
    return Noisy((a + b) / 2, samples.std(0, ddof=1) / 4, (a - b) / 2, measured=True)


def mse(picture, truth):
    return float(((picture - truth) ** 2).mean())


def test_without_noise_it_is_the_difference_of_the_mean_squares():
    truth, better, worse = pictures()
    found = difference(quiet(better), quiet(worse), quiet(truth))
    assert found.value == pytest.approx(mse(worse, truth) - mse(better, truth), rel=1e-9)
    assert found.ci95 == pytest.approx((found.value, found.value))


def test_it_is_the_difference_of_the_debiased_mean_squares():
    truth, better, worse = pictures()
    noisy = reference(truth, 0.05, np.random.default_rng(1))
    apart = [debiased_metrics(quiet(p), noisy)["mse"] for p in (better, worse)]
    found = difference(quiet(better), quiet(worse), noisy)
    assert found.value == pytest.approx(apart[1].value - apart[0].value, rel=1e-6)
    widths = [m.ci95[1] - m.ci95[0] for m in (found, *apart)]
    assert widths[0] < 0.2 * min(widths[1:])  # the noise that both share cancels


@pytest.mark.parametrize("tail", ["normal", "lognormal"])
@pytest.mark.parametrize("own", [0.0, 0.05])
def test_intervals_hold_the_truth(tail, own):
    """300 repetitions: the share of a true 95 % interval has a standard deviation of 1.3 %. own: noise of one picture."""
    truth, better, worse = pictures()
    exact, random, hits, values = mse(worse, truth) - mse(better, truth), np.random.default_rng(2), 0, []
    for _ in range(300):
        sigma = own * truth
        drawn = better + sigma * random.standard_normal(truth.shape)
        first = Noisy(drawn, sigma, sigma)
        found = difference(first, quiet(worse), reference(truth, 0.05, random, tail))
        values.append(found.value)
        hits += found.ci95[0] <= exact <= found.ci95[1]
    assert 0.90 <= hits / 300 <= 0.98
    assert abs(np.mean(values) - exact) < 4 * np.std(values) / np.sqrt(300)


def test_order_and_decisions():
    truth, better, worse = pictures()
    worst = worse * 1.5
    noisy = reference(truth, 0.02, np.random.default_rng(3))
    pairs = rank({"worst": quiet(worst), "worse": quiet(worse), "better": quiet(better)}, noisy)
    assert [(p.better, p.worse) for p in pairs] == [("better", "worse"), ("worse", "worst")]
    assert pairs[1].decided and pairs[1].difference.ci95[0] > 0
    loud = rank({"worse": quiet(worse), "better": quiet(better)}, reference(truth, 0.5, np.random.default_rng(3)))
    assert not loud[0].decided and loud[0].difference.ci95[0] < 0 < loud[0].difference.ci95[1]


def test_equal_pictures_are_inconclusive():
    truth, better, _ = pictures()
    noisy = reference(truth, 0.05, np.random.default_rng(4))
    (pair,) = rank({"a": quiet(better), "b": quiet(better.copy())}, noisy)
    assert not pair.decided and pair.difference.value == 0.0 and pair.difference.ci95 == (0.0, 0.0)


def test_more_confidence_decides_less():
    """Between 1.96 and 2.24 standard deviations a pair is decided at 95 %, not at 97.5 %."""
    truth, better, worse = pictures()
    exact = mse(worse, truth) - mse(better, truth)
    noise = np.zeros_like(truth)
    noise[0] = 1.0  # one pixel; made-up noise, so no degrees of freedom widen it
    sigma = abs(float((2 * (worse - better) * noise).sum(-1)[0])) / truth.size
    for units, expected in ((1.9, (False, False)), (2.1, (True, False)), (2.3, (True, True))):
        scaled = noise * exact / units / sigma
        noisy = Noisy(truth, np.abs(scaled), scaled)
        pairs = [rank({"a": quiet(better), "b": quiet(worse)}, noisy, c)[0] for c in (0.95, 0.975)]
        together = (worse - better)[0].sum() ** 2 >= ((worse - better)[0] ** 2).sum()
        assert not together or tuple(p.decided for p in pairs) == expected
