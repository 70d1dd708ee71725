"""Dual paraboloid maps against closed forms, quadrature and round trips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from evalsuite.math import paraboloid as pb
from evalsuite.math import sh
from evalsuite.math.disc_map import centres

unit = st.floats(-1, 1, allow_nan=False)
DIRECTIONS = np.random.default_rng(3).normal(size=(2000, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=-1, keepdims=True)


@given(unit, unit, unit)
def test_direction_to_point_and_back(x, y, z):
    length = np.sqrt(x * x + y * y + z * z)
    assume(length > 1e-3)
    half, px, py = pb.direction_to_paraboloid([x, y, z])
    assert half == (pb.FRONT if z >= 0 else pb.BACK) and np.hypot(px, py) <= 1 + 1e-15
    np.testing.assert_allclose(pb.paraboloid_to_direction(half, px, py), np.array([x, y, z]) / length, atol=1e-14)


@given(st.integers(0, 1), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_point_to_direction_and_back_beyond_the_circle_too(half, x, y):
    d = pb.paraboloid_to_direction(half, x, y)
    _, px, py = pb.direction_to_paraboloid(d, half)
    np.testing.assert_allclose([px, py], [x, y], atol=1e-13)
    other, qx, qy = pb.direction_to_paraboloid(d)
    if np.hypot(x, y) > 1 + 1e-9:  # the other map holds it at the inverted point
        assert other == 1 - half
        np.testing.assert_allclose([qx, qy], np.array([x, y]) / (x * x + y * y), atol=1e-13)


def test_the_paraboloid_is_that_of_equation_1():
    """Reflecting the viewing ray at the point (x, y, ½ − ½(x² + y²)) gives the point's own direction from the focus."""
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 50))
    point = np.stack([x, y, 0.5 - 0.5 * (x * x + y * y)], -1)
    np.testing.assert_allclose(pb.paraboloid_to_direction(pb.FRONT, x, y), point / np.linalg.norm(point, axis=-1)[:, None])


@pytest.mark.parametrize("half", [pb.FRONT, pb.BACK])
@pytest.mark.parametrize("border", [0.0, 3.0])
def test_matrices_send_a_direction_to_its_texel_and_back(half, border):
    size = 64
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    matrix = pb.texture_matrix(half, size, border, turn)
    row, column = np.mgrid[0:size, 0:size]
    c = centres(size, border)
    world = pb.texel_directions(size, border)[half] @ turn.T
    q = np.concatenate([world, np.ones((size, size, 1))], -1) @ matrix.T
    texel = q[..., :2] / q[..., 3:] * size - 0.5
    np.testing.assert_allclose(texel, np.stack([column, row], -1), atol=1e-9)
    assert q[..., 3].min() > 0
    np.testing.assert_allclose(np.hypot(c[None, :], c[:, None]) <= 1, ((world @ turn)[..., 2] * (1 - 2 * half)) >= -1e-12)


def test_the_printed_matrix_fails_the_round_trip():
    """Eq 11 as printed forms d₀ − r; with the course notes' d₀ = (0, 0, 1) that is not the paraboloid's normal (Eq 8)."""
    printed = np.diag([-1.0, -1.0, -1.0, 1.0])
    printed[2, 3] = 1.0
    r = pb.paraboloid_to_direction(pb.FRONT, 0.3, -0.2)
    for s, good in ((pb.matrix_s(pb.FRONT), True), (printed, False)):
        x, y, _, q = pb.P @ s @ [*r, 1.0]
        assert np.allclose([x / q, y / q], [0.3, -0.2]) == good
    # In the 1998 paper's own convention, d₀ = (0, 0, −1) towards the paraboloid, the difference is right.
    printed[2, 3] = -1.0
    x, y, _, q = pb.P @ printed @ [*r, 1.0]
    np.testing.assert_allclose([x / q, y / q], [0.3, -0.2])


@pytest.mark.parametrize(("size", "border"), [(1, 0.0), (2, 0.0), (7, 0.0), (64, 2.5), (512, 64.0)])
def test_solid_angles_sum_to_the_sphere(size, border):
    omega = pb.texel_solid_angles(size, border)
    assert 2 * omega.sum() == pytest.approx(4 * np.pi, rel=1e-13) and omega.min() >= 0
    np.testing.assert_allclose(omega, omega.T, atol=1e-15)
    np.testing.assert_allclose(omega, omega[::-1], atol=1e-15)


def test_solid_angles_of_cut_texels_against_quadrature():
    size, border, k = 6, 0.4, 300
    x = (np.arange(size * k) + 0.5 - 0.5 * size * k) / k / (0.5 * size - border)
    rho2 = x[None, :] ** 2 + x[:, None] ** 2
    step = 1.0 / k / (0.5 * size - border)
    for inside in (True, False):
        density = np.where((rho2 <= 1) | (not inside), 4 / (1 + rho2) ** 2, 0) * step**2
        expected = density.reshape(size, k, size, k).sum((1, 3))
        np.testing.assert_allclose(pb.texel_solid_angles(size, border, inside), expected, atol=5e-4 if inside else 1e-6)


def test_solid_angle_of_texels_varies_by_4():
    omega = pb.texel_solid_angles(1024, inside=False)
    # 4/(1 + ρ²)²: 4 at the centre, 1 on the rim, where the axis meets it.
    assert omega[512, 512] / omega[512, 1023] == pytest.approx(4, rel=0.005)
    f = np.array([0.6, 0.3, 0.5 - 0.5 * (0.36 + 0.09)])
    row, column = int((0.3 + 1) * 512), int((0.6 + 1) * 512)
    assert omega[512, 512] / omega[row, column] == pytest.approx(4 * f @ f, rel=0.005)  # Eq 3


def _smooth(directions):
    coefficients = np.random.default_rng(8).normal(size=(9, 2)) * 0.2
    coefficients[0] = 3.0
    return sh.basis(directions) @ coefficients


def test_resampling_keeps_energy_and_is_read_back():
    maps = pb.resample(_smooth, 128, pb.matched_border(128), 2)
    whole = pb.integral(maps, pb.matched_border(128))
    np.testing.assert_allclose(whole, np.sqrt(4 * np.pi) * np.array([3.0, 3.0]), rtol=1e-4)
    read = pb.DualParaboloid([maps], pb.matched_border(128)).bilinear(DIRECTIONS)
    np.testing.assert_allclose(read, _smooth(DIRECTIONS), rtol=2e-3)


def test_matched_texel_counts():
    size = 512
    inside = np.hypot(*np.meshgrid(centres(size, pb.matched_border(size)), centres(size, pb.matched_border(size)))) <= 1
    assert 2 * inside.sum() == pytest.approx(6 * 256**2, rel=2e-3)
    assert pb.matched_border(32) == 2


def test_mip_chains():
    border = 6.0
    maps = pb.resample(_smooth, 128, border, 2)
    box, weighted = pb.box_mips(maps), pb.weighted_mips(maps, border)
    assert [level.shape[1] for level in weighted] == [128 >> k for k in range(8)]
    np.testing.assert_allclose(pb.box_mips(np.ones((2, 8, 8, 1)))[2], 1)
    np.testing.assert_allclose(pb.weighted_mips(np.ones((2, 8, 8, 1)), 1.0)[-1], 1)
    # A level weighted by solid angle is the map resampled at that size; the plain box is not.
    for level in (2, 4):
        size = 128 >> level
        direct = pb.resample(_smooth, size, border / 2**level, 2 << level)
        np.testing.assert_allclose(weighted[level], direct, rtol=1e-4)
        assert np.abs(box[level] / direct - 1).max() > 10 * np.abs(weighted[level] / direct - 1).max()


def test_seams_close_on_every_level_that_has_a_border():
    border, phi = 16.0, np.linspace(0, 2 * np.pi, 200)
    maps = pb.resample(_smooth, 256, border, 2)
    rim = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], -1)
    with_border = pb.DualParaboloid(pb.weighted_mips(maps, border), border)
    inside = np.hypot(*np.meshgrid(centres(256, border), centres(256, border))) <= 1
    black = pb.DualParaboloid(pb.box_mips(np.where(inside[..., None], maps, 0.0)), border)
    for level in range(5):  # border of 16 … 1 texels

        def step(chain, level=level):
            front, back = (chain.bilinear(rim, level, half) for half in (pb.FRONT, pb.BACK))
            return np.abs(front / back - 1).max()

        # Both maps hold a texel's mean; on level 4 a texel spans 8° and bends the map by 1 %.
        assert step(with_border) < 0.01
        assert (black.bilinear(rim, level, pb.FRONT) / with_border.bilinear(rim, level) < 0.9).any()
