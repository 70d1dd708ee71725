"""Fresnel's factor inside a round lobe's integral against sums over the lobe, and where it makes no difference."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from evalsuite.math import fresnel, fresnel_lobe, lobe_field, phong, zonal
from evalsuite.math.prefilter import frame
from evalsuite.math.sphere import latlong_directions, latlong_lookup

GOLD = np.array([0.143, 0.375, 1.442]), np.array([3.98, 2.39, 1.60])


def gold(cosine):
    return fresnel.fresnel_conductor(cosine[..., None], *GOLD)


def schlick(cosine):
    return fresnel.fresnel_schlick(cosine[..., None], 0.04)


def lamps(height=64, width=128):
    """A dim sky and two lamps."""
    d = latlong_directions(height, width)
    sky = 0.5 + 0.4 * d[..., :1] * np.array([1.0, -0.5, 0.2])
    for axis, k in ((np.array([0.3, 0.8, 0.5]), 60.0), (np.array([-0.7, 0.1, -0.7]), 200.0)):
        sky = sky + 20.0 * np.exp(k * (d @ (axis / np.linalg.norm(axis)) - 1.0))[..., None]
    return sky


def views(count, lowest, seed=3):
    """Unit n and v with n·v ≥ lowest, all azimuths."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    x, y = frame(n)
    c, phi = rng.uniform(lowest, 1.0, (count, 1)), rng.uniform(0, 2 * np.pi, (count, 1))
    return n, c * n + np.sqrt(1 - c * c) * (np.cos(phi) * x + np.sin(phi) * y)


def summed(radiance, exponent, factor, n, v, rings=260, azimuths=256):
    """∫ K(r·l) F(v·h) L dl by the midpoint rule about r."""
    psi = min(np.pi / 2, 7.0 / np.sqrt(exponent + 1)) * (np.arange(rings) + 0.5) / rings
    chi = 2 * np.pi * (np.arange(azimuths) + 0.5) / azimuths
    area = (exponent + 1) / azimuths * np.cos(psi) ** exponent * np.sin(psi) * (psi[1] - psi[0])
    out = []
    for one, view in zip(phong.reflect(v, n), v, strict=True):
        x, y = frame(one)
        around = np.cos(chi)[:, None] * x + np.sin(chi)[:, None] * y
        l = np.sin(psi)[:, None, None] * around + np.cos(psi)[:, None, None] * one  # noqa: E741
        h = l + view
        h /= np.linalg.norm(h, axis=-1, keepdims=True)
        out.append((area[:, None, None] * factor(np.clip(h @ view, 0, 1)) * latlong_lookup(radiance, l)).sum((0, 1)))
    return np.array(out)


def rms(a, b):
    return float(np.sqrt(((a - b) ** 2).mean()) / b.mean())


@pytest.mark.parametrize(("exponent", "factor", "bound"), [
    (6.0, gold, 2e-3), (20.0, gold, 2e-3), (200.0, gold, 1e-3), (3000.0, gold, 1e-3), (20.0, schlick, 1e-2),
])  # fmt: skip
def test_the_sum_of_lobes_is_the_integral(exponent, factor, bound):
    radiance, (n, v) = lamps(), views(24, 0.2)
    lobe, narrow = fresnel_lobe.phong(exponent, factor)
    whole, parts = lobe_field.phong(radiance, exponent), lobe_field.phong(radiance, narrow).cubic()
    outside = factor((n * v).sum(1)) * whole(phong.reflect(v, n))
    truth = summed(radiance, exponent, factor, n, v)
    assert rms(outside + lobe(parts, n, v), truth) < bound
    # The sums' own error is 4·10⁻⁵.
    assert rms(outside + lobe(parts, n, v), truth) < max(fresnel_lobe.TOLERANCE * rms(outside, truth), 5e-5)


def test_a_constant_factor_adds_nothing_and_a_narrow_lobe_ever_less():
    lobe, _ = fresnel_lobe.phong(20.0, lambda c: np.full((*c.shape, 3), 0.7))
    assert np.abs(lobe.weights).max() < 1e-12
    sizes = []
    for exponent in (20.0, 200.0, 2000.0, 20000.0):
        lobe, _ = fresnel_lobe.phong(exponent, gold)
        sizes.append(np.abs(lobe.weights.sum(1))[:96].max())  # up to 67°
    assert all(after < 0.15 * before for before, after in pairwise(sizes)), sizes


def test_in_a_furnace_the_lobe_reflects_its_mean_fresnel_factor():
    n, v = views(20, 0.3)
    lobe, narrow = fresnel_lobe.phong(30.0, gold)
    field = lobe_field.phong(np.ones((9, 16, 3)), narrow).cubic()
    inside = gold((n * v).sum(1)) + lobe(field, n, v)
    np.testing.assert_allclose(inside, summed(np.ones((9, 16, 3)), 30.0, gold, n, v), rtol=2e-3)


def test_bands_of_a_tabulated_kernel_are_the_phong_lobe_s():
    bands = zonal.kernel_bands(lambda c: phong.phong_lobe(np.array([1.0, 30.0]), c[:, None]), 60)
    np.testing.assert_allclose(bands[:, 0], zonal.phong_bands(1.0, 60), atol=1e-12)
    np.testing.assert_allclose(bands[:, 1], zonal.phong_bands(30.0, 60), atol=1e-12)


def test_a_cubic_field_keeps_its_nodes():
    field = lobe_field.phong(lamps(), 50.0)
    d = latlong_directions(40, 80).reshape(-1, 3)
    assert np.abs(field.cubic()(d) - field(d)).max() < 2e-3 * field.largest.max()
    assert np.abs(field.cubic()(d) - field(d)).max() > 0
