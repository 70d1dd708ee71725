"""Prefiltered maps against the lobe integral itself, on every built-in environment."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import environment as gpu_environment
from evalsuite.gpu import worker
from evalsuite.gpu.prefilter.lobe_map import lobe_map
from evalsuite.gpu.techniques.glossy_phong_map import default_face_size
from evalsuite.math import phong, zonal
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.scene import builtin
from evalsuite.scene.environment import read_environment

from .helpers import FURNACE, hardware_lookup, material, noise, rotation, scene, visible


def fibonacci(count: int) -> np.ndarray:
    """Directions spread evenly over the sphere."""
    y, phi = 1 - (2 * np.arange(count) + 1) / count, np.pi * (3 - np.sqrt(5)) * np.arange(count)
    sine = np.sqrt(1 - y * y)
    return np.stack([sine * np.cos(phi), y, sine * np.sin(phi)], -1)


def rel_rmse(found, truth) -> float:
    return float(np.sqrt(np.square(found - truth).mean()) / truth.mean())


@pytest.mark.parametrize("name", builtin.ENVIRONMENTS)
def test_diffuse_map_is_the_quadrature(name):
    env = read_environment(builtin.environment_path(name))
    n = fibonacci(150)
    light = latlong_directions(*env.radiance.shape[:2]).reshape(-1, 3)
    weights = env.radiance * latlong_solid_angles(*env.radiance.shape[:2])[..., None] / np.pi
    truth = np.maximum(n @ light.T, 0) @ weights.reshape(-1, 3)
    found = hardware_lookup(lobe_map(gpu_environment.of(env), 1.0, 64).texture, n, 0.0)
    assert rel_rmse(found, truth) < 2e-3


@pytest.mark.parametrize("exponent", [10.0, 500.0])
@pytest.mark.parametrize("name", builtin.ENVIRONMENTS)
def test_phong_map_is_the_unclipped_lobe_integral(name, exponent):
    """Truth in float64 by `zonal.convolve`, which test_zonal holds to quadrature; 6000 directions find the sun's lobe."""
    env = read_environment(builtin.environment_path(name))
    r = fibonacci(6000)
    truth = zonal.convolve(env.radiance, zonal.phong_bands(exponent, zonal.phong_degree(exponent)), r)
    found = hardware_lookup(lobe_map(gpu_environment.of(env), exponent, default_face_size(exponent)).texture, r, 0.0)
    assert truth.std() > 0.01 * truth.mean() or name == "furnace"
    assert rel_rmse(found, truth) < 5e-3


def test_a_lamp_of_one_texel_by_quadrature():
    """The steepest map there is, summed texel by texel: a hat two texels wide is narrow beside the lobe."""
    env = noise(129, 256)
    env.radiance[40, 50] = 5e4
    r = latlong_directions(129, 256)[40, 50] + 0.2 * np.random.default_rng(2).normal(size=(400, 3))
    r /= np.linalg.norm(r, axis=-1, keepdims=True)
    light = latlong_directions(129, 256).reshape(-1, 3)
    weights = (env.radiance * latlong_solid_angles(129, 256)[..., None]).reshape(-1, 3)
    truth = phong.phong_lobe(50.0, r @ light.T) @ weights
    found = hardware_lookup(lobe_map(gpu_environment.of(env), 50.0, 256).texture, r, 0.0)
    # Points instead of hats sharpen the truth by N δ²/6, δ = π/128: 0.5 % of the peak.
    assert np.abs(found - truth).max() < 7e-3 * truth.max() and rel_rmse(found, truth) < 8e-3


def test_poles_of_the_grid_show_nowhere():
    env = noise(65, 128)
    env.radiance[1, 20] = env.radiance[63, 90] = 900.0
    r = np.random.default_rng(3).normal(size=(400, 3)) * 0.1 + np.repeat([[0, 1, 0], [0, -1, 0]], 200, axis=0)
    r /= np.linalg.norm(r, axis=-1, keepdims=True)
    truth = zonal.convolve(env.radiance, zonal.phong_bands(60.0, zonal.phong_degree(60.0)), r)
    found = hardware_lookup(lobe_map(gpu_environment.of(env), 60.0, 256).texture, r, 0.0)
    assert np.abs(found - truth).max() < 3e-3 * truth.max()


def test_maps_turn_with_the_environment():
    turned = noise(to_world=rotation())
    r = fibonacci(200)
    bands = zonal.phong_bands(20.0, zonal.phong_degree(20.0))
    truth = zonal.convolve(turned.radiance, bands, r @ turned.to_world)
    assert rel_rmse(hardware_lookup(lobe_map(gpu_environment.of(turned), 20.0, 128).texture, r, 0.0), truth) < 1e-3


def test_a_map_is_made_once_and_sizes_follow_the_exponent():
    env = gpu_environment.of(noise())
    assert lobe_map(env, 20.0, 32) is lobe_map(env, 20.0, 32)
    assert [default_face_size(n) for n in (1, 10, 50, 500, 1e4)] == [64, 128, 256, 512, 1024]
    s = scene(noise(), material("phong", exponent=500.0))
    assert worker.resolve(s, "glossy-phong-map", {})["face_size"] == 512
    assert worker.resolve(s, "glossy-phong-map", {"exponent": 10})["face_size"] == 128


@pytest.mark.parametrize("exponent", [0.0, 0.5, 2e4])
def test_exponents_that_no_map_holds_are_refused(exponent):
    with pytest.raises(EvalsuiteError, match=r"exponent: .*1 to 10000"):
        worker.render(scene(FURNACE, material("phong", exponent=exponent)), "glossy-phong-map", {}, 1)


def test_picture_is_the_lobe_and_the_horizon_stays_unclipped():
    env = noise()
    s = scene(env, material("phong", exponent=12.0, specular_reflectance=(0.2, 0.5, 0.8)))
    image = worker.render(s, "glossy-phong-map", {}, 1).image
    mask, normal, to_view = visible(s)
    r = phong.reflect(to_view, normal)
    truth = np.array([0.2, 0.5, 0.8]) * zonal.convolve(env.radiance, zonal.phong_bands(12.0, zonal.phong_degree(12.0)), r)
    front = (normal * to_view).sum(-1) > 0
    assert rel_rmse(image[mask][front], truth[front]) < 1e-3
