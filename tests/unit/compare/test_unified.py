"""Intervals of a quantity that cannot be negative, against the published table."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.compare.unified import nonnegative_interval


@pytest.mark.parametrize(
    ("x", "lower", "upper"),
    # Feldman and Cousins 1998, table X, 95 % confidence level.
    [(-3, 0, 0.42), (-2, 0, 0.62), (-1, 0, 1.10), (0, 0, 1.96), (1, 0, 2.96), (2, 0.35, 3.96), (3, 1.14, 4.96)],
)
def test_published_table(x, lower, upper):
    assert nonnegative_interval(x, 1.0) == pytest.approx((lower, upper), abs=0.006)
    assert nonnegative_interval(x * 1e-7, 1e-7) == pytest.approx((lower * 1e-7, upper * 1e-7), abs=0.006e-7)


@pytest.mark.parametrize("true", [0.0, 0.1, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0])
def test_holds_every_true_value(true):
    estimates = np.random.default_rng(1).normal(true, 1.0, 20_000)
    held = np.mean([lo <= true <= hi for lo, hi in (nonnegative_interval(x, 1.0) for x in estimates)])
    assert held == pytest.approx(0.95, abs=0.006)  # four standard deviations


def test_far_from_zero_and_without_noise():
    assert nonnegative_interval(10.0, 1.0) == pytest.approx((10 - 1.959964, 10 + 1.959964), abs=1e-6)
    assert nonnegative_interval(2.0, 0.0) == (2.0, 2.0) and nonnegative_interval(-2.0, 0.0) == (0.0, 0.0)
    lower, upper = nonnegative_interval(-1e6, 1.0)
    assert lower == 0.0 and 0.0 < upper < 0.01


def test_ends_rise_with_the_estimate():
    ends = np.array([nonnegative_interval(x, 1.0) for x in np.linspace(-6, 8, 2000)])
    assert (np.diff(ends, axis=0) >= -1e-9).all()
