"""What benchmarks compare with must be right too: direct filter responses, the form in which others get and return cubemaps."""

import numpy as np
import pytest

from benchmarks import others
from benchmarks.decomposition import Direct
from evalsuite.image import exr
from evalsuite.lights.decompose import PAPER
from evalsuite.math import cubemap


def test_direct_responses_are_those_of_the_discs_areas():
    direct, at = Direct(np.full((256, 512, 3), 2.0, np.float32)), 128 * 512 + 77
    centre, within = (2.0 * 4.0 * np.pi * np.sin(0.5 * r) ** 2 for r in (direct.inner, direct.outer))
    expected = (centre + PAPER.surround * (within - centre)) / (2.0 * direct.outer)
    # A texel is 0.012 rad, the largest disc's radius 0.39: rims err by a texel's part.
    np.testing.assert_allclose(direct.each(at)[-5:], expected[-5:], rtol=0.02)


def test_both_direct_ways_are_alike():
    rng = np.random.default_rng(3)
    direct = Direct(rng.exponential(1.0, (64, 128, 3)).astype(np.float32))
    for at in rng.integers(0, 64 * 128, 20):
        np.testing.assert_allclose(direct.each(at), direct.together(at), rtol=1e-9, atol=1e-12)


@pytest.fixture
def cube():
    towards = cubemap.texel_directions(32)
    return cubemap.SeamlessCube([np.exp(towards @ np.array([[1.0, 0.2, 0.1], [0.5, -1.0, 0.3], [0.1, 0.4, 2.0]]))])


def test_the_panorama_holds_the_cubemap(cube, tmp_path):
    others._write_panorama(tmp_path, cube)
    read = exr.read(tmp_path / "cube.hdr")
    assert read.shape == (64, 128, 3)
    towards = (0.0, 1.0, 0.0)  # the first row is straight up
    np.testing.assert_allclose(read[0].mean(0), cube.bilinear(np.array(towards), 0), rtol=0.05)
    # RGBE keeps 8 bits of the largest channel.
    theta, phi = np.pi * 40.5 / 64, 2 * np.pi * 30.5 / 128
    towards = np.array([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)])
    np.testing.assert_allclose(read[40, 30], cube.bilinear(towards, 0), atol=read[40, 30].max() / 100)


def test_another_frame_is_found(cube):
    frame = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    theirs = cube.bilinear(cubemap.texel_directions(32) @ frame.T, 0)
    back = cubemap.SeamlessCube([theirs]).bilinear(others._turned(theirs, cube, 32), 0)
    np.testing.assert_allclose(back, cube.levels[0], rtol=1e-6)
