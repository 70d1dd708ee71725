"""Windows of spherical harmonics: closed forms, exact minima, and that no ringing is left."""

import numpy as np
import pytest

from evalsuite.math import sh, sh_window


def directions(count=20_000, seed=1):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def sun(toward=(0.3, 0.8, -0.5), perpendicular=(3.0, 2.0, 1.0)):
    """Coefficients of a point light of that irradiance: L_i = E Y_i(direction)."""
    d = np.asarray(toward) / np.linalg.norm(toward)
    return sh.basis(d)[:, None] * np.asarray(perpendicular)


def test_windows_by_hand():
    np.testing.assert_allclose(sh_window.factors("hann", 4.0)[[0, 1, 4]], [1, 0.5 + np.sqrt(0.125), 0.5])
    np.testing.assert_allclose(sh_window.factors("lanczos", 4.0)[[0, 1, 4]], [1, np.sqrt(8) / np.pi, 2 / np.pi])
    np.testing.assert_allclose(sh_window.factors("laplacian", 0.25)[[0, 1, 4]], [1, 1 / 2, 1 / 10])
    for window in ("hann", "lanczos"):  # nothing of a band at or beyond w
        np.testing.assert_array_equal(sh_window.factors(window, 2.0)[4:], 0)
        np.testing.assert_allclose(sh_window.factors(window, 1e9), 1, rtol=1e-12)
    np.testing.assert_array_equal(sh_window.factors("laplacian", 0.0), 1)


def test_minimum_is_the_least_irradiance():
    d = directions()
    rng = np.random.default_rng(2)
    for _ in range(20):
        c = rng.normal(size=(9, 3))
        exact, seen = sh_window.minimum(c), sh.irradiance(c, d).min(0)
        assert (exact <= seen + 1e-12).all()
        np.testing.assert_allclose(exact, seen, atol=3e-3)


def test_minimum_without_a_unique_direction():
    """The hard case of the quadratic: no linear term, a ring of minima; and a constant."""
    c = np.zeros((9, 1))
    c[6] = 1.0
    np.testing.assert_allclose(sh_window.minimum(c), -np.pi / 4 * np.sqrt(5 / (16 * np.pi)), rtol=1e-9)
    c[6], c[0] = 0.0, 2.0
    np.testing.assert_allclose(sh_window.minimum(c), 2 * np.pi * np.sqrt(1 / (4 * np.pi)), rtol=1e-12)


def test_minimum_of_a_sun():
    """E/E⊥ = ¼ + ½x + 5/32 (3x² − 1) with x = n·d: least at x = −8/15, 3/32 − 2/15."""
    np.testing.assert_allclose(sh_window.minimum(sun()), np.array([3.0, 2.0, 1.0]) * (3 / 32 - 2 / 15), rtol=1e-9)


@pytest.mark.parametrize("window", sh_window.WINDOWS)
def test_the_mildest_window_ends_exactly_at_zero(window):
    for c in (sun(), sun((0, 0, 1)) + 0.3 * sun((1, 0, -0.2), (1, 5, 1))):
        h, size = sh_window.largest_without_ringing(window, c)
        least = sh_window.minimum(h[:, None] * c)
        assert (least >= 0).all() and least.min() < 1e-7 * np.abs(c).max()
        assert h[0] == 1 and 0 <= h[4] < h[1] < 1 and 0 < size < np.inf
        milder = sh_window.factors(window, size * (0.99 if window == "laplacian" else 1.01))
        assert (sh_window.minimum(milder[:, None] * c) < 0).any()
        assert (sh.irradiance(h[:, None] * c, directions()) >= 0).all()


def test_hann_leaves_a_lone_sun_no_second_band():
    """E/E⊥ = ¼ − 5b/32 + ½ax + 15/32 bx², a = cos²(π/2w), b = cos²(π/w), dips below 0 for every w > 2; at 2 it is ¼(1 + x)."""
    h, size = sh_window.largest_without_ringing("hann", sun())
    assert size == pytest.approx(2, rel=1e-6) and h[1] == pytest.approx(0.5, rel=1e-6) and h[4] < 1e-9
    laplacian, _ = sh_window.largest_without_ringing("laplacian", sun())
    assert laplacian[4] > 0.05


@pytest.mark.parametrize("window", sh_window.WINDOWS)
def test_nothing_is_windowed_where_nothing_rings(window):
    c = sun()
    c[0] *= 3
    assert (sh_window.minimum(c) > 0).all()
    h, size = sh_window.largest_without_ringing(window, c)
    np.testing.assert_array_equal(h, 1)
    assert size == (0 if window == "laplacian" else np.inf)


@pytest.mark.parametrize("window", sh_window.WINDOWS)
def test_a_map_without_light(window):
    h, _ = sh_window.largest_without_ringing(window, np.zeros((9, 3)))
    assert (h == 1).all()
