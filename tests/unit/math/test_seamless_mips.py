"""The MIP chain that crosses faces: borders, weights, symmetry, and what it is worth beside the per-face box."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import cubemap, phong, seamless_mips
from evalsuite.math.seamless_mips import WIDER


def noise(width=16, seed=4):
    return np.random.default_rng(seed).gamma(0.5, size=(6, width, width, 3))


def test_a_constant_stays():
    for level in seamless_mips.seamless_mips(np.full((6, 16, 16, 3), 0.7)):
        np.testing.assert_allclose(level, 0.7, rtol=1e-13)


def test_an_edge_texel_reaches_the_neighbouring_face_and_only_there():
    level0 = np.zeros((6, 8, 8, 1))
    level0[4, 3, 7] = 1.0  # +z, at the edge towards +x
    assert cubemap.face_to_direction(4, 1.0, 0.5)[0] == pytest.approx(np.sqrt(0.5))
    halved = seamless_mips.seamless_mips(level0)[1]
    assert not cubemap.box_mips(level0)[1][0].any()
    touched = {int(face) for face in np.unique(np.nonzero(halved)[0])}
    assert touched == {4, 0}
    # Of +x the texels beside it, in its column at −z's far side: s = 0 there is +z.
    assert set(np.nonzero(halved[0])[1]) == {0}


def test_the_weights_are_solid_angles_times_the_mask():
    level0 = noise(8)
    omega = np.outer([1, 3, 3, 1], [1, 3, 3, 1]) * cubemap.texel_solid_angles(8)[1:5, 3:7]
    expected = np.einsum("yxc,yx->c", level0[2, 1:5, 3:7], omega) / omega.sum()
    np.testing.assert_allclose(seamless_mips.seamless_mips(level0)[1][2, 1, 2], expected, rtol=1e-12)


def test_turning_the_cube_turns_the_chain():
    """Each rotation by 90° takes faces to faces and every border to another: none may be stitched wrongly."""
    level0, width = noise(8), 8
    coarse = seamless_mips.seamless_mips(level0)
    for turn in ([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 1]]):
        turn = np.array(turn, float)

        def turned(level, turn=turn):
            face, s, t = cubemap.direction_to_face(cubemap.texel_directions(level.shape[1]) @ turn)
            size = level.shape[1]
            return level[face, (t * size).astype(int), (s * size).astype(int)]

        assert not np.allclose(turned(level0), level0)
        for index, level in enumerate(seamless_mips.seamless_mips(turned(level0))):
            assert level.shape[1] == width >> index
            np.testing.assert_allclose(level, turned(coarse[index]), rtol=1e-12)


def test_texels_become_quadratic_b_splines():
    """At a face's centre, where solid angles hardly differ: 1/peak of a texel's kernel is 16/9 texels; its variance goes to 1/4
    a side, 15/64 after two levels."""
    width, level, window = 128, 2, 12
    level0 = np.zeros((6, width, width, window**2))
    level0[4, 60:72, 60:72] = np.eye(window**2).reshape(window, window, -1)
    kernel = seamless_mips.seamless_mips(level0)[level][4, 16, 16].reshape(window, window)
    assert kernel.sum() == pytest.approx(1)
    assert 1 / kernel.max() / 4**level == pytest.approx(16 / 9, rel=0.02)
    x, along = np.arange(window) / 2**level, kernel.sum(0)
    assert (along * x**2).sum() - (along * x).sum() ** 2 == pytest.approx(15 / 64, rel=0.02)
    assert pytest.approx(0.5 * np.log2(16 / 9)) == WIDER


def test_levels_and_exponents_are_inverse():
    for exponent in (3.0, 50.0, 700.0):
        lod = seamless_mips.exponent_to_seamless_lod(exponent, 128)
        assert lod < phong.exponent_to_lod(exponent, 128)
        assert seamless_mips.seamless_lod_to_exponent(lod, 128) == pytest.approx(exponent)


def test_energy_stays_nearer_than_in_the_plain_chain():
    """Light from a cube's corners, where texels are smallest: the plain box counts them like any other."""
    d = cubemap.texel_directions(32)
    level0 = (np.abs(d).min(-1, keepdims=True) > 0.4) * np.ones(3)
    whole = cubemap.integral(level0)
    plain, seamless = (np.abs(cubemap.integral(levels[-1]) / whole - 1).max()
                       for levels in (cubemap.box_mips(level0), seamless_mips.seamless_mips(level0)))  # fmt: skip
    assert plain > 0.6 and seamless < plain / 5
