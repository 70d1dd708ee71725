"""Scene parameters: found without Mitsuba, given to it, refused by name; and the room that a scene names."""

from __future__ import annotations

import numpy as np
import pytest
from rooms import box, scene, write_room

from evalsuite.errors import EvalsuiteError
from evalsuite.plan import Choice, load_report, parse_parameters, plan
from evalsuite.reference import worker
from evalsuite.scene import builtin
from evalsuite.scene.dependencies import dependencies, names_id, parameters, room_path


def test_parameters_of_a_scene_and_of_its_room(tmp_path):
    source = scene(tmp_path)
    lamp = '<default name="lamp_y" value="0.5"/><shape type="sphere" id="subject"/>'
    write_room(tmp_path, box(2.0, extra=lamp))
    write_room(tmp_path, box(3.0), "other.xml")
    (tmp_path / "wood.exr").write_bytes(b"")
    assert parameters(source.path) == {"lamp_y": "0.5", "room": "room.xml", "object_x": "0"}
    assert "lamp_y" not in parameters(source.path, {"room": "other.xml"})
    assert room_path(source.path, {"room": "other.xml"}) == (tmp_path / "other.xml").resolve()
    assert {p.name for p in dependencies(source.path)} == {"scene.xml", "room.xml"}
    assert {p.name for p in dependencies(source.path, {"room": "other.xml"})} == {"scene.xml", "room.xml", "other.xml"}
    write_room(tmp_path, box(2.0, extra='<default name="f" value="wood"/><texture filename="$f.exr"/>'))
    assert "wood.exr" in {p.name for p in dependencies(source.path)}  # what the room needs decides the scene too
    assert names_id(source.path, "subject") and not names_id(source.path, "nothing")


def test_a_room_that_is_not_there_is_refused(tmp_path):
    source = scene(tmp_path, room="nowhere.xml")
    with pytest.raises(EvalsuiteError, match=r"no file 'nowhere\.xml' for its parameter room"):
        worker.load_model(source)


def test_a_scene_without_a_room_says_so(tmp_path):
    source = scene(tmp_path, room=None)
    assert room_path(source.path) is None and worker.load_model(source).room_file is None
    for ask in (lambda: worker.advance(source, "near-field", None, 1), lambda: worker.bake_room(source)):
        with pytest.raises(EvalsuiteError, match="got no room, expected a scene that names its real surroundings"):
            ask()


def test_a_define_moves_the_object_and_the_camera(tmp_path):
    write_room(tmp_path, box(2.0))
    still, moved = (worker.load_model(scene(tmp_path, **defines)) for defines in ({}, {"object_x": "0.75"}))
    for there, here in ((moved.meshes[0].positions, still.meshes[0].positions),
                        (moved.camera.to_world[:3, 3], still.camera.to_world[:3, 3])):  # fmt: skip
        np.testing.assert_allclose(there, here + np.array([0.75, 0, 0]), atol=1e-6)


@pytest.mark.parametrize(("name", "value", "message"), [
    ("object_q", "1", r"parameter 'object_q', expected one of its parameters \(room, object_x\)"),
    ("object_x", "abc", 'could not parse floating point value "abc"'),
])  # fmt: skip
def test_bad_parameters_are_named(tmp_path, name, value, message):
    write_room(tmp_path, box(2.0))
    with pytest.raises(EvalsuiteError, match=message):
        worker.load_model(scene(tmp_path, **{name: value}))


def cells(*options, techniques=("diffuse-sh9",), scene="near-field"):
    choice = Choice([str(scene)], techniques, None, ["near-field"], parse_parameters(options))
    return plan(load_report("accuracy"), choice)


def test_scene_parameters_are_swept_beside_the_techniques(tmp_path):
    found = cells("object_x=-1,0.5", "face_size=16")
    assert [c.id for c in found] == [f"near-field/diffuse-sh9/face_size=16,object_x={x}/near-field" for x in ("-1", "0.5")]
    assert [c.defines for c in found] == [{"object_x": -1}, {"object_x": 0.5}]
    assert cells("lamp_x=1")[0].defines == {"lamp_x": 1}  # the room's own


def test_a_techniques_name_wins_and_an_unknown_one_is_refused(tmp_path):
    path = scene(tmp_path, room=None).path
    path.write_text(path.read_text().replace("object_x", "face_size"), encoding="utf-8")
    (cell,) = cells("face_size=16", scene=path)
    assert cell.parameters == {"face_size": 16} and not cell.defines
    with pytest.raises(EvalsuiteError, match=r"'object_q'.*object_x"):
        cells("object_q=1")


def test_the_page_repeats_scene_parameters():
    from evalsuite.pipeline import Settings, reproduce

    assert "-p object_x=-1" in reproduce(cells("object_x=-1")[0], Settings())
    assert builtin.scene_path("near-field").is_file()
