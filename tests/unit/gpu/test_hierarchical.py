"""glossy-hierarchical on the GPU: its switches, its seam, its look-up."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import environment as gpu_environment
from evalsuite.gpu import worker
from evalsuite.gpu.prefilter.hierarchical import hierarchical_maps
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.math import phong, zonal

from .helpers import FURNACE, material, noise, rotation, scene, visible

TECHNIQUE = TECHNIQUES["glossy-hierarchical"]


@pytest.mark.parametrize("given", [{}, {"cutoff": 1e-4}, {"taps": 64}, {"cutoff": 0.01, "taps": 64, "border": 16.0}, {"taps": 3}])
def test_shader_is_its_twin_with_either_limit_off(given):
    subject = material("phong", exponent=40.0, specular_reflectance=(0.5, 0.6, 0.7))
    s = scene(noise(33, 64, to_world=rotation()), subject)
    drawing = worker.render(s, TECHNIQUE.id, {"map_size": 64, **given}, 1)
    mask, normal, to_view = visible(s)
    twin = TECHNIQUE.twin(s.environment, normal, to_view, subject.parameters, drawing.parameters)
    front = (normal * to_view).sum(-1) > 1e-3
    assert front.sum() > 500
    np.testing.assert_allclose(drawing.image[mask][front], twin[front], atol=3e-4 * twin.mean())


def test_kernels_and_levels_are_reported():
    env = gpu_environment.of(noise())
    maps = hierarchical_maps(env, 50.0, 0.1, 7, 128, 16.0)
    assert max(maps.widths) <= 7 and maps.levels == (2, 2)
    assert hierarchical_maps(env, 50.0, 0.1, 7, 128, 16.0) is maps
    drawing = worker.render(scene(noise(), material("phong", exponent=50.0)), TECHNIQUE.id, {"map_size": 128}, 1)
    assert "1/4 and 1/4" in drawing.notes[0] and drawing.parameters["border"] == 16


def test_lifting_both_limits_comes_nearer_the_lobe_in_a_smooth_map():
    v = np.linspace(0, np.pi, 65)[:, None]
    u = (np.arange(128) + 0.5) / 128 * 2 * np.pi
    smooth = noise(65, 128)
    smooth.radiance[...] = (1 + 0.6 * np.cos(3 * u) * np.sin(v) ** 3 + 0.3 * np.cos(v))[..., None]
    s = scene(smooth, material("phong", exponent=30.0))
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0
    r = phong.reflect(to_view, normal)[front]
    truth = zonal.convolve(smooth.radiance, zonal.phong_bands(30.0, zonal.phong_degree(30.0)), r)

    def error(**given):
        image = worker.render(s, TECHNIQUE.id, {"map_size": 128, "border": 32.0, **given}, 1).image[mask][front]
        return float(np.sqrt(np.square(image - truth).mean()) / truth.mean())

    published, free = error(), error(cutoff=1e-4, taps=128)
    assert published < 0.05 and free < 0.02


def test_furnace_and_refusals():
    image = worker.render(scene(FURNACE, material("phong", exponent=20.0)), TECHNIQUE.id, {"map_size": 64}, 1).image
    np.testing.assert_allclose(image[24, 24], FURNACE.radiance[0, 0], rtol=1e-5)
    for given in ({"cutoff": 0.0}, {"taps": 2}, {"map_size": 100}, {"exponent": 0.5}):
        with pytest.raises(EvalsuiteError, match=next(iter(given))):
            worker.resolve(scene(FURNACE, material("phong", exponent=20.0)), TECHNIQUE.id, given)
