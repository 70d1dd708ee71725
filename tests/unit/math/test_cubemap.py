"""Cubemap geometry against closed forms and symmetries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from evalsuite.errors import EvalsuiteError
from evalsuite.math import cubemap, sh, sphere

unit = st.floats(-1, 1, allow_nan=False)


@given(unit, unit, unit)
def test_direction_to_face_and_back(x, y, z):
    length = np.sqrt(x * x + y * y + z * z)
    assume(length > 1e-3)
    face, s, t = cubemap.direction_to_face([x, y, z])
    assert 0 <= s <= 1 and 0 <= t <= 1
    np.testing.assert_allclose(cubemap.face_to_direction(face, s, t), np.array([x, y, z]) / length, atol=1e-14)


@given(st.integers(0, 5), st.floats(0.001, 0.999), st.floats(0.001, 0.999))
def test_face_to_direction_and_back(face, s, t):
    f, s2, t2 = cubemap.direction_to_face(cubemap.face_to_direction(face, s, t))
    assert f == face
    np.testing.assert_allclose([s2, t2], [s, t], atol=1e-14)


def test_orientation_is_opengls():
    # By hand from the table of the OpenGL specification: s and t of a direction beside each axis.
    for d, face, right, down in (
        ((1, 0, -0.5), 0, True, None), ((1, -0.5, 0), 0, None, True), ((-1, 0, 0.5), 1, True, None),
        ((-1, -0.5, 0), 1, None, True), ((0.5, 1, 0), 2, True, None), ((0, 1, 0.5), 2, None, True),
        ((0.5, -1, 0), 3, True, None), ((0, -1, -0.5), 3, None, True), ((0.5, 0, 1), 4, True, None),
        ((0, -0.5, 1), 4, None, True), ((-0.5, 0, -1), 5, True, None), ((0, -0.5, -1), 5, None, True),
    ):  # fmt: skip
        f, s, t = cubemap.direction_to_face(d)
        assert (f, s, t) == (face, 0.75 if right else 0.5, 0.75 if down else 0.5)


@pytest.mark.parametrize("width", [1, 2, 7, 64])
def test_solid_angles_sum_to_the_sphere(width):
    omega = cubemap.texel_solid_angles(width)
    assert 6 * omega.sum() == pytest.approx(4 * np.pi, rel=1e-13)
    np.testing.assert_allclose(omega, omega[::-1, ::-1], rtol=1e-9)


def test_solid_angle_of_texels_varies_by_3_sqrt_3():
    omega = cubemap.texel_solid_angles(512)
    # (1 + a² + b²)^(3/2) from the centre to a corner of the face: 3√3; texel centres stop short of both.
    assert omega.max() / omega.min() == pytest.approx(3 * np.sqrt(3), rel=0.01)


def test_default_face_size_spans_the_map():
    assert [cubemap.default_face_size(w) for w in (1, 64, 65, 256, 1000, 1024, 1025, 8192)] == [
        16, 16, 32, 64, 256, 256, 512, 1024]  # fmt: skip


@pytest.mark.parametrize("width", [0, 3, -4, 2.5, True, 16384])
def test_bad_face_sizes(width):
    with pytest.raises(EvalsuiteError, match="power of two"):
        cubemap.check_face_size(width)


def test_box_mips_are_means_of_four_on_each_face():
    level = np.random.default_rng(1).random((6, 8, 8, 3))
    levels = cubemap.box_mips(level)
    assert [x.shape[1] for x in levels] == [8, 4, 2, 1]
    np.testing.assert_allclose(levels[1][2, 1, 3], level[2, 2:4, 6:8].mean((0, 1)), rtol=1e-14)
    np.testing.assert_allclose(levels[3][:, 0, 0], level.mean((1, 2)), rtol=1e-14)


def test_resampling_keeps_energy_and_linear_functions():
    # L(d) = a + b·d: E over the sphere 4πa, degree-1 coefficients √(4π/3) b in the order (y, z, x).
    directions = sphere.latlong_directions(129, 256)
    a, b = 2.0, np.array([0.3, -0.7, 0.5])
    radiance = np.repeat((a + directions @ b)[..., None], 3, axis=-1)
    cube = cubemap.resample_latlong(radiance, np.eye(3), 32)
    # The map's own bilinear interpolation is short of the function by δ²/8 · |b|, 8e-5; the rest is exact.
    np.testing.assert_allclose(cubemap.integral(cube), 4 * np.pi * a, rtol=1e-4)
    coefficients = sh.project_cube(cube)[:, 0]
    np.testing.assert_allclose(coefficients[1:4], np.sqrt(4 * np.pi / 3) * b[[1, 2, 0]], rtol=2e-3)


def test_a_bright_texel_keeps_its_energy():
    radiance = np.ones((64, 128, 3), np.float32)
    radiance[20, 37] = 1e5
    whole = np.einsum("yxc,yx->c", radiance.astype(np.float64), sphere.latlong_solid_angles(64, 128))
    for width in (16, 32, 64):
        cube = cubemap.resample_latlong(radiance, np.eye(3), width)
        assert cubemap.integral(cube)[0] / whole[0] == pytest.approx(1, abs=0.01), width


def test_seamless_look_up_at_centres_edges_and_corners():
    levels = cubemap.box_mips(np.random.default_rng(2).random((6, 4, 4, 3)))
    cube = cubemap.SeamlessCube(levels)
    for level, texels in enumerate(levels):
        np.testing.assert_allclose(cube.bilinear(cubemap.texel_directions(texels.shape[1]), level), texels, atol=1e-12)
    top = levels[-1][:, 0, 0]
    np.testing.assert_allclose(cube.bilinear([1, 0.5, 0], 2), 0.75 * top[0] + 0.25 * top[2], atol=1e-12)
    np.testing.assert_allclose(cube.bilinear([1, 1, 0], 2), 0.5 * (top[0] + top[2]), atol=1e-12)
    np.testing.assert_allclose(cube.bilinear([1, 1, 1], 2), (top[0] + top[2] + top[4]) / 3, atol=1e-12)
    np.testing.assert_allclose(cube.lookup([0.3, 1, 0.2], 0.25), 0.75 * cube.bilinear([0.3, 1, 0.2], 0)
                               + 0.25 * cube.bilinear([0.3, 1, 0.2], 1), atol=1e-12)  # fmt: skip


@given(st.integers(0, 7), st.floats(-0.99, 0.99), st.integers(0, 2))
def test_seamless_look_up_is_continuous_across_edges(edge, along, axis):
    cube = _noise_cube()
    a, b = (1 if edge & 1 else -1), (1 if edge & 2 else -1)
    sides = []
    for lean in (1 - 1e-9, 1 + 1e-9):
        d = np.roll([a * lean, b, along], axis)
        sides.append(cube.bilinear(d, 1))
    np.testing.assert_allclose(*sides, atol=1e-7)


def _noise_cube(cache=[]):  # noqa: B006 - one cube for all examples
    if not cache:
        cache.append(cubemap.SeamlessCube(cubemap.box_mips(np.random.default_rng(3).random((6, 8, 8, 1)))))
    return cache[0]


def test_reflection_lod_of_a_known_footprint():
    # Directions on the +z face one texel apart across, half a texel apart down: λ = log₂ 1 = 0; four times as far: 2.
    width = 64
    for factor, expected in ((1.0, 0.0), (4.0, 2.0)):
        x = (np.arange(6) * 2 * factor / width)[None, :] + np.zeros((5, 1))
        y = (np.arange(5) * factor / width)[:, None] + np.zeros((1, 6))
        directions = np.stack([x, y, np.ones_like(x)], -1)
        np.testing.assert_allclose(cubemap.reflection_lod(directions, width), expected, atol=1e-12)
