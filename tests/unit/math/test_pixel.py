"""Sub-samples: one a cell, none in line with another along an axis."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math.pixel import subsamples


@pytest.mark.parametrize("s", [1, 2, 3, 4, 8])
def test_subsamples_are_stratified_in_cells_columns_and_rows(s):
    places = np.array(subsamples(s))
    assert len({(int(x * s), int(y * s)) for x, y in places}) == s * s
    for axis in places.T:
        np.testing.assert_allclose(np.sort(axis), (np.arange(s * s) + 0.5) / s**2, atol=1e-12)
    np.testing.assert_allclose(places.mean(0), 0.5, atol=1e-12)


def test_area_beside_an_edge():
    """An edge along an axis to half a sample; at other angles nearly as well as on a regular grid."""
    places, regular = np.array(subsamples(4)), np.stack(np.meshgrid(*2 * [(np.arange(4) + 0.5) / 4]), -1).reshape(-1, 2)
    for offset in np.linspace(0.0, 1.0, 101):
        assert abs((places[:, 0] < offset).mean() - offset) <= 1 / 32 + 1e-9
    random, errors = np.random.default_rng(1), []
    fine = np.stack(np.meshgrid(*2 * [(np.arange(100) + 0.5) / 100]), -1).reshape(-1, 2)
    for angle, offset in zip(random.uniform(0, 2 * np.pi, 2000), random.uniform(-0.5, 0.5, 2000), strict=True):
        normal = np.array([np.cos(angle), np.sin(angle)])
        area = [((p - 0.5) @ normal < offset).mean() for p in (places, regular, fine)]
        errors.append([area[0] - area[2], area[1] - area[2]])
    ours, grid = np.sqrt((np.array(errors) ** 2).mean(0))
    assert ours < 1.15 * grid
