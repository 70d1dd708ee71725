"""`acquire` against its float64 twin, against Mitsuba's radiance at the probe, and against what it must answer to."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rooms import COLOURS, box, scene, write_room

from evalsuite.compare.probe import compare_faces
from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import worker as gpu
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.math import cubemap, mesh_colors, sh
from evalsuite.reference import worker
from evalsuite.scene.builtin import scene_path
from evalsuite.scene.model import Material, Scene, SceneSource

ACQUIRE = TECHNIQUES["acquire"]
MATERIALS = {
    "diffuse": {"reflectance": (0.5, 0.6, 0.7)},
    "phong": {"exponent": 30.0, "specular_reflectance": (0.5, 0.6, 0.7), "diffuse_reflectance": (0.1, 0.2, 0.3)},
    "blinnphong": {"exponent": 12.0, "specular_reflectance": (0.5, 0.6, 0.7), "diffuse_reflectance": (0.0, 0.0, 0.0)},
}


@cache
def studio(**defines: str) -> Scene:
    """The built-in scene with its room baked, 32 × 32."""
    source = SceneSource(scene_path("near-field"), size=(32, 32), defines=defines)
    return replace(worker.load_model(source), room=baked())


@cache
def baked():
    return worker.bake_room(SceneSource(scene_path("near-field")))


def with_material(model: Scene, plugin: str) -> Scene:
    return replace(model, materials=(Material("subject", plugin, MATERIALS[plugin]),))


def faces(model: Scene, **given) -> np.ndarray:
    return gpu.render(model, "acquire", {"face_size": 16, **given}, supersample=1).probe["faces"]


@pytest.mark.parametrize("light", ["baked", "direct"])
@pytest.mark.parametrize("plugin", MATERIALS)
def test_shader_is_its_twin(plugin, light):
    model = with_material(studio(), plugin)
    drawing = gpu.render(model, "acquire", {"face_size": 16, "light": light}, supersample=1)
    seen = gpu.gbuffer(model, 1)
    mask = seen.coverage > 0
    to_view = model.camera.to_world[:3, 3] - seen.position[mask].astype(np.float64)
    to_view /= np.linalg.norm(to_view, axis=-1, keepdims=True)
    normal = seen.normal[mask].astype(np.float64)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    settings = {**drawing.parameters, "room": model.room}
    twin = ACQUIRE.twin(model.environment, normal, to_view, MATERIALS[plugin], settings)
    front = (normal * to_view).sum(-1) > 1e-3
    assert front.sum() > 400 and twin[front].mean() > 0.05
    difference = np.abs(drawing.image[mask] - twin)[front] / twin[front].mean()
    assert difference.max() < ACQUIRE.twin_bound, ACQUIRE.twin_bound_reason


def test_a_probe_of_six_colours_is_exact(tmp_path):
    write_room(tmp_path, box(1.0))
    source = scene(tmp_path)
    model = replace(worker.load_model(source), room=worker.bake_room(source))
    drawn = faces(model)
    np.testing.assert_allclose(drawn, np.broadcast_to(np.array(COLOURS)[:, None, None], drawn.shape), rtol=1e-5)
    image = gpu.render(model, "acquire", {"face_size": 16}, supersample=1).image
    normal = gpu.gbuffer(model, 1).normal[16, 16].astype(np.float64)
    exact = np.array(MATERIALS["diffuse"]["reflectance"]) / np.pi * sh.irradiance(sh.project_cube(drawn), normal)
    # Eight texels a face instead of sixteen, and the normal of the pixel's centre.
    np.testing.assert_allclose(image[16, 16], exact, rtol=2e-3)


@pytest.mark.parametrize("place", [(0.0, 1.2, 0.0), (-1.35, 1.2, 0.0), (1.2, 0.5, 0.9)])
def test_the_baked_probe_is_mitsubas_radiance_there(place):
    """Walls: what is left is the bake's noise of 3 % and its 12 cm lattice at shadow edges and contacts. All: 16 samples
    place a lamp's edge to 1/16 of a texel, and the lamp is 40 times as bright as the walls."""
    truth, error = worker.probe_room(SceneSource(scene_path("near-field")), place, 32, 0.03)
    drawn = faces(studio(), position=" ".join(map(str, place)), face_size=32)
    found = compare_faces(drawn, truth, error)
    assert found["standard_error"] < 0.031
    assert found["rel_rmse"] < 0.2 and found["rel_rmse_irradiance"] < 0.02 and abs(found["rel_bias"]) < 0.02
    walls = truth.max(axis=-1) < 1.0  # the lamp has 17
    assert 0.9 < walls.mean() < 0.999
    squares = ((drawn - truth) ** 2 - error**2)[walls]
    assert np.sqrt(squares.mean()) < 0.03 * truth[walls].mean()


def test_lamps_alone_leave_the_interreflection_out():
    place = (0.0, 1.2, 0.0)
    truth, error = worker.probe_room(SceneSource(scene_path("near-field")), place, 16, 0.03)
    found = compare_faces(faces(studio(), position="0 1.2 0", light="direct"), truth, error)
    assert -0.3 < found["rel_bias"] < -0.1 and 0.1 < found["rel_rmse_irradiance"] < 0.4


def test_a_moving_object_takes_its_probe_along():
    here, there = (gpu.render(studio(**d), "acquire", {"face_size": 16}, 1) for d in ({}, {"object_x": "0.5"}))
    assert here.parameters["position"] == pytest.approx((-1.35, 1.2, 0)) and there.parameters["position"][0] == pytest.approx(0.5)
    left = 1  # the red wall, 0.65 or 2.5 away, fills the face of either, but its neighbours' share changes
    assert np.abs(here.probe["faces"] - there.probe["faces"])[left].mean() > 0.01
    assert np.abs(here.image - there.image).mean() > 0.02
    assert here.cost["acquire_ms"] > 0 and here.cost["gpu_ms"] > here.cost["acquire_ms"]


def test_a_moving_lamp_moves_the_light():
    still = SceneSource(scene_path("near-field"))
    moved = worker.bake_room(replace(still, defines={"lamp_x": "1"}))
    emitting = [room.corners[_shines(room)].mean((0, 1)) for room in (baked(), moved)]
    np.testing.assert_allclose(emitting[1] - emitting[0], [1, 0, 0], atol=1e-5)
    for light in ("baked", "direct"):
        a, b = (faces(replace(studio(), room=room), position="0 1.2 0", light=light) for room in (baked(), moved))
        right, left = 0, 1
        assert b[right].mean() > 1.2 * a[right].mean() and b[left].mean() < 0.95 * a[left].mean()


def _shines(room) -> np.ndarray:
    return np.add.reduceat(room.emission.max(1), mesh_colors.first_sample(room.divisions)) > 0


def test_an_open_room_is_black_and_says_so(tmp_path):
    write_room(tmp_path, box(1.0).replace("<shape", "<!--", 1).replace("</shape>", "-->", 1))
    source = scene(tmp_path)
    model = replace(worker.load_model(source), room=worker.bake_room(source))
    drawing = gpu.render(model, "acquire", {"face_size": 16}, 1)
    assert not drawing.probe["faces"][0].any() and drawing.probe["faces"][1].all()
    assert any("leaves 16.7% of the sphere open" in note for note in drawing.notes)


def test_backs_of_walls_hide_what_is_behind(tmp_path):
    """A one-sided screen with its back to the probe is black there, and no window."""
    screen = '<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-0.5"/></transform></shape>'
    write_room(tmp_path, box(4.0, extra=screen.replace('z="-0.5"', 'z="0.5"')))
    source = scene(tmp_path)
    drawn = faces(replace(worker.load_model(source), room=worker.bake_room(source)))
    assert not drawn[4, 2:-2, 2:-2].any() and drawn[5].all()


def test_a_scene_without_a_room_is_refused():
    model = replace(studio(), room=None)
    with pytest.raises(EvalsuiteError, match="a scene without a room"):
        gpu.render(model, "acquire", {}, 1)
    with pytest.raises(EvalsuiteError, match="the scene names no room"):
        gpu.render(replace(model, room_file=None), "acquire", {}, 1)


def test_solid_angle_of_the_probe_is_whole():
    assert 6 * cubemap.texel_solid_angles(16).sum() == pytest.approx(4 * np.pi)
    assert not any("open" in note for note in gpu.render(studio(), "acquire", {"face_size": 16}, 1).notes)
