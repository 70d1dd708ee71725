"""Sphere maps against closed forms and round trips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from evalsuite.math import sh, sphere_map

unit = st.floats(-1, 1, allow_nan=False)
SIZE = 177


def _smooth(directions):
    coefficients = np.random.default_rng(8).normal(size=(9, 2)) * 0.2
    coefficients[0] = 3.0
    return sh.basis(directions) @ coefficients


@given(unit, unit, unit)
def test_direction_to_point_and_back(x, y, z):
    length = np.sqrt(x * x + y * y + z * z)
    assume(length > 1e-3)
    d = np.array([x, y, z]) / length
    px, py = sphere_map.direction_to_disc([x, y, z])
    assert np.hypot(px, py) <= 1 + 1e-14
    # Near the rim the radius says little about the direction: √ε.
    np.testing.assert_allclose(sphere_map.disc_to_direction(px, py), d, atol=5e-8)


def test_the_point_is_the_xy_of_the_halfway_vector():
    d = np.random.default_rng(2).normal(size=(100, 3))
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    h = d + np.array([0, 0, 1])
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    np.testing.assert_allclose(np.stack(sphere_map.direction_to_disc(d), -1), h[:, :2], atol=1e-12)


def test_the_rim_is_one_direction_and_the_centre_the_viewer():
    phi = np.linspace(0, 6, 20)
    rim = sphere_map.disc_to_direction(np.cos(phi), np.sin(phi))
    np.testing.assert_allclose(rim, np.broadcast_to([0, 0, -1], rim.shape), atol=1e-7)
    np.testing.assert_array_equal(sphere_map.disc_to_direction(0, 0), [0, 0, 1])
    np.testing.assert_allclose(sphere_map.direction_to_disc([0, 0, -1]), [0, -1])
    np.testing.assert_allclose(sphere_map.disc_to_direction(2.0, 3.0), [0, 0, -1])


def test_frames_are_rotations_with_v0_last():
    for view in ([0, 0, 1], [0.3, -2, 1], [0, 5, 0], [0, -1, 0]):
        m = sphere_map.frame(view)
        np.testing.assert_allclose(m.T @ m, np.eye(3), atol=1e-14)
        assert np.linalg.det(m) == pytest.approx(1)
        np.testing.assert_allclose(m[:, 2], np.array(view) / np.linalg.norm(view))
        assert m[1, 1] >= 0
    np.testing.assert_array_equal(sphere_map.frame([0, 0, 1]), np.eye(3))


@pytest.mark.parametrize(("size", "border"), [(1, 0.0), (7, 0.0), (64, 2.5), (500, 2.0)])
def test_solid_angles_sum_to_the_sphere_and_are_equal_inside(size, border):
    omega = sphere_map.texel_solid_angles(size, border)
    assert omega.sum() == pytest.approx(4 * np.pi, rel=1e-13)
    whole = omega[omega > 0.999 * omega.max()]
    assert size < 60 or len(whole) > 0.6 * omega.size
    np.testing.assert_allclose(omega.max(), 4 / (size / 2 - border) ** 2 if size > 1 else 4 * np.pi, rtol=1e-9)


def test_solid_angles_of_cut_texels_against_quadrature():
    size, border, k = 6, 0.4, 300
    x = (np.arange(size * k) + 0.5 - 0.5 * size * k) / k / (0.5 * size - border)
    step = 1.0 / k / (0.5 * size - border)
    density = np.where(x[None, :] ** 2 + x[:, None] ** 2 <= 1, 4.0, 0.0) * step**2
    expected = density.reshape(size, k, size, k).sum((1, 3))
    np.testing.assert_allclose(sphere_map.texel_solid_angles(size, border), expected, atol=5e-4)


def test_sampling_along_the_radius_goes_to_zero_towards_minus_v0():
    radius = sphere_map.matched_radius(64)
    theta = np.radians([0.0, 60, 120, 170, 179])
    step = 1e-6
    d = [np.stack([np.sin(t), 0 * t, np.cos(t)], -1) for t in (theta, theta + step)]
    rate = (sphere_map.direction_to_disc(d[1])[0] - sphere_map.direction_to_disc(d[0])[0]) / step * radius
    np.testing.assert_allclose(rate, 0.5 * np.cos(theta / 2) * radius, rtol=1e-3)  # texels per radian


def test_resampling_keeps_energy_and_is_worst_at_minus_v0():
    border = 1.0
    counts = sphere_map.subsamples(SIZE, border, np.radians(0.7))
    assert counts[SIZE // 2, SIZE // 2] == 3 and counts[SIZE // 2, 1] > 12
    texels = sphere_map.resample(_smooth, SIZE, border, counts)
    np.testing.assert_allclose(sphere_map.integral(texels, border), np.sqrt(4 * np.pi) * np.array([3, 3]), rtol=1e-4)
    d = np.random.default_rng(3).normal(size=(200000, 3))
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    error = np.abs(sphere_map.map_lookup(texels, border, d) / _smooth(d) - 1).max(-1)
    angle = np.degrees(np.arccos(-d[:, 2]))  # to −v₀
    assert error[angle > 30].max() < 2e-3
    assert error[angle < 5].max() > 10 * error[angle > 30].max()


def test_a_constant_map_stays_constant():
    texels = sphere_map.resample(lambda d: np.full((*d.shape[:-1], 1), 2.5), 16, 1.0, np.full((16, 16), 3))
    np.testing.assert_allclose(texels, 2.5, rtol=1e-14)
