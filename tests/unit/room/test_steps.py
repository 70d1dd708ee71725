"""The steps of a room: baked once for all places of the object, used by pictures and held against Mitsuba's radiance."""

from __future__ import annotations

import numpy as np
import pytest
from rooms import COLOURS, box, scene, write_room

from evalsuite import surroundings
from evalsuite.execute.local import Workers
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.pipeline import Run, Settings
from evalsuite.plan import Cell
from evalsuite.scene.builtin import scene_path
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import Store


def test_a_room_does_not_depend_on_where_the_object_is_but_on_its_lamp():
    plain, moved, lamp = (
        surroundings.fingerprint(SceneSource(scene_path("near-field"), defines=defines))
        for defines in ({}, {"object_x": "1"}, {"lamp_x": "1"})
    )
    assert plain == moved != lamp


@pytest.fixture
def run(tmp_path):
    with Workers(jobs=1) as workers:
        yield Run(Store(tmp_path / "cache"), workers, Settings(target_error=0.05, cap=256))


def test_a_cell_in_a_room(tmp_path, run):
    write_room(tmp_path, box(1.0))
    path = scene(tmp_path).path
    cells = [
        Cell("scene", path, None, None, "acquire", {"face_size": 16}, "near-field", defines={"object_x": x}) for x in (0, 0.25)
    ]
    results = [run.evaluate(cell)[0] for cell in cells]
    assert [(r["status"], r["message"]) for r in results] == [("scored", "")] * 2
    for x, result in zip((0, 0.25), results, strict=True):
        assert result["probe"]["position"] == pytest.approx([x, 0, 0], abs=1e-6)
        assert result["probe"]["rel_rmse"] < 0.05 and result["parameters"] == {"face_size": 16, "object_x": x}
        assert result["cost"]["acquire_ms"] > 0 and f"-p object_x={x}" in result["reproduce"]
        assert any("six faces of 16²" in note for note in result["notes"])
        # Convex, in a room without reflections: the middle's map errs by parallax alone.
        assert 0.001 < result["metrics"]["rel_rmse"]["value"] < 0.1
    assert len(list((tmp_path / "cache" / "room").glob("*/*/room.npz"))) == 1
    seen = np.array(COLOURS).mean()
    assert surroundings.room(run, run.source(cells[0])).radiance.mean() == pytest.approx(seen, rel=0.1)


def test_without_a_room_cells_are_skipped_with_the_reason(tmp_path, run):
    path = scene(tmp_path, room=None).path
    for technique, reason in (
        ("acquire", "names no room"),
        ("diffuse-sh9", "so there is no near field"),
    ):
        result = run.evaluate(Cell("scene", path, None, None, technique, {}, "near-field"))[0]
        assert result["status"] == "skipped" and reason in result["message"]
    assert TECHNIQUES["acquire"].target == "near-field"
