"""The near field: equal to `path` when the room is far away, different when it is near; the bake and Mitsuba's own probe."""

from __future__ import annotations

import numpy as np
import pytest
from rooms import COLOURS, box, scene, write_room

from evalsuite.compare.probe import compare_faces
from evalsuite.errors import EvalsuiteError
from evalsuite.math import cubemap, mesh_colors
from evalsuite.reference import worker
from evalsuite.scene.builtin import environment_path
from evalsuite.scene.model import SceneSource

CUBE = f'<emitter type="envmap"><string name="filename" value="{environment_path("coloured-cube")}"/></emitter>'


def pictures(source: SceneSource, *targets):
    mask = worker.gbuffer(source).coverage == 1.0
    assert mask.sum() > 250
    return [worker.advance(source, target, None, 8) for target in targets], mask


def test_a_room_as_far_as_the_environment_is_the_environment(tmp_path):
    write_room(tmp_path, box(1e4))
    (far, path), mask = pictures(scene(tmp_path, emitter=CUBE), "near-field", "path")
    z = ((far.mean - path.mean) / np.hypot(far.standard_error, path.standard_error))[mask]
    assert abs(far.mean[mask].mean() / path.mean[mask].mean() - 1) < 2e-3
    # Eight passes each: Student's t, which has a deviation of √(14/12).
    assert z.std() < 1.25 and abs(z.mean()) < 0.2


def test_a_near_room_is_not(tmp_path):
    write_room(tmp_path, box(1.0))
    (near, path), mask = pictures(scene(tmp_path, emitter=CUBE, object_x="-0.7"), "near-field", "path")
    assert np.abs(near.mean - path.mean)[mask].mean() > 0.1 * path.mean[mask].mean()


def test_objects_darken_the_room_that_lights_them(tmp_path):
    """Walls that shine 1 and reflect ½ have L = 2 without the sphere in between, and less with it; least with a dark one."""
    write_room(tmp_path, box(1.0, [(1.0, 1.0, 1.0)] * 6, [0.5] * 6))
    (inside,), mask = pictures(scene(tmp_path), "near-field")
    ratio = inside.mean[mask].mean(0) / (2.0 * np.array([0.5, 0.6, 0.7]))
    assert (ratio < 0.999).all() and (ratio > 0.95).all() and (np.diff(ratio) > 0).all()


def test_a_room_that_hides_the_object_is_refused(tmp_path):
    screen = '<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><translate z="0.4"/></transform></shape>'
    write_room(tmp_path, box(2.0, extra=screen))
    with pytest.raises(EvalsuiteError, match=r"a room that hides \d+ of the objects' \d+ pixels"):
        worker.advance(scene(tmp_path), "near-field", None, 1)


def test_a_bake_holds_the_light_of_every_wall(tmp_path):
    """Walls that shine alike and reflect ρ = 0.5: L = 1/(1 − ρ) = 2 on all of them, in corners too; backs are black."""
    write_room(tmp_path, box(1.0, [(1.0, 1.0, 1.0)] * 6, [0.5] * 6))
    room = worker.bake_room(scene(tmp_path))
    samples = mesh_colors.sample_count(room.divisions)
    assert len(room.corners) == 24 and len(room.radiance) == samples.sum() and room.standard_error < 0.031
    front, back = np.split(room.radiance, [samples[:12].sum()])
    assert not back.any() and (room.divisions[12:] == 1).all() and room.divisions[:12].min() >= 32
    assert front.mean() == pytest.approx(2.0, abs=5e-3) and np.abs(front - 2.0).max() < 0.3
    np.testing.assert_allclose(room.emission[: len(front)], 1.0, rtol=1e-6)
    np.testing.assert_allclose(room.reflectance[: len(front)], 0.5, rtol=1e-6)
    centres = room.corners[:12].mean(1)
    normals = np.cross(room.corners[:12, 1] - room.corners[:12, 0], room.corners[:12, 2] - room.corners[:12, 0])
    assert ((centres * normals).sum(1) < 0).all()  # seen from inside


def test_the_light_of_a_shining_floor_on_the_ceiling(tmp_path):
    """Only the floor shines and only the ceiling reflects: L = ρE/π, E at its middle and corner by Howell's B-3."""
    colours, reflectances = [(0.0, 0.0, 0.0)] * 6, [0.0] * 6
    colours[3], reflectances[2] = (2.0, 1.0, 0.5), 0.8
    write_room(tmp_path, box(1.0, colours, reflectances))
    room = worker.bake_room(scene(tmp_path))
    ceiling = 4  # two triangles a wall, +y the third
    corner, n = room.corners[ceiling], int(room.divisions[ceiling])
    uv, first = mesh_colors.lattice(n), mesh_colors.first_sample(room.divisions)[ceiling]
    points = corner[0] + uv[:, :1] * (corner[1] - corner[0]) + uv[:, 1:] * (corner[2] - corner[0])
    for place, a, quarters in ((np.array([0, 1, 0]), 1.0, 4), (corner[0], 2.0, 1)):
        nearest = np.linalg.norm(points - place, axis=1).argmin()
        x = a / np.hypot(a, 2.0)
        expected = 0.8 / np.pi * quarters * x * np.arctan(x) * np.array([2.0, 1.0, 0.5])
        assert np.linalg.norm(points[nearest] - place) < 1e-5
        np.testing.assert_allclose(room.radiance[first + nearest], expected, rtol=0.06)  # its noise
    assert room.emission[room.emission[:, 0] > 0][0].tolist() == [2.0, 1.0, 0.5]


def test_mitsubas_probe_sees_six_colours(tmp_path):
    write_room(tmp_path, box(1.0))
    truth, error = worker.probe_room(scene(tmp_path), (0.0, 0.0, 0.0), 8, 0.02)
    np.testing.assert_allclose(truth, np.broadcast_to(np.array(COLOURS)[:, None, None], (6, 8, 8, 3)), rtol=1e-5)
    assert error.max() < 1e-5


def test_what_a_probe_is_charged_with():
    random = np.random.default_rng(5)
    truth = 1.0 + random.random((6, 8, 8, 3))
    error = np.full_like(truth, 0.05)
    found = compare_faces(truth + 0.05 * random.normal(size=truth.shape), truth, error)
    assert found["rel_rmse"] < 0.012 and found["rel_bias"] == pytest.approx(0, abs=3e-3)  # noise is not the probe's
    off = truth.copy()
    off[2] *= 1.5
    found, omega = compare_faces(off, truth, 0 * error), cubemap.texel_solid_angles(8)[..., None]
    mean = (truth * omega).sum() / (12 * np.pi)
    assert found["rel_rmse_faces"][2] == pytest.approx(np.sqrt(((0.5 * truth[2]) ** 2 * omega).sum() / omega.sum() / 3) / mean)
    assert found["rel_rmse"] == pytest.approx(found["rel_rmse_faces"][2] / np.sqrt(6))
    assert found["rel_bias"] == pytest.approx(((off - truth) * omega).sum() / (12 * np.pi) / mean)
    assert 0.05 < found["rel_rmse_irradiance"] < 0.3
