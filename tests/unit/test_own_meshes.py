"""A user's mesh in a stand-in's scene: as large as what it replaces, and refused in one line where it cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite import own_meshes
from evalsuite.errors import EvalsuiteError
from evalsuite.reference.worker import load_model
from evalsuite.scene.builtin import scene_path
from evalsuite.scene.model import SceneSource
from evalsuite.stand_ins import MESHES

TETRAHEDRON = "v 10 0 0\nv 14 0 0\nv 10 4 0\nv 10 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize("role", MESHES)
def test_it_fills_the_place_of_what_it_replaces(role, tmp_path):
    file = tmp_path / "my mésh.obj"
    file.write_text(TETRAHEDRON)
    place = own_meshes.scenes({role: file}, tmp_path / "out", load_model)[role]
    assert place == tmp_path / "out" / "scenes" / f"{role}.xml"
    made, stand_in = (load_model(SceneSource(path)) for path in (place, scene_path(MESHES[role].stand_in)))
    (middle, radius), (wanted, size) = own_meshes._sphere(made), own_meshes._sphere(stand_in)
    np.testing.assert_allclose(middle, wanted, atol=1e-4)
    assert radius == pytest.approx(size, rel=1e-5) and sum(len(mesh.faces) for mesh in made.meshes) == 4
    np.testing.assert_array_equal(made.camera.to_world, stand_in.camera.to_world)
    assert made.subject == ("subject",) and made.environment is not None


@pytest.mark.parametrize(("name", "text", "said"), [
    ("a.stl", TETRAHEDRON, "a .stl file"),
    ("a.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "without extent"),
    ("a.obj", "v 0 0 0\nf 1 2 3\n", "a.obj"),
    ("a.ply", "ply\n", "a.ply"),
])  # fmt: skip
def test_what_is_no_mesh_is_one_line(name, text, said, tmp_path):
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(EvalsuiteError, match=said):
        own_meshes.scenes({"bunny": file}, tmp_path / "out", load_model)
