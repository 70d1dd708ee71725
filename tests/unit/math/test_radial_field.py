"""A tabulated lobe's integral over a map against sums over the lobe, and the map's mean under it."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import isotropic_map, lobe_field, radial_lobe
from evalsuite.math.prefilter import frame
from evalsuite.math.sphere import latlong_directions, latlong_lookup

LOBES = {
    "split sum, α = 0.16": radial_lobe.ggx_at_normal_incidence(0.16),
    "split sum, α = 1": radial_lobe.ggx_at_normal_incidence(1.0),
    "round lobe at n·r = 0.08, α = 0.3": isotropic_map.fit("ggx", 0.3, 8, 1, "inside")[0][2].shape,
}


def rough(height=33, width=64):
    return np.random.default_rng(5).gamma(0.5, size=(height, width, 3))


@pytest.mark.parametrize("name", LOBES)
def test_it_is_the_sum_over_the_lobe(name):
    lobe, radiance, axes = LOBES[name], rough(), np.random.default_rng(2).normal(size=(12, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    psi, chi = np.pi * ((np.arange(900) + 0.5) / 900) ** 2, 2 * np.pi * (np.arange(180) + 0.5) / 180
    area = lobe(2 * np.sin(psi / 2)) * np.sin(psi) * np.sqrt(psi)
    expected = []
    for axis in axes:
        x, y = frame(axis)
        around = np.cos(chi)[:, None] * x + np.sin(chi)[:, None] * y
        rings = latlong_lookup(radiance, np.sin(psi)[:, None, None] * around + np.cos(psi)[:, None, None] * axis).mean(1)
        expected.append(area @ rings / area.sum())
    found = lobe_field.radial(radiance, [lobe, LOBES["split sum, α = 1"]])[0](axes)
    assert np.sqrt(((found - expected) ** 2).mean()) < lobe_field.RADIAL_TOLERANCE * np.mean(expected)


@pytest.mark.parametrize("name", LOBES)
def test_a_constant_map_stays_constant(name):
    (field,) = lobe_field.radial(np.full((9, 16, 3), 0.7), [LOBES[name]])
    np.testing.assert_allclose(field(latlong_directions(7, 12).reshape(-1, 3)), 0.7, rtol=1e-5)
