"""The exact lobe integral in any direction: constant maps, a lamp, plain sums, poles and the seam."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import lobe_field, zonal
from evalsuite.math.phong import phong_lobe
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles


def directions(count: int = 400) -> np.ndarray:
    d = np.random.default_rng(0).normal(size=(count, 3))
    d[:5] = [[0, 1, 0], [0, -1, 0], [1e-3, 1, 1e-3], [-1e-3, 0.2, -1], [1e-3, 0.2, -1]]
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@pytest.mark.parametrize("exponent", [1.0, 7.0, 300.0])
def test_a_constant_map_stays(exponent):
    found = lobe_field.phong(np.full((17, 32, 3), [1.0, 2.0, 0.5]), exponent)(directions())
    np.testing.assert_allclose(found, np.broadcast_to([1.0, 2.0, 0.5], found.shape), rtol=1e-6)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 20.0, 500.0])
def test_between_the_nodes_it_is_the_harmonic_sum(exponent):
    radiance = np.zeros((64, 128, 3))
    radiance[20, 100], radiance[1, 5] = 1.0, 0.5
    field = lobe_field.phong(radiance, exponent)
    degree = max(zonal.phong_degree(exponent), 600 if exponent < 4 else 0)
    exact = zonal.convolve(radiance, zonal.phong_bands(exponent, degree), directions())
    assert np.abs(field(directions()) - exact).max() < lobe_field.TOLERANCE * field.largest.max()
    assert exact.max() > 0.1 * field.largest.max()


def test_it_is_the_plain_sum_over_a_smooth_map():
    random = np.random.default_rng(1)
    d = latlong_directions(256, 512)
    radiance = 1.5 + np.sin(d @ random.normal(size=(3, 3)) * 2.0)
    weighted = (radiance * latlong_solid_angles(256, 512)[..., None]).reshape(-1, 3)
    at = directions(40)
    plain = phong_lobe(12.0, at @ d.reshape(-1, 3).T) @ weighted
    np.testing.assert_allclose(lobe_field.phong(radiance, 12.0)(at), plain, rtol=2e-4)


def test_the_grid_is_the_same_as_single_directions():
    radiance = np.random.default_rng(2).random((9, 16, 3))
    bands = zonal.phong_bands(6.0, 40)
    rows = 13
    theta, phi = np.linspace(0, np.pi, rows)[:, None], np.arange(24)[None] * 2 * np.pi / 24
    at = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi, -np.sin(theta) * np.cos(phi)], -1)
    single = zonal.convolve(radiance, bands, at.reshape(-1, 3)).reshape(rows, 24, 3)
    np.testing.assert_allclose(zonal.convolve_grid(radiance, bands, rows), single, atol=1e-12)
