"""Shadow maps: hard shadows against rays, means of them, and percentage-closer soft shadows beside a straight edge."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.gpu import registry, worker
from evalsuite.gpu.techniques.shadow_sampled import samples
from evalsuite.lights import decompose
from evalsuite.lights.model import DecompositionSettings
from evalsuite.math import disc_coverage
from evalsuite.math.sphere import latlong_directions

from .helpers import camera, environment, scene, visible
from .test_shadow_techniques import MATTE, boxes_scene, lamps
from .test_shadow_wedges import flat, quad


def seen(points, triangles, to_light, nearest=2e-3):
    """Whether rays from points (P, 3) towards one direction meet no triangle: (P,)."""
    e1, e2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(to_light, e2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / (e1 * p).sum(-1)
        s = points[:, None] - triangles[None, :, 0]
        u, q = (s * p).sum(-1) * inverse, np.cross(s, e1)
        v, t = q @ to_light * inverse, (q * e2).sum(-1) * inverse
    return ~((u >= 0) & (v >= 0) & (u + v <= 1) & (t > nearest)).any(axis=1)


def test_sampled_lights_are_their_twin_along_the_same_rays():
    s = boxes_scene(lamps(), MATTE, (64, 64))
    drawing = worker.render(s, "shadow-sampled", {"samples": 8, "map_size": 2048}, supersample=1)
    mask, normal, to_view = visible(s)
    positions = worker.gbuffer(s, 1).position[mask].astype(np.float64)
    triangles = np.concatenate([m.positions[m.faces] for m in s.meshes]).astype(np.float64)
    found = samples(s.environment, drawing.parameters)
    assert len(found.to_light) == 16
    visibility = np.stack([seen(positions, triangles, towards) for towards in found.to_light], axis=-1).astype(float)
    twin = registry.find("shadow-sampled").twin
    expected = twin(s.environment, normal, to_view, MATTE.parameters, {**drawing.parameters, "visibility": visibility})
    error = np.abs(drawing.image[mask] - expected).max(-1) / expected.mean()
    # A pixel within a texel of some hard edge may fall to either side of it: a sixteenth of the light.
    assert 0.1 < (visibility.min(1) == 0).mean() < 0.9
    assert np.median(error) < 1e-4 and (error > 2e-3).mean() < 0.03 and error.max() < 0.5


@pytest.mark.parametrize("technique", ["shadow-sampled", "shadow-pcss"])
def test_nothing_in_between_nothing_hidden(technique):
    """The ground alone: no acne at any light."""
    s = scene(lamps(), MATTE, meshes=[quad(3.0)], view=camera((64, 64), origin=(3.0, 4.0, 5.0), fov=40.0))
    drawing = worker.render(s, technique, {}, supersample=1)
    mask, normal, to_view = visible(s)
    twin = registry.find(technique).twin
    found = decompose.of(s.environment, DecompositionSettings.of(drawing.parameters))
    count = len(found.lights) * (drawing.parameters.get("samples", 1))
    settings = {**drawing.parameters, "visibility": np.ones((mask.sum(), count))}
    expected = twin(s.environment, normal, to_view, MATTE.parameters, settings)
    np.testing.assert_allclose(drawing.image[mask], expected, rtol=3e-4)


@pytest.mark.parametrize("technique", ["shadow-sampled", "shadow-pcss"])
def test_no_lights_leave_the_ambient_light(technique):
    s = boxes_scene(environment([0.7, 1.1, 2.0]), MATTE, (48, 48))
    drawing, none = (worker.render(s, t, {}, supersample=1).image for t in (technique, "shadow-none"))
    np.testing.assert_allclose(drawing, none, rtol=1e-5)


@pytest.mark.parametrize("technique, bound", [("shadow-pcss", 0.03), ("shadow-sampled", 0.02)])
def test_penumbra_of_a_straight_edge(technique, bound):
    """A wide board under a lamp overhead: V = ½ + (x√(1−x²) + asin x)/π; root mean square over the penumbra."""
    radiance = np.full((96, 192, 3), 1e-3)
    radiance[latlong_directions(96, 192)[..., 1] > np.cos(np.radians(9.0))] = 10.0
    height, env = 1.0, environment(radiance)
    corners = np.array([[0, height, -9], [0, height, 9], [9, height, 9], [9, height, -9]])
    board = flat(np.array([corners[[0, 1, 2]], corners[[0, 2, 3]]]))
    s = scene(env, MATTE, meshes=[quad(2.0), board], view=camera((96, 96), origin=(-3.5, 0.9, 0.6), fov=34.0))
    drawing = worker.render(s, technique, {"map_size": 2048}, supersample=1)
    (light,) = decompose.of(env, DecompositionSettings.of(drawing.parameters)).lights
    mask, *_ = visible(s)
    positions = worker.gbuffer(s, 1).position[mask].astype(np.float64)
    ground = np.abs(positions[:, 1]) < 1e-4
    x = -positions[ground][:, 0] / (height * np.tan(light.angular_radius))
    value = drawing.image[mask][ground][:, 0]
    full = np.median(value[x > 1.2])
    penumbra = np.abs(x) < 0.95
    assert penumbra.sum() > 150
    error = value[penumbra] / full - disc_coverage.half_plane(x[penumbra])
    # Samples are even in solid angle and weighted by their cosine, the formula even in the plane: 1 % at 9°.
    assert np.sqrt((error**2).mean()) < bound and np.abs(error.mean()) < 0.015


def test_samples_converge():
    """To many more samples, at 1/√n or better."""
    s = boxes_scene(lamps(), MATTE, (64, 64))
    pictures = {n: worker.render(s, "shadow-sampled", {"samples": n}, supersample=1).image for n in (4, 16, 64, 512)}
    errors = [np.sqrt(((pictures[n] - pictures[512]) ** 2).mean()) for n in (4, 16, 64)]
    assert errors[1] < errors[0] / 2 and errors[2] < errors[1] / 2


def test_the_whole_map_by_structured_samples():
    """1024 samples light an unshadowed ground as the prefiltered map does."""
    s = scene(lamps(), MATTE, meshes=[quad(3.0)], view=camera((48, 48), origin=(3.0, 4.0, 5.0), fov=40.0))
    sampled = worker.render(s, "shadow-sampled", {"sampling": "structured", "samples": 512}, supersample=1)
    plain = worker.render(s, "shadow-none", {}, supersample=1)
    mask, *_ = visible(s)
    np.testing.assert_allclose(sampled.image[mask], plain.image[mask], rtol=0.01)


def test_a_thin_sheet_casts_from_both_sides():
    view = camera((64, 64), origin=(3.0, 4.0, 5.0), fov=40.0)
    up, down, none = (
        worker.render(scene(lamps(), MATTE, meshes=meshes, view=view), "shadow-pcss", {}, supersample=1).image
        for meshes in ([quad(3.0), quad(0.6, 1.0, True)], [quad(3.0), quad(0.6, 1.0, False)], [quad(3.0)])
    )
    on_ground = np.abs(up - down).max(-1) < 0.02 * none.mean()
    assert on_ground.mean() > 0.8, "all but the sheet itself, which is lit on one side"
    darker = (none - up).max(-1) > 0.2 * none.mean()
    assert (darker & on_ground).mean() > 0.02
