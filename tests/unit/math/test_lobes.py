"""Spherical harmonics, cosine-power lobes and Fresnel reflectance against independent computations."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import cubemap, fresnel, phong, sh

DIRECTIONS = cubemap.texel_directions(128)
OMEGA = np.broadcast_to(cubemap.texel_solid_angles(128), (6, 128, 128))


def test_basis_is_orthonormal():
    y = sh.basis(DIRECTIONS)
    gram = np.einsum("fyxi,fyxj,fyx->ij", y, y, OMEGA)
    np.testing.assert_allclose(gram, np.eye(9), atol=1e-4)  # texel centres for integrals over texels: O(w⁻²)


def test_basis_is_in_the_papers_order():
    x, y, z = 0.48, 0.6, 0.64
    c1, c2 = np.sqrt(3 / 4 / np.pi), np.sqrt(15 / 4 / np.pi)
    expected = [np.sqrt(1 / 4 / np.pi), c1 * y, c1 * z, c1 * x, c2 * x * y, c2 * y * z,
                np.sqrt(5 / 16 / np.pi) * (3 * z * z - 1), c2 * x * z, np.sqrt(15 / 16 / np.pi) * (x * x - y * y)]  # fmt: skip
    np.testing.assert_allclose(sh.basis([x, y, z]), expected, rtol=1e-14)


def test_irradiance_of_a_band_limited_map_is_the_cosine_integral():
    coefficients = np.random.default_rng(4).normal(size=(9, 3))
    normals = np.random.default_rng(5).normal(size=(5, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    radiance = sh.basis(DIRECTIONS) @ coefficients
    cosine = np.maximum(np.einsum("fyxd,nd->nfyx", DIRECTIONS, normals), 0)
    direct = np.einsum("nfyx,fyxc,fyx->nc", cosine, radiance, OMEGA)
    np.testing.assert_allclose(sh.irradiance(coefficients, normals), direct, atol=2e-3)
    np.testing.assert_allclose(sh.project_cube(radiance), coefficients, atol=1e-3)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 7.5, 100.0])
def test_phong_lobe_integrates_to_one(exponent):
    cosine = (np.arange(100_000) + 0.5) / 100_000
    assert 2 * np.pi * phong.phong_lobe(exponent, cosine).mean() == pytest.approx(1, rel=1e-6)
    assert phong.phong_lobe(exponent, -0.3) == (0 if exponent else pytest.approx(1 / (2 * np.pi)))


def test_blinn_phong_is_the_papers_equation_13():
    assert phong.blinn_phong_brdf(24.0, 0.9) == pytest.approx((24 + 8) / 8 * 0.9**24 / np.pi, rel=1e-14)


def test_mcguires_level():
    # w = 256, s = 3 · 256² − 1: a texel of level 0. Each level quarters s + 1.
    assert phong.exponent_to_lod(3 * 256**2 - 1, 256) == pytest.approx(0, abs=1e-12)
    assert phong.exponent_to_lod(3 * 64**2 - 1, 256) == pytest.approx(2, abs=1e-12)
    for exponent, width in ((0.5, 16), (50, 256), (1e4, 1024)):
        lod = phong.exponent_to_lod(exponent, width)
        assert phong.mean_texel_solid_angle(width, lod) == pytest.approx(float(phong.lobe_solid_angle(exponent)), rel=1e-12)
        assert phong.lod_to_exponent(lod, width) == pytest.approx(exponent, rel=1e-12)


def test_alpha_and_exponent():
    assert phong.alpha_to_exponent(0.1) == pytest.approx(198)
    assert phong.exponent_to_alpha(phong.alpha_to_exponent(0.37)) == pytest.approx(0.37)
    assert phong.alpha_to_exponent(1.5) == 0
    s, alpha = 198.0, 0.1  # equal peaks of the two distributions
    assert (s + 2) / (2 * np.pi) == pytest.approx(1 / (np.pi * alpha**2))


@pytest.mark.parametrize(("eta", "k"), [(0.2, 3.9), (1.5, 0.0), (2.9, 3.1), (0.0, 1.0)])
def test_conductor_reflectance_is_that_of_complex_snell(eta, k):
    cosine = np.linspace(0.01, 1, 50)
    index = eta + 1j * k
    refracted = np.sqrt(index**2 - (1 - cosine**2))  # index × cosine of the refracted ray
    r_s = (cosine - refracted) / (cosine + refracted)
    r_p = (index**2 * cosine - refracted) / (index**2 * cosine + refracted)
    expected = 0.5 * (np.abs(r_s) ** 2 + np.abs(r_p) ** 2)
    np.testing.assert_allclose(fresnel.fresnel_conductor(cosine, eta, k), expected, rtol=1e-10, atol=1e-12)
