"""Environments of one degree: spectrum, mean, contrast, positivity; the circle's mean value as an oracle without harmonics."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.special import eval_legendre, gammaln, lpmv

from evalsuite.math.band_noise import CONTRAST, LARGEST_DEGREE, band_noise
from evalsuite.math.sphere import latlong_lookup, latlong_solid_angles, latlong_spacing

band = cache(band_noise)


def weights(radiance: np.ndarray) -> np.ndarray:
    return latlong_solid_angles(*radiance.shape) / (4 * np.pi)


def spectrum(radiance: np.ndarray, degrees: int) -> np.ndarray:
    """Power of each degree, by scipy's associated Legendre functions and a plain sum over the texels."""
    height, width = radiance.shape
    cosine = np.cos(np.arange(height) * np.pi / (height - 1))
    rows = np.fft.rfft(radiance, axis=1) / width * latlong_solid_angles(height, width).sum(1, keepdims=True)
    power = np.zeros(degrees)
    for degree in range(degrees):
        for m in range(degree + 1):
            log = 0.5 * (np.log((2 * degree + 1) / (4 * np.pi)) + gammaln(degree - m + 1) - gammaln(degree + m + 1))
            coefficient = (np.exp(log) * lpmv(m, degree, cosine)) @ rows[:, m]
            power[degree] += (1 if m == 0 else 2) * np.abs(coefficient) ** 2
    return power


@pytest.mark.parametrize("degree", [1, 2, 5, 12])
def test_all_power_is_at_its_degree(degree):
    power = spectrum(band(degree) - 1, 2 * degree + 4)
    # Mean square κ² puts 4π κ² into degree ℓ. A sum over texels of size h = π/16ℓ knows coefficients to (hℓ)²/6 = 0.6 %.
    assert power[degree] == pytest.approx(4 * np.pi * CONTRAST**2, rel=0.013)
    assert np.delete(power, degree).sum() < 0.006**2 * power[degree]


@pytest.mark.parametrize("degree", [1, 3, 16, 32])
def test_the_mean_over_a_circle_is_its_centre_times_the_legendre_polynomial(degree):
    """True of degree ℓ alone, for any circle."""
    rng = np.random.default_rng(3)
    centre = rng.standard_normal((200, 3))
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    first = np.cross(centre, rng.standard_normal((200, 3)))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(centre, first)
    for psi in (0.5 / degree, 1.7 / degree, 0.9):
        phi = np.arange(512) * 2 * np.pi / 512
        around = np.cos(phi)[:, None, None] * first + np.sin(phi)[:, None, None] * second
        circle = latlong_lookup(band(degree)[..., None], np.cos(psi) * centre + np.sin(psi) * around)[..., 0].mean(0)
        expected = eval_legendre(degree, np.cos(psi)) * (latlong_lookup(band(degree)[..., None], centre)[..., 0] - 1)
        # bilinear look-ups between texels: a fraction (hℓ)²/8 of the wave's amplitude, about 3 κ
        h = latlong_spacing(*band(degree).shape)
        np.testing.assert_allclose(circle - 1, expected, atol=2 * 3 * CONTRAST * (h * max(degree, 2)) ** 2 / 8)


@pytest.mark.parametrize("degree", [1, 7, 64])
def test_mean_and_contrast_are_exact(degree):
    radiance = band(degree)
    mean = (weights(radiance) * radiance).sum()
    assert mean == pytest.approx(1, abs=1e-12)
    assert np.sqrt((weights(radiance) * (radiance - 1) ** 2).sum()) == pytest.approx(CONTRAST, rel=1e-12)


def test_no_degree_goes_below_zero():
    lowest = min(band_noise(degree).min() for degree in range(1, LARGEST_DEGREE + 1))
    assert 0 < lowest < 0.02, "positive, and no more contrast to be had"


def test_maps_are_the_same_in_every_call_and_unlike_each_other():
    np.testing.assert_array_equal(band_noise(4), band_noise(4))
    assert np.abs(np.corrcoef(band(3).ravel(), band(4).ravel())[0, 1]) < 0.1


def test_degrees_out_of_range_are_refused():
    for degree in (0, -1, LARGEST_DEGREE + 1):
        with pytest.raises(ValueError):
            band_noise(degree)
