"""The shadow techniques as they are drawn: against their float64 twins, and where there is nothing to shadow."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import registry, worker
from evalsuite.gpu.techniques import shadow
from evalsuite.lights import decompose
from evalsuite.lights.model import DecompositionSettings
from evalsuite.math import disc_coverage
from evalsuite.math.sphere import latlong_directions

from .helpers import camera, environment, material, scene, sphere_mesh, visible
from .test_shadow_wedges import box, quad

MATTE = material("diffuse", reflectance=(0.6, 0.5, 0.4))
GLOSSY = material("phong", exponent=30.0, specular_reflectance=(0.4, 0.4, 0.5), diffuse_reflectance=(0.3, 0.3, 0.2))


def lamps():
    """Two round lamps over a dim sky."""
    directions = latlong_directions(96, 192)
    radiance = np.full((96, 192, 3), 0.05) * [1.0, 1.1, 1.3]
    for centre, size, colour in (((0.5, 0.8, 0.3), 7.0, (9.0, 7.0, 5.0)), ((-0.6, 0.6, 0.5), 12.0, (1.5, 2.0, 2.5))):
        centre = np.array(centre) / np.linalg.norm(centre)
        radiance[directions @ centre > np.cos(np.radians(size))] = colour
    return environment(radiance)


def boxes_scene(env, subject, size=(96, 96)):
    return scene(env, subject, meshes=[quad(3.0), box((0.9, 1.3, 0.7))], view=camera(size, origin=(3.0, 4.0, 5.0), fov=40.0))


@pytest.mark.parametrize("subject", [MATTE, GLOSSY], ids=["diffuse", "phong"])
def test_wedges_are_their_twin(subject):
    env = lamps()
    s = boxes_scene(env, subject)
    drawing = worker.render(s, "shadow-wedges", {}, supersample=1)
    mask, normal, to_view = visible(s)
    positions = worker.gbuffer(s, 1).position[mask].astype(np.float64)
    caster = s.meshes[1]
    found = decompose.of(env, DecompositionSettings())
    assert len(found.lights) == 2
    triangles = caster.positions[caster.faces].astype(np.float64)
    covered = [
        np.clip(disc_coverage.coverage_of_triangles(positions, triangles, light.direction, light.angular_radius), 0.0, 1.0)
        for light in found.lights
    ]
    assert all(((c > 0.02) & (c < 0.98)).sum() > 40 for c in covered)
    settings = {**drawing.parameters, "visibility": 1.0 - np.stack(covered, axis=-1)}
    expected = registry.find("shadow-wedges").twin(env, normal, to_view, subject.parameters, settings)
    ground = np.abs(positions[:, 1]) < 1e-4
    error = np.abs(drawing.image[mask] - expected)[ground]
    assert error.max() < 2e-3 * expected.mean() and np.median(error) < 2e-4 * expected.mean()


@pytest.mark.parametrize("technique", ["shadow-none", "shadow-wedges"])
def test_an_even_environment_leaves_albedo_times_radiance(technique):
    s = boxes_scene(environment([0.7, 1.1, 2.0]), MATTE)
    drawing = worker.render(s, technique, {}, supersample=1)
    mask, *_ = visible(s)
    expected = np.array([0.7, 1.1, 2.0]) * MATTE.parameters["reflectance"]
    np.testing.assert_allclose(drawing.image[mask], np.broadcast_to(expected, (mask.sum(), 3)), rtol=2e-3)


def test_a_black_environment_is_black():
    drawing = worker.render(boxes_scene(environment(np.zeros((16, 32, 3))), MATTE), "shadow-wedges", {}, supersample=1)
    assert (drawing.image == 0.0).all()


def test_a_lone_convex_body_without_ground_has_only_its_own_terminator():
    s = scene(lamps(), MATTE, meshes=[sphere_mesh()])
    with_shadows = worker.render(s, "shadow-wedges", {}, supersample=1).image
    found = decompose.of(s.environment, DecompositionSettings())
    mask, normal, to_view = visible(s)
    well_lit = np.all([normal @ np.asarray(light.direction) > 0.35 for light in found.lights], axis=0)
    assert well_lit.sum() > 20
    settings = {"visibility": np.ones((well_lit.sum(), len(found.lights)))}
    expected = shadow.twin(s.environment, normal[well_lit], to_view[well_lit], MATTE.parameters, settings)
    np.testing.assert_allclose(with_shadows[mask][well_lit], expected, rtol=2e-3)


def test_time_of_shadows_is_told_apart():
    cost = worker.render(boxes_scene(lamps(), MATTE, (48, 48)), "shadow-wedges", {}, supersample=2).cost
    assert 0.0 < cost["shadow_ms"] < cost["gpu_ms"] and cost["prepare_ms"] > 0.0
    low, high = cost["gpu_ms_ci95"]
    assert low < cost["gpu_ms"] < high and low + high == pytest.approx(2 * cost["gpu_ms"])
    assert "gpu_ms_ci95" not in worker.render(boxes_scene(lamps(), MATTE, (48, 48)), "shadow-wedges", {}, supersample=1).cost


def test_lobes_of_two_exponents_are_refused_by_line():
    other = material("phong", name="other", exponent=80.0, specular_reflectance=(0.4,) * 3, diffuse_reflectance=(0.0,) * 3)
    ball = sphere_mesh(material=1)
    with pytest.raises(EvalsuiteError, match="one exponent"):
        worker.render(scene(lamps(), GLOSSY, other, meshes=[quad(3.0), ball]), "shadow-wedges", {}, supersample=1)


def test_fewer_lights_leave_more_to_the_rest():
    s = boxes_scene(lamps(), MATTE, (48, 48))
    pictures = [worker.render(s, "shadow-wedges", {"max_lights": n}, supersample=1).image for n in (0, 1, 2)]
    none = worker.render(s, "shadow-none", {}, supersample=1).image
    np.testing.assert_allclose(pictures[0], none, rtol=1e-5)
    assert np.abs(pictures[1] - none).max() > 0.05 and np.abs(pictures[2] - pictures[1]).max() > 0.02
