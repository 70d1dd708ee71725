"""An error split by cause: exact closure, no bias from noise, intervals that hold."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.compare.chain import Step, split
from evalsuite.errors import EvalsuiteError


def truths(seed=0, pixels=400):
    """Noise-free pictures of a chain of four, (P, 3) each."""
    random = np.random.default_rng(seed)
    first = random.gamma(4.0, 0.2, (pixels, 3))
    return [
        first,
        *(first + scale * random.normal(size=first.shape) + shift for scale, shift in ((0.02, 0.0), (0.1, 0.05), (0.0, 0.05))),
    ]


def measured(truth, sigma, random):
    """A reference with noise of standard error σ, its channels moving together by half."""
    halves = []
    for _ in range(2):
        common, own = random.normal(size=(len(truth), 1)), random.normal(size=truth.shape)
        halves.append(truth + np.sqrt(2) * sigma * (0.7071 * common + 0.7071 * own))
    return Step.of((halves[0], halves[1]), np.full(truth.shape, sigma))


def test_without_noise_shares_are_inner_products():
    pictures = truths()
    quiet = [Step.of((p, p), np.zeros_like(p)) for p in pictures[:-1]]
    found = split([*quiet, Step.drawn(pictures[-1])])
    error = pictures[-1] - pictures[0]
    assert found.total == pytest.approx((error**2).mean())
    for k, rung in enumerate(found.rungs):
        difference = pictures[k + 1] - pictures[k]
        assert rung.share.value == pytest.approx((difference * error).mean(), abs=1e-15)
        assert rung.share.ci95 == pytest.approx((rung.share.value,) * 2)
        assert rung.rel_rmse.value == pytest.approx(np.sqrt((difference**2).mean()) / pictures[0].mean())
        assert rung.rel_bias.value == pytest.approx(difference.mean() / pictures[0].mean())
    assert sum(rung.fraction for rung in found.rungs) == pytest.approx(1.0)


@pytest.mark.parametrize("own_noise", [0.0, 0.02])
def test_shares_close_under_noise(own_noise):
    random, pictures = np.random.default_rng(1), truths()
    references = [measured(p, 0.05, random) for p in pictures[:-1]]
    image = pictures[-1] + own_noise * random.normal(size=pictures[-1].shape)
    found = split([*references, Step.drawn(image, np.full(image.shape, own_noise))])
    assert found.closure < 1e-12 and sum(r.share.value for r in found.rungs) == pytest.approx(found.total, rel=1e-12)


@pytest.mark.parametrize("own_noise", [0.0, 0.03])
def test_intervals_hold_the_truth_and_shares_have_no_bias(own_noise):
    pictures, repetitions, sigma = truths(2), 300, 0.06
    exact = split([*(Step.of((p, p), np.zeros_like(p)) for p in pictures[:-1]), Step.drawn(pictures[-1])])
    inside, values = np.zeros((3, 3)), []
    for seed in range(repetitions):
        random = np.random.default_rng(1000 + seed)
        references = [measured(p, sigma, random) for p in pictures[:-1]]
        image = pictures[-1] + own_noise * random.normal(size=pictures[-1].shape)
        found = split([*references, Step.drawn(image, np.full(image.shape, own_noise))])
        values.append([r.share.value for r in found.rungs])
        for k, (rung, true) in enumerate(zip(found.rungs, exact.rungs, strict=True)):
            for m, name in enumerate(("share", "rel_rmse", "rel_bias")):
                lo, hi = getattr(rung, name).ci95
                inside[k, m] += lo <= getattr(true, name).value <= hi
    # The image's own noise has no halves, and its channels are taken to move wholly together or not at all, whichever is worse.
    most = 0.98 if own_noise == 0 else 0.99
    assert ((inside / repetitions >= 0.9) & (inside / repetitions <= most)).all(), inside / repetitions
    spread = np.std(values, axis=0)
    bias = np.mean(values, axis=0) - [r.share.value for r in exact.rungs]
    assert (np.abs(bias) < 4.0 * spread / np.sqrt(repetitions)).all()


def test_a_rung_of_noise_alone_contains_zero():
    random, pictures, inside = np.random.default_rng(3), truths(), np.zeros(2)
    for _ in range(300):
        same = [measured(pictures[0], 0.05, random) for _ in range(2)]
        rung = split([*same, Step.drawn(pictures[-1])]).rungs[0]
        inside += rung.share.ci95[0] < 0.0 < rung.share.ci95[1], rung.rel_rmse.ci95[0] == 0.0
    assert ((inside / 300 >= 0.9) & (inside / 300 <= 0.98)).all(), inside / 300


def test_full_truth_needs_halves():
    picture = np.ones((4, 3))
    with pytest.raises(EvalsuiteError, match="halves"):
        split([Step.drawn(picture), Step.drawn(picture)])


def test_references_of_the_same_random_numbers():
    """Targets of one seed share most of their noise: no share may be biased by it, and intervals know how little it matters."""
    pictures, repetitions, sigma = truths(4), 300, 0.06
    exact = split([*(Step.of((p, p), np.zeros_like(p)) for p in pictures[:-1]), Step.drawn(pictures[-1])])
    inside, values, widths = np.zeros((3, 3)), [], []
    for seed in range(repetitions):
        random = np.random.default_rng(5000 + seed)
        common = measured(np.zeros_like(pictures[0]), 0.9 * sigma, random)
        references = []
        for p in pictures[:-1]:
            own = measured(p, np.sqrt(1 - 0.9**2) * sigma, random)
            halves = [own.mean + sign * own.noise + common.mean + sign * common.noise for sign in (1, -1)]
            references.append(Step.of(halves, np.full(p.shape, sigma)))
        found = split([*references, Step.drawn(pictures[-1])])
        values.append([r.share.value for r in found.rungs])
        widths.append([r.rel_bias.ci95[1] - r.rel_bias.ci95[0] for r in found.rungs])
        for k, (rung, true) in enumerate(zip(found.rungs, exact.rungs, strict=True)):
            for m, name in enumerate(("share", "rel_rmse", "rel_bias")):
                lo, hi = getattr(rung, name).ci95
                inside[k, m] += lo <= getattr(true, name).value <= hi
    assert ((inside / repetitions >= 0.9) & (inside / repetitions <= 0.98)).all(), inside / repetitions
    bias = np.mean(values, axis=0) - [r.share.value for r in exact.rungs]
    assert (np.abs(bias) < 4.0 * np.std(values, axis=0) / np.sqrt(repetitions)).all()
    assert np.mean(widths, axis=0)[0] < 0.7 * np.mean(widths, axis=0)[2]  # between two such references, and one and the image
