"""The hierarchical parabolic prefilter: the notes' table, its kernels on the sphere, and its error shared out by cause."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import hierarchical, paraboloid, phong, zonal
from evalsuite.math.hierarchical import LARGE, SMALL
from evalsuite.math.sphere import latlong_lookup, latlong_spacing
from evalsuite.scene import builtin
from evalsuite.scene.environment import read_environment

# Course notes §3.2.5: exponent, filter size small and large, shrink factor small and large (cut-off 0.1, 7 × 7, radius 256).
TABLE = [
    (10, 174, 260, 32, 64),
    (50, 78, 136, 16, 32),
    (100, 56, 100, 8, 16),
    (250, 36, 66, 8, 16),
    (500, 26, 48, 4, 8),
]


@pytest.mark.parametrize(("exponent", "small", "large", "shrink_small", "shrink_large"), TABLE)
def test_the_papers_table(exponent, small, large, shrink_small, shrink_large):
    sizes = [hierarchical.filter_size(hierarchical.radius(which, exponent, 0.1), 256) for which in (SMALL, LARGE)]
    assert sizes == [small, large]
    assert [2 ** hierarchical.shrink_level(size, 7) for size in sizes] == [shrink_small, shrink_large]


def test_radii_go_to_one_to_two():
    for exponent, ratio in ((10, 1.5), (500, 1.91), (1e6, 2.0)):
        small, large = (hierarchical.radius(which, exponent, 0.1) for which in (SMALL, LARGE))
        assert large / small == pytest.approx(ratio, abs=0.02)
    assert np.cos(hierarchical.cut_angle(30.0, 0.1)) ** 30 == pytest.approx(0.1)


def test_kernels_fit_seven_texels_and_sum_to_one():
    for exponent in (10, 50, 100, 250, 500, 3000):
        for which in (SMALL, LARGE):
            level = hierarchical.filter_level(which, exponent, 0.1, 192, 7, 512)
            kernel = hierarchical.kernel(which, exponent, 0.1, 192 / 2**level)
            assert len(kernel) <= 7 and kernel.sum() == pytest.approx(1) and kernel.argmax() == kernel.size // 2
            assert len(kernel) >= 3


def _distance(exponent: float, d: float, size: int = 512, border: float = 128.0) -> tuple[float, float]:
    """∫ |blended kernel − lobe| over the sphere (0 to 2), and the angle [degrees] between their mean directions, for a texel at
    distance d from the centre. Without shrinking."""
    circle, column = 0.5 * size - border, round(0.5 * size - 0.5 + d * (0.5 * size - border))
    row, blended = size // 2, np.zeros((size, size))
    x = (column + 0.5 - 0.5 * size) / circle
    d2 = x * x + (0.5 / circle) ** 2
    for which, share in ((SMALL, 1 - min(d2, 1)), (LARGE, min(d2, 1))):
        kernel = hierarchical.kernel(which, exponent, 0.1, circle)
        h = len(kernel) // 2
        blended[row - h : row + h + 1, column - h : column + h + 1] += share * kernel
    directions = paraboloid.texel_directions(size, border)[0]
    omega = paraboloid.texel_solid_angles(size, border, inside=False)
    lobe = phong.phong_lobe(exponent, directions @ directions[row, column]) * omega
    lobe[np.linalg.norm(directions, axis=-1) < 0.5] = 0
    means = [np.einsum("yx,yxk->k", weights, directions) for weights in (blended, lobe)]
    cosine = means[0] @ means[1] / np.prod([np.linalg.norm(m) for m in means])
    return float(np.abs(blended - lobe).sum() + 1 - lobe.sum()), float(np.degrees(np.arccos(min(cosine, 1))))


@pytest.mark.parametrize(("exponent", "at_rim"), [(50, 0.37), (100, 0.31), (250, 0.28), (500, 0.25)])
def test_the_blended_kernel_on_the_sphere(exponent, at_rim):
    """The cut alone makes 2 · 0.1^((N+1)/N) at the centre; the blend's own shape shows between centre and rim."""
    centre, half_way, rim = (_distance(exponent, d) for d in (0.0, 0.5, 1.0))
    assert centre[0] == pytest.approx(2 * 0.1 ** ((exponent + 1) / exponent), abs=0.03)
    assert half_way[0] == pytest.approx(0.275, abs=0.03)
    assert rim[0] == pytest.approx(at_rim, abs=0.03)
    assert centre[1] < 0.2 and half_way[1] < 0.6


def test_a_constant_stays():
    levels = paraboloid.weighted_mips(np.full((2, 64, 64, 3), 0.7), 8.0)
    np.testing.assert_allclose(hierarchical.prefilter(levels, 8.0, 40.0, 0.1, 7), 0.7, rtol=1e-12)


def fibonacci(count):
    y, phi = 1 - (2 * np.arange(count) + 1) / count, np.pi * (3 - np.sqrt(5)) * np.arange(count)
    sine = np.sqrt(1 - y * y)
    return np.stack([sine * np.cos(phi), y, sine * np.sin(phi)], -1)


@pytest.mark.parametrize(("name", "exponent", "expected"), [
    ("office", 50.0, {"blend": 0.09, "cutoff": 0.11, "kernel": 0.13, "total": 0.07}),
    ("cathedral", 50.0, {"blend": 0.25, "cutoff": 0.30, "kernel": 0.55, "total": 0.39}),
])  # fmt: skip
def test_error_by_cause(name, exponent, expected):
    """Cut-off, 7 × 7 and the blend switched off one after the other: docs/prefiltering.md quotes these numbers."""
    env, r = read_environment(builtin.environment_path(name)), fibonacci(2000)
    truth = zonal.convolve(env.radiance, zonal.phong_bands(exponent, zonal.phong_degree(exponent)), r)
    found = hierarchical.errors(lambda d: latlong_lookup(env.radiance, d), truth, r, exponent, 256,
                                latlong_spacing(*env.radiance.shape[:2]))  # fmt: skip
    assert found["total"] <= found["blend"] + found["cutoff"] + found["kernel"]
    assert found == pytest.approx(expected, abs=0.012)
