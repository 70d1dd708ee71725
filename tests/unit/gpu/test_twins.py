"""Every technique in the table against its float64 twin, under every built-in environment."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from evalsuite.gpu import context, worker
from evalsuite.gpu.reflection import reflection
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.scene import builtin
from evalsuite.scene.environment import read_environment
from evalsuite.scene.model import Environment, Material

from .helpers import rotation, scene, visible

#: The sampled oracle has a Z-test against quadrature instead (test_techniques); who draws a room or shadows, tests of its own.
TWINNED = [t for t in TECHNIQUES.values() if not t.random and not t.within_room and not t.casts_shadows]
GPU_BOUND = 0.05  # a real GPU rounds filter weights to 8 bits

# What float32 and the driver leave open, as perturbations of the twin's own inputs: where a map is steep they matter.
DIRECTION = 2e-6  # of n and v: a few roundings of interpolated positions and normals
ROTATION = 8e-6  # [rad] of the map: llvmpipe's atan errs by 3.4e-6 when the map is resampled
LAMBDA = 0.045  # [levels]: llvmpipe's log₂ for λ is up to 0.043 short
GPU_LAMBDA = 0.5  # GPUs may take any footprint between its longer side and the sum of both (OpenGL 4.5 core, 8.14.1)


@cache
def named(name: str) -> Environment:
    return read_environment(builtin.environment_path(name))


def target_material(technique) -> Material:
    """The technique's own target BSDF as `scene.load` files it."""
    parameters = dict(technique.target_bsdf(technique.defaults() | dict(technique.twin_settings)))
    plugin = str(parameters.pop("type"))
    if parameters.pop("material", None) == "none":
        parameters |= {"eta": 0.0, "k": 1.0}
    return Material("subject", plugin, parameters)


@pytest.mark.parametrize("name", builtin.ENVIRONMENTS)
@pytest.mark.parametrize("technique", TWINNED, ids=lambda t: t.id)
def test_shader_is_its_twin(technique, name):
    subject = target_material(technique)
    s = scene(named(name), subject, subject=("subject",), size=(32, 32))
    drawing = worker.render(s, technique.id, technique.twin_settings, supersample=1)
    mask, normal, to_view = visible(s)
    settings = dict(drawing.parameters)
    if "bias" in settings:
        settings["lambda"] = reflection(s, settings["face_size"], frozenset({0}))[1][mask]
    exact = context.is_software(context.get())
    twin = partial(_twin, technique, {**subject.parameters, "plugin": subject.plugin})
    value = twin(s.environment, normal, to_view, settings)
    others = _perturbed(twin, s.environment, normal, to_view, settings, exact)
    open_to = np.max([np.abs(other - value) for other in others], axis=0)
    front = (normal * to_view).sum(-1) > 1e-3
    mean = value[front].mean()
    assert front.sum() > 250 and mean > 1e-4
    bound = technique.twin_bound if exact else max(technique.twin_bound, GPU_BOUND)
    excess = np.abs(drawing.image[mask] - value) - bound * np.maximum(mean, np.abs(value)) - 2 * open_to
    assert excess[front].max() < 0, f"{(excess[front].max() / mean):.2g} of the mean beyond: {technique.twin_bound_reason}"
    assert (np.abs(drawing.image[mask] - value)[front].mean() / mean) < (0.02 if exact else 0.1)


def _twin(technique, material, environment, normal, to_view, settings):
    return technique.twin(environment, normal, to_view, material, settings)


def _perturbed(twin, environment, normal, to_view, settings, exact):
    """The twin's values for inputs as far off as float32 and the driver may be."""
    random = np.random.default_rng(1)
    for _ in range(3):
        n, v = (x + DIRECTION * random.normal(size=x.shape) for x in (normal, to_view))
        yield twin(environment, *(x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (n, v)), settings)
    if environment.radiance.std() > 0:
        turned = rotation(np.degrees(ROTATION)) @ environment.to_world
        yield twin(replace(environment, to_world=turned), normal, to_view, settings)
    if "lambda" in settings:
        for step in (-LAMBDA, LAMBDA) if exact else (-GPU_LAMBDA, GPU_LAMBDA):
            yield twin(environment, normal, to_view, {**settings, "lambda": settings["lambda"] + step})
