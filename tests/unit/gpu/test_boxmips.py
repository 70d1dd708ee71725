"""Explicit levels, plain and filtered across faces: the GPU's chain, Fig 4 of Kautz et al. in numbers, and their worth."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.gpu import environment as gpu_environment
from evalsuite.gpu import worker
from evalsuite.gpu.prefilter.seamless_mips import seamless_cube
from evalsuite.gpu.reflection import reflection
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.math import cubemap, phong, seamless_mips, zonal
from evalsuite.scene import builtin
from evalsuite.scene.environment import read_environment

from .helpers import FURNACE, material, noise, rotation, scene, visible

ROUGH = material("phong", exponent=20.0)


def coloured_cube():
    return read_environment(builtin.environment_path("coloured-cube"))


@pytest.mark.parametrize("make", [coloured_cube, lambda: noise(33, 64, to_world=rotation())], ids=["coloured-cube", "noise"])
def test_every_level_on_the_gpu_is_the_float64_chain(make):
    env = gpu_environment.of(make())
    made = seamless_cube(env, 32)
    expected = seamless_mips.seamless_mips(env.cube(32).level0)
    assert [level.shape[1] for level in made.sampler.levels] == [32, 16, 8, 4, 2, 1]
    for found, level in zip(made.sampler.levels, expected, strict=True):
        np.testing.assert_allclose(found, level, atol=2e-6 * expected[0].max())
    np.testing.assert_allclose(made.mean, cubemap.integral(expected[0]) / (4 * np.pi), rtol=1e-6)
    assert seamless_cube(env, 32) is made


def test_six_colours_show_at_a_bias_of_9_4_and_vanish_across_faces():
    s = scene(coloured_cube(), ROUGH, size=(64, 64), origin=(2.2, 1.1, 3.4), fov=30.5)
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0
    pictures = {name: worker.render(s, name, {"bias": 9.4}, 1).image[mask][front]
                for name in ("glossy-boxmip", "glossy-boxmip-seamless")}  # fmt: skip
    spread = {name: float((p.max(0) - p.min(0)).max() / p.mean()) for name, p in pictures.items()}
    assert spread["glossy-boxmip"] > 1.5
    assert spread["glossy-boxmip-seamless"] < 0.01
    np.testing.assert_allclose(pictures["glossy-boxmip-seamless"].mean(), pictures["glossy-boxmip"].mean(), rtol=0.2)


def test_the_chain_itself_halves_the_contrast_of_the_faces():
    """At the 1 × 1 level, before the mean of the sphere takes over: what filtering across faces does by itself."""
    level0 = gpu_environment.of(coloured_cube()).cube(64).level0
    plain, across = cubemap.box_mips(level0)[-1], seamless_mips.seamless_mips(level0)[-1]
    contrast = [np.ptp(level, axis=0).max() / level.mean() for level in (plain, across)]
    assert contrast[0] > 1.8 and contrast[1] < 0.53 * contrast[0]


@pytest.mark.parametrize(("name", "exponent"), [("office", 5.0), ("office", 50.0), ("cathedral", 5.0), ("cathedral", 50.0)])
def test_across_faces_is_nearer_the_lobe_where_faces_matter(name, exponent):
    env = read_environment(builtin.environment_path(name))
    level0, r = gpu_environment.of(env).cube(128).level0, np.random.default_rng(5).normal(size=(1500, 3))
    r /= np.linalg.norm(r, axis=-1, keepdims=True)
    truth = zonal.convolve(env.radiance, zonal.phong_bands(exponent, zonal.phong_degree(exponent)), r)
    plain = cubemap.SeamlessCube(cubemap.box_mips(level0)).lookup(r, phong.exponent_to_lod(exponent, 128))
    chain = cubemap.SeamlessCube(seamless_mips.seamless_mips(level0))
    across = chain.lookup(r, seamless_mips.exponent_to_seamless_lod(exponent, 128))
    error = [np.sqrt(np.square(found - truth).mean()) / truth.mean() for found in (plain, across)]
    assert error[1] < 0.8 * error[0]


def test_the_shader_forms_lambda_itself():
    """With a bias, too, the shader is its twin: level λ + b from screen derivatives, on every driver alike."""
    s = scene(noise(65, 128), ROUGH)
    drawing = worker.render(s, "glossy-boxmip-seamless", {"bias": 1.3}, 1)
    _, lod, _ = reflection(s, drawing.parameters["face_size"], frozenset({0}))
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 1e-3
    settings = {**drawing.parameters, "lambda": lod[mask]}
    twin = TECHNIQUES["glossy-boxmip-seamless"].twin(s.environment, normal, to_view, ROUGH.parameters, settings)
    np.testing.assert_allclose(drawing.image[mask][front], twin[front], atol=1e-3 * twin.mean())
    mean = float(lod[reflection(s, 32, frozenset({0}))[2]].mean())
    assert drawing.parameters["exponent"] == pytest.approx(seamless_mips.seamless_lod_to_exponent(mean + 1.3, 32), rel=1e-5)


def test_explicit_level_is_the_bias_with_lambda_taken_out():
    s = scene(noise(65, 128), material("phong", exponent=40.0))
    drawing = worker.render(s, "glossy-boxmip-lod", {}, 1)
    mask, normal, to_view = visible(s)
    cube = cubemap.SeamlessCube(cubemap.box_mips(gpu_environment.of(s.environment).cube(32).level0))
    expected = cube.lookup(phong.reflect(to_view, normal), float(phong.exponent_to_lod(40.0, 32)))
    front = (normal * to_view).sum(-1) > 1e-3
    np.testing.assert_allclose(drawing.image[mask][front], expected[front], atol=1e-3 * expected.mean())
    assert 4 < drawing.fit["exponent"] < 400


def test_fits_and_furnace():
    s = scene(noise(65, 128), material("phong", exponent=40.0))
    assert 4 < worker.render(s, "glossy-boxmip-seamless", {}, 1).fit["exponent"] < 400
    assert worker.render(s, "glossy-boxmip-seamless", {"bias": 1.0}, 1).fit["rel_rmse"] < 1
    furnace = worker.render(scene(FURNACE, ROUGH), "glossy-boxmip-seamless", {}, 1)
    assert furnace.fit is None
    np.testing.assert_allclose(furnace.image[24, 24], FURNACE.radiance[0, 0], rtol=1e-5)
