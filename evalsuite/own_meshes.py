"""A paper's own mesh in the scene of what stands in for it: `--mesh bunny=FILE`."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image.files import replacing
from evalsuite.scene import builtin
from evalsuite.scene.model import Scene, SceneSource
from evalsuite.stand_ins import MESHES

#: Mitsuba's plugin for a file.
PLUGINS = {".ply": "ply", ".obj": "obj", ".serialized": "serialized"}

Model = Callable[[SceneSource], Scene]


def scenes(meshes: Mapping[str, Path], directory: Path, model: Model) -> dict[str, Path]:
    """A scene file for each role, `directory`/scenes/ROLE.xml: camera, environment and subject of the stand-in, the mesh upright
    (y up) and moved and scaled into the sphere about it. meshes: role → file. model: loads a scene. Raises EvalsuiteError for a
    file that Mitsuba cannot read or that has no extent."""
    return {role: _scene(role, mesh, directory / "scenes" / f"{role}.xml", model) for role, mesh in meshes.items()}


def _scene(role: str, mesh: Path, place: Path, model: Model) -> Path:
    stand_in = builtin.scene_path(MESHES[role].stand_in)
    if mesh.suffix.lower() not in PLUGINS:
        raise EvalsuiteError(mesh, f"a {mesh.suffix or 'nameless'} file", f"a mesh: {', '.join(PLUGINS)}", "convert it")
    tree = ElementTree.parse(stand_in)
    (shape,) = tree.getroot().findall("shape")
    for name in tree.getroot().findall("emitter/string[@name='filename']"):
        name.set("value", str((stand_in.parent / name.get("value", "")).resolve()))
    shape.set("type", PLUGINS[mesh.suffix.lower()])
    shape.find("string[@name='filename']").set("value", str(mesh.resolve()))
    for transform in shape.findall("transform"):
        shape.remove(transform)
    tree.getroot().insert(0, ElementTree.Comment(f" {role}: {mesh.name} in place of {stand_in.stem} "))
    place.parent.mkdir(parents=True, exist_ok=True)
    _write(tree, place)
    (centre, radius), (middle, wanted) = (_sphere(model(SceneSource(path))) for path in (place, stand_in))
    if not radius > 0:
        raise EvalsuiteError(mesh, "a mesh without extent", "a mesh with triangles apart from one another", "check the file")
    transform = ElementTree.SubElement(shape, "transform", name="to_world")
    for tag, values in (("translate", -centre), ("scale", np.full(3, wanted / radius)), ("translate", middle)):
        ElementTree.SubElement(transform, tag, dict(zip("xyz", map(repr, values.tolist()), strict=True)))
    _write(tree, place)
    return place


def _write(tree: ElementTree.ElementTree, place: Path) -> None:
    ElementTree.indent(tree, "    ")
    with replacing(place) as temporary:
        tree.write(temporary, encoding="utf-8", xml_declaration=True)


def _sphere(scene: Scene) -> tuple[NDArray[np.float64], float]:
    """Centre of the bounding box of all corners of triangles, and the radius about it that holds them."""
    corners = np.concatenate([mesh.positions[np.unique(mesh.faces)] for mesh in scene.meshes]).astype(np.float64)
    centre = 0.5 * (corners.min(0) + corners.max(0))
    return centre, float(np.linalg.norm(corners - centre, axis=1).max())
