"""Lobes of revolution: spherical-harmonic convolution and the gathering grid, against quadrature and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss, legval

from evalsuite.math import lobe_grid, phong, sh, zonal
from evalsuite.math.sphere import latlong_directions, latlong_lookup, latlong_solid_angles


def noise(height=17, width=32, seed=3):
    return np.random.default_rng(seed).gamma(0.5, size=(height, width, 3))


def directions(count=20, seed=1):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d = np.concatenate([d, [[0, 1, 0], [0, -1, 0], [1e-4, 1, 0], [0, 0, -1]]])
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def quadrature(radiance, exponent, r, finer):
    """Σ over the bilinear map on a finer lat-long grid."""
    height, width = finer * (len(radiance) - 1) + 1, finer * radiance.shape[1]
    d = latlong_directions(height, width)
    weighted = (latlong_lookup(radiance, d) * latlong_solid_angles(height, width)[..., None]).reshape(-1, 3)
    return np.concatenate([phong.phong_lobe(exponent, one[None] @ d.reshape(-1, 3).T) @ weighted for one in r])


@pytest.mark.parametrize("exponent", [1.0, 2.5, 10.0, 500.0])
def test_bands_are_the_lobes_legendre_coefficients(exponent):
    x, w = leggauss(300)
    c, w = 0.5 * (x + 1), 0.5 * w
    bands = zonal.phong_bands(exponent, 40)
    for degree in range(41):
        expected = (exponent + 1) * (w * c**exponent * legval(c, np.eye(41)[degree])).sum()
        assert bands[degree] == pytest.approx(expected, abs=1e-9)


def test_bands_of_the_clamped_cosine_are_those_of_irradiance():
    np.testing.assert_allclose(np.pi * zonal.phong_bands(1.0, 2), sh.COSINE_LOBE[[0, 1, 4]], rtol=1e-14)


@pytest.mark.parametrize("exponent", [10.0, 200.0])
def test_convolution_is_quadrature_of_the_bilinear_map(exponent):
    radiance, r = noise(), directions()
    found = zonal.convolve(radiance, zonal.phong_bands(exponent, zonal.phong_degree(exponent)), r)
    # Steps of δ leave N δ²/6: Richardson's extrapolation takes that away.
    coarse, fine = (quadrature(radiance, exponent, r, finer) for finer in (8, 16))
    expected = (4 * fine - coarse) / 3
    assert np.abs(fine - expected).max() > 1e-4 * expected.mean()
    np.testing.assert_allclose(found, expected, atol=5e-5 * expected.mean())


def test_convolution_of_a_single_row_and_of_a_constant():
    bands = zonal.phong_bands(30.0, zonal.phong_degree(30.0))
    constant = zonal.convolve(np.full((1, 1, 3), 0.7), bands, directions())
    np.testing.assert_allclose(constant, 0.7, rtol=1e-12)
    row = noise(1, 16)
    np.testing.assert_allclose(
        zonal.convolve(row, bands, directions()), zonal.convolve(np.repeat(row, 2, axis=0), bands, directions()), rtol=1e-12
    )


def test_lagrange_weights_are_exact_to_degree_five():
    x = np.linspace(-2, 3, 41)
    first, weights = lobe_grid.lagrange(x)
    nodes = first[:, None] + np.arange(lobe_grid.TAPS)
    np.testing.assert_allclose(weights.sum(-1), 1, rtol=1e-13)
    for power in range(6):
        np.testing.assert_allclose((weights * nodes**power).sum(-1), x**power, atol=1e-10)
    assert np.abs((weights * nodes**6.0).sum(-1) - x**6).max() > 0.1


@pytest.mark.parametrize("shape", [(17, 32), (1, 1), (1, 8), (129, 256), (4, 7)])
def test_gathering_keeps_energy_and_where_it_comes_from(shape):
    radiance, rows = noise(*shape), 48
    power = lobe_grid.gather(radiance, rows)
    assert power.shape == (rows, 2 * rows, 3)
    grid = np.stack(np.meshgrid((np.arange(2 * rows) + 0.5) / (2 * rows), (np.arange(rows) + 0.5) / rows), -1)
    phi, theta = 2 * np.pi * grid[..., 0], np.pi * grid[..., 1]
    nodes = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], -1)
    omega = latlong_solid_angles(*shape)
    np.testing.assert_allclose(power.sum((0, 1)), np.einsum("yxc,yx->c", radiance, omega), rtol=1e-9)
    expected = quadrature_of_moment(radiance)
    np.testing.assert_allclose(np.einsum("yxc,yxk->ck", power, nodes), expected, atol=2e-5 * power.sum())


def quadrature_of_moment(radiance):
    """∫ L l dω over the bilinear map, (C, 3)."""
    finer = -(-400 // len(radiance))
    height = finer * (len(radiance) - 1) + 1 if len(radiance) > 1 else 400
    d = latlong_directions(height, finer * radiance.shape[1])
    omega = latlong_solid_angles(*d.shape[:2])
    return np.einsum("yxck,yx->ck", latlong_lookup(radiance, d)[..., None] * d[..., None, :], omega)


@pytest.mark.parametrize("exponent", [4.0, 50.0, 500.0])
def test_sums_at_the_nodes_are_the_lobe_integral(exponent):
    """Lamps of one texel in the dark, where a coarse source would show."""
    radiance = 0.01 * noise(65, 128)
    radiance[20, 30] = (900.0, 300.0, 50.0)
    radiance[63, 100] = 17.0 * radiance[20, 30]  # as much power, in a smaller texel beside a pole
    rows = lobe_grid.grid_rows(exponent)
    power = lobe_grid.gather(radiance, rows).reshape(-1, 3)
    theta, phi = np.pi * (np.arange(rows) + 0.5) / rows, np.pi * (np.arange(2 * rows) + 0.5) / rows
    nodes = np.stack(np.broadcast_arrays(np.sin(theta)[:, None] * np.sin(phi), np.cos(theta)[:, None],
                                         -np.sin(theta)[:, None] * np.cos(phi)), -1).reshape(-1, 3)  # fmt: skip
    r = directions(200)
    for part, lamp in ((slice(0, 80), (20, 30)), (slice(80, 160), (63, 100))):
        r[part] = latlong_directions(65, 128)[lamp] + r[part] / np.sqrt(exponent)
    r /= np.linalg.norm(r, axis=-1, keepdims=True)
    sums = np.concatenate([phong.phong_lobe(exponent, one[None] @ nodes.T) @ power for one in r])
    truth = zonal.convolve(radiance, zonal.phong_bands(exponent, zonal.phong_degree(exponent)), r)
    assert np.abs(sums - truth).max() < 4e-4 * truth.max()


def test_reach_is_where_the_lobe_ends():
    assert (1 - lobe_grid.reach(500.0)) ** 500 == pytest.approx(1e-5)
    assert lobe_grid.reach(1.0) == pytest.approx(1 - 1e-5) and lobe_grid.reach(10.0) < 1
    assert lobe_grid.grid_rows(500) > lobe_grid.grid_rows(50) >= 64 and lobe_grid.grid_rows(1e4) == 640
