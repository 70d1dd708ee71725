"""Microfacet terms: closed forms, energy, and convergence of the albedo's quadrature."""

import numpy as np
import pytest

from evalsuite.math import microfacet

CASES = [(d, a) for d in microfacet.DISTRIBUTIONS for a in (0.05, 0.2, 0.6, 1.0)]


@pytest.mark.parametrize(("distribution", "alpha"), CASES)
def test_the_normal_distribution_projects_to_one(distribution, alpha):
    # tan θ = α x/(1 − x) spreads both distributions over the interval.
    x = (np.arange(200_000) + 0.5) / 200_000
    tangent = alpha * x / (1 - x)
    c = 1 / np.sqrt(1 + tangent**2)
    measure = 2 * np.pi * tangent * c**3 * alpha / (1 - x) ** 2  # sin θ dθ = tan θ cos³θ d(tan θ)
    assert (microfacet.normal_density(distribution, alpha, c) * c * measure).mean() == pytest.approx(1, abs=1e-6)
    assert microfacet.normal_density(distribution, alpha, -0.5) == 0


@pytest.mark.parametrize(("distribution", "alpha"), CASES)
def test_half_vectors_follow_the_distribution(distribution, alpha):
    beyond = np.linspace(0.05, 1, 20)
    c = microfacet.half_vector_cosine(distribution, alpha, beyond)
    for share, cosine in zip(beyond, c, strict=True):
        x = (np.arange(40_000) + 0.5) / 40_000 * cosine
        inside = (microfacet.normal_density(distribution, alpha, x) * x).mean() * cosine * 2 * np.pi
        assert inside == pytest.approx(share, abs=1e-4)


@pytest.mark.parametrize(("distribution", "alpha"), CASES)
def test_masking(distribution, alpha):
    c = np.array([1.0, 0.7, 0.1, 1e-7, 0.0, -0.2])
    g1 = microfacet.smith_g1(distribution, alpha, c)
    np.testing.assert_allclose(g1[0], 1, atol=1e-12)
    assert (np.diff(g1) <= 0).all() and g1[-1] == g1[-2] == 0
    over = microfacet.smith_g1_over_cosine(distribution, alpha, c)
    np.testing.assert_allclose(over[:4] * c[:4], g1[:4], rtol=1e-6)
    assert over[4] == pytest.approx(over[3], rel=1e-4) and over[5] == 0


@pytest.mark.parametrize(("distribution", "alpha"), CASES)
def test_albedo_is_the_integral_of_the_lobe(distribution, alpha):
    """Against a plain midpoint sum over the hemisphere of l, which knows nothing of half-vector sampling."""
    z, phi = np.meshgrid((np.arange(800) + 0.5) / 800, (np.arange(800) + 0.5) / 800 * np.pi, indexing="ij")
    light = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1)
    for cos_view in (0.9, 0.15):
        view = np.array([np.sqrt(1 - cos_view**2), 0, cos_view])
        half = light + view
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        plain = 2 * np.pi * microfacet.lobe(distribution, alpha, cos_view, z, half[..., 2]).mean()
        assert microfacet.albedo(distribution, alpha, [cos_view])[0, 0] == pytest.approx(plain, abs=1.5e-3)


def test_the_split_sum_table_at_f0_1_is_the_albedo_and_f0_0_is_below():
    c = np.array([0.05, 0.5, 1.0])
    table = microfacet.split_sum_table([0.1, 0.25], c)
    assert table.shape == (2, 3, 2)
    np.testing.assert_allclose(table.sum(-1)[1], microfacet.albedo("ggx", 0.25, c)[:, 0], rtol=1e-12)
    assert table[1, 1].sum() == pytest.approx(0.8551, abs=5e-4)
    assert table[0, 2, 1] < 1e-4 < 0.1 < table[0, 0, 1]  # Schlick's rise is a matter of grazing angles
