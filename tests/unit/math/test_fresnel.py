"""Dielectric and Schlick reflectance against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import fresnel

ETAS = [1.0001, 1.33, 1.5, 5.0, 200.0]


@pytest.mark.parametrize("eta", ETAS)
def test_normal_incidence(eta):
    expected = ((eta - 1) / (eta + 1)) ** 2
    assert fresnel.fresnel_dielectric(1.0, eta) == pytest.approx(expected, rel=1e-12)
    assert fresnel.eta_to_normal_reflectance(eta) == pytest.approx(expected, rel=1e-12)
    assert fresnel.normal_reflectance_to_eta(expected) == pytest.approx(eta, rel=1e-10)


@pytest.mark.parametrize("eta", ETAS)
def test_brewsters_angle_reflects_one_polarisation_alone(eta):
    """tan θ_B = η: R_p = 0, and R_s = ((η² − 1)/(η² + 1))², hence F = ½ R_s."""
    cosine = 1 / np.sqrt(1 + eta * eta)
    expected = 0.5 * ((eta**2 - 1) / (eta**2 + 1)) ** 2
    assert fresnel.fresnel_dielectric(cosine, eta) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("eta", ETAS)
@pytest.mark.parametrize("degrees", [0.0, 10.0, 45.0, 70.0, 89.0, 89.99])
def test_reflectance_is_that_of_snell(eta, degrees):
    """Sines and tangents of both angles, a form with nothing in common with Eq 13."""
    i = np.radians(max(degrees, 1e-3))
    t = np.arcsin(np.sin(i) / eta)
    expected = 0.5 * ((np.sin(i - t) / np.sin(i + t)) ** 2 + (np.tan(i - t) / np.tan(i + t)) ** 2)
    # Near η = 1 the difference i − t itself has lost digits.
    assert fresnel.fresnel_dielectric(np.cos(i), eta) == pytest.approx(expected, rel=1e-6)


def test_value_at_89_degrees():
    """Crown glass at 89°, worked by hand from R_s and R_p."""
    c = np.cos(np.radians(89.0))
    t = np.sqrt(1 - (1 - c * c) / 2.25)
    r_s, r_p = ((c - 1.5 * t) / (c + 1.5 * t)) ** 2, ((1.5 * c - t) / (1.5 * c + t)) ** 2
    assert fresnel.fresnel_dielectric(c, 1.5) == pytest.approx((r_s + r_p) / 2, rel=1e-12)
    assert 0.90 < (r_s + r_p) / 2 < 0.91


def test_equal_indices_reflect_nothing():
    assert not fresnel.fresnel_dielectric(np.linspace(0, 1, 101), 1.0).any()


def test_a_dielectric_is_a_conductor_that_absorbs_nothing():
    cosine = np.linspace(0.01, 1, 60)
    for eta in (0.6, 1.5, 5.0):  # 0.6: total reflection below a cosine of 0.8
        np.testing.assert_allclose(
            fresnel.fresnel_dielectric(cosine, eta), fresnel.fresnel_conductor(cosine, eta, 0.0), rtol=1e-9, atol=1e-12
        )
    assert (fresnel.fresnel_dielectric(cosine[cosine < 0.79], 0.6) == 1).all()


def test_grazing_reflects_all():
    np.testing.assert_allclose(fresnel.fresnel_dielectric(0.0, [1.2, 1.5, 200.0]), 1.0, rtol=1e-12)


def test_schlick():
    assert fresnel.fresnel_schlick(1.0, 0.26) == pytest.approx(0.26)
    assert fresnel.fresnel_schlick(0.0, 0.26) == pytest.approx(1.0)
    assert fresnel.fresnel_schlick(0.5, 0.04) == pytest.approx(0.04 + 0.96 / 32)
    np.testing.assert_allclose(fresnel.fresnel_schlick(0.0, [0.1, 0.2, 0.3]), 1.0)
    # What it is an approximation of: farthest from glass near grazing, by 0.036.
    cosine = np.linspace(0, 1, 200)
    exact = fresnel.fresnel_dielectric(cosine, 1.5)
    difference = np.abs(fresnel.fresnel_schlick(cosine, fresnel.eta_to_normal_reflectance(1.5)) - exact)
    assert difference.max() == pytest.approx(0.0357, abs=2e-4) and cosine[difference.argmax()] < 0.15
