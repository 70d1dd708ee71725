"""Structured importance samples: energy kept, where the light is, and better than as many samples by luminance."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.lights.structured import structured
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles


def lamps(seed=0):
    random = np.random.default_rng(seed)
    directions, image = latlong_directions(64, 128), np.full((64, 128, 3), 0.05)
    for _ in range(4):
        centre = random.normal(size=3)
        image[directions @ (centre / np.linalg.norm(centre)) > np.cos(random.uniform(0.05, 0.3))] += random.uniform(0.5, 8.0, 3)
    return image.astype(np.float32)


@pytest.mark.parametrize("count", [1, 3, 30, 500])
def test_energy_is_kept(count):
    image = lamps()
    found = structured(image, count)
    assert 1 <= len(found.directions) <= count
    whole = np.einsum("yxc,yx->c", image.astype(np.float64), latlong_solid_angles(64, 128))
    np.testing.assert_allclose(found.irradiances.sum(0), whole, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found.directions, axis=1), 1.0)


def test_no_light_no_samples():
    assert len(structured(np.zeros((16, 32, 3), np.float32), 10).directions) == 0


def test_irradiance_converges():
    """E of many normals from the samples against the sum over all texels."""
    image = lamps(1)
    normals = np.random.default_rng(2).normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    omega = latlong_solid_angles(64, 128)[..., None]
    cosine = np.maximum(latlong_directions(64, 128).reshape(-1, 3) @ normals.T, 0.0)
    exact = cosine.T @ (image * omega).reshape(-1, 3)
    errors = []
    for count in (30, 300, 1000):
        found = structured(image, count)
        estimate = np.maximum(found.directions @ normals.T, 0.0).T @ found.irradiances
        errors.append(np.sqrt(((estimate - exact) ** 2).mean()) / exact.mean())
    assert errors[2] < errors[1] < errors[0] and errors[2] < 0.005


def test_the_same_again():
    one, other = structured(lamps(), 50), structured(lamps(), 50)
    assert np.array_equal(one.directions, other.directions) and np.array_equal(one.irradiances, other.irradiances)
