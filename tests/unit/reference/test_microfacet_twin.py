"""math.microfacet against Mitsuba's own roughconductor: values, and the albedo that techniques are held to."""

import numpy as np
import pytest

from evalsuite.math import fresnel, microfacet
from evalsuite.reference.variants import activate

mi = activate()
import drjit as dr  # noqa: E402 (after activate, which chooses the LLVM)

GOLD = {"eta": (0.2, 0.9, 1.1), "k": (3.9, 2.4, 2.2)}


def evaluate(distribution, alpha, view, light):
    index = {name: {"type": "rgb", "value": list(value)} for name, value in GOLD.items()}
    bsdf = mi.load_dict({"type": "roughconductor", "distribution": distribution, "alpha": alpha, **index})
    si = dr.zeros(mi.SurfaceInteraction3f, len(light))
    si.wi = mi.Vector3f(np.ascontiguousarray(np.broadcast_to(view, light.shape).T.astype(np.float32)))
    return np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(np.ascontiguousarray(light.T.astype(np.float32))))).T


def hemisphere(count, seed):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@pytest.mark.parametrize("alpha", [0.05, 0.3, 0.9])
@pytest.mark.parametrize("distribution", microfacet.DISTRIBUTIONS)
def test_values(distribution, alpha):
    view, light = hemisphere(4000, 1), hemisphere(4000, 2)
    half = (view + light) / np.linalg.norm(view + light, axis=1, keepdims=True)
    mine = microfacet.lobe(distribution, alpha, view[:, 2], light[:, 2], half[:, 2])[:, None]
    mine = mine * fresnel.fresnel_conductor((view * half).sum(-1)[:, None], GOLD["eta"], GOLD["k"])
    assert mine.mean() > 0.03
    np.testing.assert_allclose(evaluate(distribution, alpha, view, light), mine, rtol=1e-4, atol=1e-6)  # float32


@pytest.mark.parametrize("distribution", microfacet.DISTRIBUTIONS)
def test_albedo(distribution):
    """Mitsuba's BSDF summed over the hemisphere of l, midpoints of (n·l, φ)."""
    z, phi = np.meshgrid((np.arange(700) + 0.5) / 700, (np.arange(700) + 0.5) / 700 * np.pi, indexing="ij")
    light = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1).reshape(-1, 3)
    for cosine in (0.9, 0.25):
        view = np.array([np.sqrt(1 - cosine**2), 0, cosine])
        theirs = 2 * np.pi * evaluate(distribution, 0.3, view, light).mean(0)
        mine = microfacet.albedo(distribution, 0.3, [cosine], lambda c: fresnel.fresnel_conductor(c[..., None], **GOLD))
        np.testing.assert_allclose(mine[0], theirs, atol=1.5e-3)
