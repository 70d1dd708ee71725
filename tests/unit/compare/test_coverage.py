"""Do the 95 % intervals hold the truth 95 % of the time? Synthetic references of known mean and noise."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from evalsuite.compare import compare
from evalsuite.compare.comparison import debiased_metrics
from evalsuite.compare.metrics import squared_error
from evalsuite.compare.statistics import Noisy, debiased

DEBIASED = ("mse", "rmse", "relmse", "rel_rmse", "bias", "rel_bias")
NOISY = ("mae", "smape", "ssim", "flip", "flip_hdr", "delta_e2000", "max_abs", "p99_abs", "psnr")


def truth(size=48, seed=0):
    """A smooth, lit scene (H, W, 3) in [0.2, 1.2] and a smooth error of about 3 % of it, coloured."""
    rng = np.random.default_rng(seed)
    smooth = gaussian_filter(rng.random((size, size, 3)), (6, 6, 0), mode="wrap")
    reference = 0.2 + (smooth - smooth.min()) / np.ptp(smooth)
    error = gaussian_filter(rng.standard_normal((size, size, 3)), (4, 4, 0), mode="wrap")
    return reference, 0.03 * error / error.std() * reference


def estimate(rng, mean, relative, kind):
    """(half A, half B, per-pixel standard error of their mean, its skew). Samples as a renderer has them: the standard error is
    estimated from the samples themselves, so it is noisy and goes with the error where samples are skewed."""
    shape = mean.shape[:2] + ((3,) if kind == "white" else (1,))
    if kind in ("gamma", "poisson"):  # radiance that is exponential, or a lamp that few samples find: eight passes of n samples
        n = np.broadcast_to(1 / (8 * np.square(relative)), shape)
        draw = rng.gamma if kind == "gamma" else rng.poisson
        passes = mean * np.stack([draw(n) / n for _ in range(8)])
        return passes[::2].mean(axis=0), passes[1::2].mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(8), skew_of_mean(passes)
    count = 32  # samples in all; each half has 16
    if kind == "exponential":
        samples = rng.exponential(1.0, (count, *shape)) - 1.0
    else:
        samples = rng.standard_normal((count, *shape))
    scale = relative * mean * np.sqrt(count)
    halves = [mean + scale * samples[i::2].mean(axis=0) for i in (0, 1)]
    return *halves, scale * samples.std(axis=0, ddof=1) / np.sqrt(count), scale * skew_of_mean(samples)


def skew_of_mean(samples):
    """Cube root of the third k-statistic of the mean of n samples: n² m₃ / ((n − 1)(n − 2)) / n²."""
    n = len(samples)
    return np.cbrt(((samples - samples.mean(axis=0)) ** 3).mean(axis=0) / ((n - 1) * (n - 2)))


def coverage(kind, relative, repetitions, error_scale=1.0, image_noise=0.0, with_halves=True, size=48):
    """Share of the repetitions in which each metric's interval holds its value on noise-free pictures."""
    mean, error = truth(size)
    rng = np.random.default_rng(7)
    mask = np.hypot(*(np.indices(mean.shape[:2]) - size / 2)) < 0.45 * size
    exact = compare(mean + error_scale * error, mean, mask=mask).metrics
    hits = Counter()
    for _ in range(repetitions):
        a, b, sigma, skew = estimate(rng, mean, relative, kind)
        image, image_sigma = mean + error_scale * error, None
        if image_noise:
            first, second, image_sigma, _ = estimate(rng, image, image_noise, kind)
            image = (first + second) / 2
        got = compare(image, (a + b) / 2, sigma, (a, b) if with_halves else None, mask, image_sigma, skew).metrics
        for name, metric in got.items():
            lo, hi = metric.ci95
            hits[name] += lo - 1e-12 <= exact[name].value <= hi + 1e-12
    return {name: hits[name] / repetitions for name in exact}


@pytest.mark.parametrize("kind", ["white", "grey", "gamma", "poisson"])
@pytest.mark.parametrize(
    ("relative", "error_scale", "uneven"),
    [(0.03, 1.0, 1.0), (0.03, 0.0, 1.0), (0.08, 1.0, 1.0), (0.08, 0.0, 1.0), (0.015, 1.0, 5.0)],
)
def test_debiased_intervals_hold_the_truth(kind, relative, error_scale, uneven):
    """The share of a true 95 % interval has a standard deviation of 0.8 %. error_scale 0: nothing but noise. uneven: the noise
    of every fiftieth pixel over its neighbours'."""
    shares = debiased_coverage(kind, relative, error_scale, uneven, 800)
    assert set(shares) == set(DEBIASED)
    for name in DEBIASED:
        assert 0.90 <= shares[name] <= 0.98, (name, shares[name])


def test_without_its_skewness_skewed_noise_is_taken_for_error():
    with_it, without = (debiased_coverage("exponential", 0.03, 0.0, 1.0, 200, skewed, 48)["relmse"] for skewed in (True, False))
    assert without < 0.90 <= with_it


def debiased_coverage(kind, relative, error_scale, uneven, repetitions, with_skew=True, size=24):
    """Share of the repetitions in which each debiased metric's interval holds its value on noise-free pictures."""
    mean, error = truth(size)
    rng, hits = np.random.default_rng(11), Counter()
    noise = relative * np.where(rng.random(mean.shape[:2])[..., None] < 0.02, uneven, 1.0) if uneven > 1 else relative
    image = (mean + error_scale * error).reshape(-1, 3)
    exact = debiased_metrics(quiet(image), quiet(mean.reshape(-1, 3)))
    for _ in range(repetitions):
        drawn = estimate(rng, mean, noise, kind)
        a, b, sigma, skew = (np.broadcast_to(picture, mean.shape).reshape(-1, 3) for picture in drawn)
        reference = Noisy((a + b) / 2, sigma, (a - b) / 2, True, skew if with_skew else None)
        for name, metric in debiased_metrics(quiet(image), reference).items():
            hits[name] += metric.ci95[0] <= exact[name].value <= metric.ci95[1]
    return {name: count / repetitions for name, count in hits.items()}


@pytest.mark.parametrize("with_skew", [True, False])
def test_a_quadratic_error_has_no_third_order(with_skew):
    """What is left out for it changes nothing."""
    mean, error = truth(24)
    a, b, sigma, skew = (p.reshape(-1, 3) for p in estimate(np.random.default_rng(3), mean, 0.1, "exponential"))
    reference = Noisy((a + b) / 2, np.broadcast_to(sigma, a.shape), (a - b) / 2, True, skew if with_skew else None)
    image = quiet((mean + 0.1 * error).reshape(-1, 3))
    found, whole = (debiased(squared_error, image, reference, quadratic=q) for q in (True, False))
    assert (found.value, *found.ci95) == pytest.approx((whole.value, *whole.ci95), rel=1e-9) and found.value > 0


def quiet(picture):
    return Noisy(picture, np.zeros_like(picture), np.zeros_like(picture))


@pytest.mark.parametrize("kind", ["grey", "exponential"])
def test_intervals_hold_the_truth(kind):
    """200 repetitions: the share of a true 95 % interval has a standard deviation of 1.5 %."""
    shares = coverage(kind, 0.03, 200)
    for name in DEBIASED:
        assert 0.90 <= shares[name] <= 0.98, (name, shares[name])
    for name in NOISY:
        assert shares[name] >= 0.90, (name, shares[name])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "relative", "options"),
    [
        ("white", 0.03, {}),
        ("grey", 0.002, {}),
        ("exponential", 0.01, {}),
        ("grey", 0.1, {}),
        ("exponential", 0.1, {}),
        ("grey", 0.03, {"error_scale": 0.0}),
        ("exponential", 0.03, {"error_scale": 0.0}),
        ("grey", 0.03, {"image_noise": 0.03}),
        ("exponential", 0.03, {"image_noise": 0.03, "error_scale": 0.0}),
        ("grey", 0.03, {"with_halves": False}),
    ],
)
def test_intervals_hold_the_truth_elsewhere(kind, relative, options):
    """Much and little noise, none but noise, noise of the image too, no halves: nowhere does an interval promise too much
    (0.87 is 0.95 less five standard deviations, for 17 metrics and 10 settings at once)."""
    shares = coverage(kind, relative, 200, **options)
    assert min(shares.values()) >= 0.87, {name: share for name, share in shares.items() if share < 0.9}
