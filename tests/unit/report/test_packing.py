"""Pictures as the page's text: exact to the steps that are stated, and equal where they were equal."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from evalsuite.report import packing

sys.path.insert(0, str(Path(__file__).parent))
from unpacking import unpack


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (6, 1), (13, 9), (12, 8, 3)])
@pytest.mark.parametrize("soft", [0.0, 0.3])
def test_values_come_back_within_half_a_step(shape, soft):
    picture = np.random.default_rng(1).standard_normal(shape) * 10.0 ** np.random.default_rng(2).integers(-3, 4, shape)
    found = unpack(packing.pack(picture, 0.01, soft), *shape[:2])
    assert found.shape == shape
    bound = 0.005 * np.hypot(picture, soft) * 1.01 if soft else 0.005
    assert (np.abs(found - picture) <= bound + 1e-6 * np.abs(picture)).all()


def test_what_is_not_finite():
    picture = np.ones((3, 4, 3))
    picture[1, 2, 0], picture[0, 0, 1], picture[2, 3, 2] = np.nan, np.inf, -np.inf
    with np.errstate(over="ignore"):
        found = unpack(packing.pack(picture, 2.0**-9, 0.1), 3, 4)
    assert np.isnan(found[1, 2, 0]) and np.isnan(found).sum() == 1
    assert found[0, 0, 1] > 1e30 and found[2, 3, 2] < -1e30
    np.testing.assert_allclose(found[2, :3], 1.0, rtol=2e-3)


def test_equal_pixels_stay_equal():
    """A background that both renderers have alike has no error in the page either."""
    reference = np.random.default_rng(0).random((16, 16, 3)) + 0.1
    image = np.where(np.arange(16)[:, None, None] < 8, reference, reference * 1.03)
    step, soft = packing.fineness(reference, 0.01 * reference)
    a, b = (unpack(packing.pack(p, step, soft), 16, 16) for p in (image, reference))
    assert (a[:8] == b[:8]).all() and (a[8:] > b[8:]).all()


def test_steps_follow_the_noise():
    reference = np.full((32, 32, 3), 2.0)
    step, soft = packing.fineness(reference, 0.05 * reference)
    assert 0.5 * packing.COARSEST < step <= packing.COARSEST and soft == pytest.approx(2e-3)
    step, _ = packing.fineness(reference, 0.002 * reference)
    assert step == pytest.approx(packing.PART * 0.002, rel=0.01)
    assert packing.fineness(reference, None)[0] == packing.fineness(reference, 0 * reference)[0] == packing.FINEST
    noisy = np.where(np.arange(32)[:, None, None] < 16, 0.002, 1e-5) * reference
    mask = np.broadcast_to(np.arange(32)[:, None] < 16, (32, 32))
    assert packing.fineness(reference, noisy, mask)[0] > 10 * packing.fineness(reference, noisy)[0]


def test_smooth_pictures_cost_little():
    y, x = np.mgrid[:256, :256] / 255
    smooth = np.stack([np.sin(3 * x + c) + 2 + y for c in range(3)], -1)
    assert len(packing.pack(smooth, 1e-3, 1e-3)["data"]) < 0.15 * smooth.size * 2, "a seventh of half floats"
