"""What the GPU side sees, against ray casting by hand."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.gpu import camera as gl_camera
from evalsuite.gpu import worker
from evalsuite.math.pixel import subsamples
from evalsuite.scene.model import Camera

from .helpers import FURNACE, look_at, material, scene, sphere_mesh


def _rays(view: Camera, s: int):
    """World origin and directions (H·s, W·s, 3) of all sub-samples, from the camera's definition."""
    width, height = view.size
    film, (x, y, *_) = view.film, view.crop
    c = 1 / np.tan(np.radians(view.fov_x_deg) / 2)
    # Pixel (i, j) has its sub-samples in block (i, j) of s × s.
    places = np.array(subsamples(s)).reshape(s, s, 2)
    px = np.repeat(np.arange(width), s) + np.tile(places[..., 0], (height, width))
    py = np.repeat(np.arange(height), s)[:, None] + np.tile(places[..., 1], (height, width))
    fx, fy = (px + x) / film[0] + view.principal_point[0], (py + y) / film[1] + view.principal_point[1]
    local = np.stack([(1 - 2 * fx) / c, (1 - 2 * fy) * film[1] / film[0] / c, np.ones_like(fx)], -1)
    return view.to_world[:3, 3], local @ view.to_world[:3, :3].T


@pytest.mark.parametrize("subsample", [(0.5, 0.5), (0.125, 0.875)])
def test_clip_matrix_and_view_rays_bring_a_sub_sample_to_its_pixels_centre(subsample):
    view = Camera(look_at((1, 2, 4)), 40.0, (64, 48), (8, 4, 48, 40), (0.03, 0.02))
    px, py = 10 + subsample[0], 7 + subsample[1]
    c = 1 / np.tan(np.radians(40.0) / 2)
    local = [(1 - 2 * ((px + 8) / 64 + 0.03)) / c, (1 - 2 * ((py + 4) / 48 + 0.02)) * 48 / 64 / c, 1.0]
    point = view.to_world @ np.array([*(3.0 * x for x in local), 1.0])
    clip = gl_camera.world_to_clip(view, 0.1, 100.0, subsample) @ point
    window = (clip[:2] / clip[3] + 1) / 2 * [48, 40]  # rows run upwards
    np.testing.assert_allclose(window, [10.5, 40 - 7.5], atol=1e-9)
    start, step = gl_camera.view_rays(view, subsample)
    np.testing.assert_allclose(start + step * window, local[:2], atol=1e-12)


def test_a_sphere_is_where_rays_meet_it():
    view = Camera(look_at((1, 2, 4)), 40.0, (64, 48), (8, 4, 48, 40), (0.03, 0.02))
    ball = sphere_mesh(256, 128, radius=0.8, centre=(0.2, -0.1, 0.3), material=1)
    g = worker.gbuffer(scene(FURNACE, material("diffuse"), material("phong"), meshes=[ball], view=view), 4)
    origin, d = _rays(view, 4)
    o = origin - np.array([0.2, -0.1, 0.3])
    a, b, c = (d * d).sum(-1), d @ o, o @ o - 0.64
    root = b * b - a * c
    hit = root > 0
    t = np.where(hit, (-b - np.sqrt(np.maximum(root, 0))) / a, 0)  # d has unit depth: t is depth along the axis

    def pixels(x):
        return x.reshape(40, 4, 48, 4, -1).sum((1, 3)).squeeze(-1) if x.ndim == 2 else x.reshape(40, 4, 48, 4, 3).sum((1, 3))

    hits = pixels(hit.astype(float))
    # 256 × 128 facets sink at most 1.5e-4 of the radius below the sphere: a sub-sample here and there at the rim.
    assert np.abs(g.coverage - hits / 16).max() <= 2 / 16 and np.abs(g.coverage - hits / 16).mean() < 1e-3
    np.testing.assert_array_equal(g.material[1], g.coverage)
    assert not g.material[0].any()
    steep = pixels((root / (a * 0.64)).clip(0)) / 16 < 0.1  # at the rim a facet's sag moves depth by much more
    inside = (hits == 16) & ~steep
    np.testing.assert_allclose(g.depth[inside], pixels(t)[inside] / 16, atol=2e-3)
    normal = pixels(np.where(hit[..., None], o + t[..., None] * d, 0))[inside]
    cosine = (normal / np.linalg.norm(normal, axis=-1, keepdims=True) * g.normal[inside]).sum(-1)
    assert cosine.min() > np.cos(np.radians(0.7))
    position = pixels(np.where(hit[..., None], origin + t[..., None] * d, 0))[inside] / 16
    np.testing.assert_allclose(g.position[inside], position, atol=3e-3)
    assert not g.normal[hits == 0].any() and not g.depth[hits == 0].any()


def test_the_nearer_mesh_hides_the_other():
    near, far = sphere_mesh(radius=0.5, centre=(0, 0, 1.5), material=0), sphere_mesh(material=1)
    for meshes in ((near, far), (far, near)):
        g = worker.gbuffer(scene(FURNACE, material("diffuse"), material("phong"), meshes=meshes), 2)
        assert g.material[0, 24, 24] == 1 and g.material[1, 24, 24] == 0
        np.testing.assert_allclose(g.material.sum(0), g.coverage)


def test_two_sided_backs_turn_their_normals():
    inside = Camera(look_at((0, 0, 0), (0, 0, -1)), 60.0, (8, 8), (0, 0, 8, 8))
    for two_sided, sign in ((True, 1), (False, -1)):
        g = worker.gbuffer(scene(FURNACE, material("diffuse", two_sided=two_sided), view=inside), 1)
        assert g.coverage.all()
        assert np.all(np.sign(g.normal[..., 2]) == sign)
