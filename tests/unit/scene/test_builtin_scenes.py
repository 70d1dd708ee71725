"""Every scene and room that ships opens with plain Mitsuba and shows something."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from evalsuite.lights.adjacency import adjacency
from evalsuite.scene.builtin import list_scenes, scene_path, scenes_directory
from evalsuite.scene.load import load
from evalsuite.scene.model import SceneSource

GROUNDED = ("still-life", "three-boxes", "column", "dancer")
NAMES = ("sphere", "sphere72", "torus", "teapot", "organic", "near-field", "crate", *GROUNDED)
ROOMS = ("office", "cathedral", "chapel", "basilica", "studio")


@pytest.fixture(scope="module")
def mi():
    from evalsuite.reference.variants import activate

    return activate()


@pytest.mark.parametrize("name", NAMES)
def test_scene_renders(mi, name: str) -> None:
    scene = mi.load_file(str(scene_path(name)))
    image = np.array(mi.render(scene, spp=4))[..., :3]
    assert image.shape == (256, 256, 3)
    hit = np.array(mi.render(scene, integrator=mi.load_dict({"type": "aov", "aovs": "d:depth"}), spp=4))[..., -1] > 0
    assert 0.4 < hit.mean() < 0.85, "the object fills the picture well"
    assert np.isfinite(image).all() and image[hit].mean() > 0.01 and image[~hit].mean() > 0.01
    edges = np.concatenate([hit[0], hit[-1], hit[:, 0], hit[:, -1]])
    assert name in GROUNDED or not edges.any(), "the object is cut off by the frame"


@pytest.mark.parametrize("name", ROOMS)
def test_room_renders(mi, name: str) -> None:
    scene = mi.load_file(str(scenes_directory() / "rooms" / f"{name}.xml"))
    image = np.array(mi.render(scene, spp=1))[..., :3]
    assert np.isfinite(image).all() and (image.max(-1) > 0).mean() > 0.5


def test_all_are_tested() -> None:
    assert {scene["name"] for scene in list_scenes()} == set(NAMES)
    assert {path.stem for path in (scenes_directory() / "rooms").glob("*.xml")} == set(ROOMS)


@pytest.mark.parametrize("name", NAMES)
def test_scene_is_as_the_reports_expect(name: str) -> None:
    text = scene_path(name).read_text(encoding="utf-8")
    assert '<bsdf type="diffuse" id="subject">' in text and '<rfilter type="box"/>' in text and '"independent"' in text
    files = [file.replace("$frame", "0") for file in re.findall(r'name="filename" value="([^"]+)"', text)]
    assert files and all(not Path(file).is_absolute() and (scenes_directory() / file).is_file() for file in files)


@pytest.mark.parametrize("name, triangles", [("three-boxes", 38), ("column", 440), ("dancer", 390)])
def test_shadow_scenes_have_the_paper_s_polygons_and_closed_casters(mi, name: str, triangles: int) -> None:
    meshes = load(SceneSource(scene_path(name))).scene.meshes
    assert sum(len(mesh.faces) for mesh in meshes) == triangles
    ground, *casters = sorted(meshes, key=lambda mesh: len(mesh.faces))
    assert len(ground.faces) == 2 and casters and all(adjacency(m.positions, m.faces).closed for m in casters)


def test_the_dancer_moves_and_bends_with_one_topology(mi) -> None:
    frames = [load(SceneSource(scene_path("dancer"), defines={"frame": str(k)})).scene.meshes[-1] for k in range(8)]
    assert all(len(mesh.faces) == 388 and np.array_equal(mesh.faces, frames[0].faces) for mesh in frames)
    middles = [mesh.positions.mean(0) for mesh in frames]
    assert min(np.linalg.norm(a - b) for a, b in pairwise(middles)) > 0.2
    shapes = [mesh.positions - middle for mesh, middle in zip(frames, middles, strict=True)]
    assert max(np.abs(shape - shapes[0]).max() for shape in shapes) > 0.3
