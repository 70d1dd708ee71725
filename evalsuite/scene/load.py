"""A Mitsuba XML file as the plain model of both renderers, and as the Mitsuba scene made of that model's own data.

Mitsuba's parser and shape plugins read the file. Analytic shapes are then tessellated and environments read or baked once,
and Mitsuba gets the results back, so that both renderers see the same triangles and the same texels.
Needs an active Mitsuba variant with our plugins (`reference.variants.activate`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image.exr import MAX_PIXELS
from evalsuite.scene.dependencies import check_parameters, room_path
from evalsuite.scene.environment import clean_environment, read_environment, scaled
from evalsuite.scene.materials import describe_material
from evalsuite.scene.model import SUBJECT, Camera, Environment, Material, Scene, SceneSource, TriangleMesh
from evalsuite.scene.parse import WRAPPERS, ParsedScene
from evalsuite.scene.shapes import MESHES, mitsuba_mesh, shape_triangles
from evalsuite.scene.sky import bake_sky
from evalsuite.scene.tessellate import CANONICAL

ENVIRONMENTS = ("envmap", "constant", "sunsky")
#: Largest side of a picture [pixels], as for --size.
MAX_FILM = 16384


@dataclass(frozen=True, eq=False)
class LoadedScene:
    """scene: the model. bsdfs: Mitsuba BSDFs, one per `scene.materials`. mitsuba: the Mitsuba scene built from the model's
    triangles and texels, with everything only Mitsuba can draw besides. shape_materials: of each of its shapes, in order,
    the index of the material, or −1."""

    scene: Scene
    bsdfs: tuple[Any, ...]
    mitsuba: Any
    shape_materials: tuple[int, ...]

    @property
    def sensor(self) -> Any:
        return self.mitsuba.sensors()[0]

    @property
    def environment(self) -> Any:
        """Mitsuba's environment emitter, or None."""
        return self.mitsuba.environment()


def load(source: SceneSource) -> LoadedScene:
    """Load a scene. Raises EvalsuiteError, with file and line, for anything that Mitsuba cannot load or nothing here draws;
    what Mitsuba alone can draw is listed in `Scene.refused`, `Scene.mitsuba_only` and `Material.undrawable`."""

    check_parameters(source.path, source.defines)
    parsed = ParsedScene(source)
    if not parsed.children(0, "Sensor"):
        raise EvalsuiteError(source.path, "no sensor", "a perspective camera", 'add <sensor type="perspective">')
    if not parsed.children(0, "Shape"):
        raise EvalsuiteError(source.path, "no shapes", "at least one shape", 'add one, e.g. <shape type="sphere"/>')
    refused, mitsuba_only = _survey(parsed)
    environment = _environment(parsed)
    camera, sensor = _camera(source, refused)

    for index in parsed.children(0, "Emitter"):
        if parsed.plugin(index) in ENVIRONMENTS:
            parsed.remove_child(0, index)
    materials: list[Material] = []
    bsdfs: list[Any] = []
    meshes: list[TriangleMesh] = []
    shapes: dict[str, Any] = {}
    for shape in parsed.instantiate().shapes():
        name = shape.id()
        index = parsed.ids.get(name)
        if index is None or index not in parsed.children(0) or _has_medium(parsed, index):
            continue
        triangles = shape_triangles(shape, parsed.plugin(index))
        if triangles is None:
            continue
        mesh = TriangleMesh(
            name=name,
            positions=np.ascontiguousarray(triangles.positions, np.float32),
            normals=np.ascontiguousarray(triangles.normals, np.float32),
            faces=np.ascontiguousarray(triangles.faces, np.uint32),
            uvs=None if triangles.uvs is None else np.ascontiguousarray(triangles.uvs, np.float32),
            material=_material(parsed, index, name, shape.bsdf(), materials, bsdfs),
        )
        meshes.append(mesh)
        material = materials[mesh.material]
        if mesh.uvs is None and (material.textures or material.normal_map):
            refused.append(f"a bitmap on the shape '{name}', which has no texture coordinates ({parsed.location(index)})")
        if parsed.plugin(index) in CANONICAL:
            lights = parsed.children(index, "Emitter")
            emitter = ParsedScene(source).instantiate(lights[0]) if lights else None
            shape = mitsuba_mesh(mesh, shape.bsdf(), emitter)
        shapes[name] = shape

    built = _rebuild(source, sensor, shapes, environment)
    owners = {mesh.name: mesh.material for mesh in meshes}
    scene = Scene(
        name=source.path.stem,
        path=source.path,
        camera=camera,
        meshes=tuple(meshes),
        materials=tuple(materials),
        environment=environment,
        mitsuba_only=tuple(mitsuba_only),
        refused=tuple(refused),
        subject=tuple(m.id for m in materials if m.id == SUBJECT),
        room_file=room_path(source.path, source.defines),
    )
    return LoadedScene(scene, tuple(bsdfs), built, tuple(owners.get(s.id(), -1) for s in built.shapes()))


def _rebuild(source: SceneSource, sensor: Any, shapes: Mapping[str, Any], environment: Environment | None) -> Any:
    """Mitsuba scene of our sensor, environment and shapes, and of what only Mitsuba draws, made from the file once more."""
    parsed = ParsedScene(source)
    kept = {i for i in parsed.children(0) if parsed.kind(i) in ("Shape", "Emitter") and parsed.plugin(i) not in ENVIRONMENTS}
    kept -= {parsed.ids[name] for name in shapes}
    for index in set(parsed.children(0)) - kept:
        parsed.remove_child(0, index)
    parsed.put(0, "our-sensor", sensor)
    for number, shape in enumerate(shapes.values()):
        parsed.put(0, f"our-shape-{number}", shape)
    if environment is not None:
        parsed.put(0, "our-environment", environment_plugin(environment))
    return parsed.instantiate()


def environment_plugin(environment: Environment) -> Any:
    """Mitsuba emitter with exactly the model's texels: `constant` for a 1×1 map, else `envmap`."""
    import mitsuba as mi

    if environment.radiance.shape[:2] == (1, 1):
        return mi.load_dict({"type": "constant", "radiance": {"type": "rgb", "value": environment.radiance[0, 0].tolist()}})
    matrix = np.eye(4)
    matrix[:3, :3] = environment.to_world
    bitmap = mi.Bitmap(np.ascontiguousarray(environment.radiance))
    return mi.load_dict({"type": "envmap", "bitmap": bitmap, "to_world": mi.ScalarTransform4f(matrix)})


def _survey(parsed: ParsedScene) -> tuple[list[str], list[str]]:
    """What no GPU technique here draws (refused), and area lights, which only Mitsuba draws."""
    refused, mitsuba_only = [], []
    for index in parsed.children(0):
        kind, plugin, location = parsed.kind(index), parsed.plugin(index), parsed.location(index)
        name = f"the {kind.lower()} '{plugin}' ({location})"
        if kind == "Shape" and plugin not in MESHES and plugin not in CANONICAL and plugin != "shapegroup":
            refused.append(name)
        elif kind == "Shape" and _has_medium(parsed, index):
            refused.append(f"a medium in {name}")
        elif (kind == "Emitter" and plugin not in ENVIRONMENTS) or kind in ("Medium", "Volume"):
            refused.append(name)
        if kind == "Shape":
            mitsuba_only += [f"area light of {name}" for _ in parsed.children(index, "Emitter")]
    return refused, mitsuba_only


def _has_medium(parsed: ParsedScene, index: int) -> bool:
    return bool(parsed.children(index, "Medium"))


def _material(parsed: ParsedScene, shape: int, shape_name: str, bsdf: Any, materials: list[Material], bsdfs: list[Any]) -> int:
    """Index of a shape's material; a BSDF that several shapes share is filed once."""
    nodes = parsed.children(shape, "BSDF")
    node = nodes[0] if nodes else None
    name = parsed.nodes[node].props.id() if node is not None else f"diffuse of {shape_name}"
    wrapped = node
    while wrapped is not None and parsed.plugin(wrapped) in WRAPPERS and name != SUBJECT:
        wrapped = parsed.children(wrapped, "BSDF")[0]
        inner = parsed.nodes[wrapped].props.id()
        # A generated name says less than the one the author gave to what is inside; reports look for the subject.
        if inner == SUBJECT or (inner in parsed.named and name not in parsed.named):
            name = inner
    for i, known in enumerate(materials):
        if known.id == name:
            return i
    materials.append(describe_material(parsed, node, bsdf, name))
    bsdfs.append(bsdf)
    return len(materials) - 1


def _environment(parsed: ParsedScene) -> Environment | None:
    source = parsed.source
    found = [i for i in parsed.children(0, "Emitter") if parsed.plugin(i) in ENVIRONMENTS]
    if len(found) > 1:
        raise EvalsuiteError(
            parsed.location(found[1]),
            f"a second environment, after {parsed.location(found[0])}",
            "one envmap, constant or sunsky",
            "remove one",
        )
    rotation = _rotation(parsed, found[0]) if found else np.eye(3)
    if source.environment is not None:
        kept = rotation if found and parsed.plugin(found[0]) == "envmap" else np.eye(3)
        return replace(read_environment(source.environment, source.repair_environment), to_world=kept)
    if not found:
        return None
    index = found[0]
    plugin, properties = parsed.plugin(index), parsed.properties(index)
    if plugin == "envmap":
        if "filename" not in properties:
            raise EvalsuiteError(parsed.location(index), "an envmap without a filename", "a lat-long .exr or .hdr file")
        environment = read_environment(parsed.file(index), source.repair_environment)
        return replace(scaled(environment, float(properties.get("scale", 1.0))), to_world=rotation)
    emitter = ParsedScene(source).instantiate(index)
    if plugin == "sunsky":
        return bake_sky(emitter, rotation)
    return _constant(parsed, index, emitter)


def _constant(parsed: ParsedScene, index: int, emitter: Any) -> Environment:
    import mitsuba as mi

    parameters = mi.traverse(emitter)
    if "radiance.value" not in parameters:
        raise EvalsuiteError(parsed.location(index), "a constant emitter with a texture", "one radiance")
    value = np.ravel(np.array(parameters["radiance.value"], dtype=np.float64))
    radiance = np.broadcast_to(value, (1, 1, 3))
    return clean_environment(radiance, "constant", parsed.source.repair_environment)


def _rotation(parsed: ParsedScene, index: int) -> NDArray[np.float64]:
    transform = parsed.properties(index).get("to_world")
    if transform is None:
        return np.eye(3)
    linear = np.array(transform.matrix, dtype=np.float64)[:3, :3]
    if np.abs(linear.T @ linear - np.eye(3)).max() > 1e-5:
        raise EvalsuiteError(
            parsed.location(index),
            f"a to_world of the {parsed.plugin(index)} that scales or shears",
            "a rotation or reflection, as only those turn directions into directions",
            "remove the scaling",
        )
    left, _, right = np.linalg.svd(linear)
    return left @ right  # orthogonal to the last bit


def _camera(source: SceneSource, refused: list[str]) -> tuple[Camera, Any]:
    """Camera and the Mitsuba sensor: the file's first, with a film of our own (box filter of one pixel, float32 RGB)."""
    import mitsuba as mi

    parsed = ParsedScene(source)
    index = parsed.children(0, "Sensor")[0]
    plugin, properties = parsed.plugin(index), parsed.properties(index)
    films = parsed.children(index, "Film")
    size, crop = _film_size(parsed.properties(films[0]) if films else {}, source.size)
    if plugin != "perspective":
        refused.append(f"the sensor '{plugin}' ({parsed.location(index)})")
    for child in parsed.children(index):
        if parsed.kind(child) == "Medium":
            refused.append(f"a medium about the sensor '{plugin}' ({parsed.location(index)})")
        elif parsed.kind(child) in ("Film", "Sampler"):
            parsed.remove_child(index, child)
    fits = all(1 <= n <= MAX_FILM for n in size) and size[0] * size[1] <= MAX_PIXELS
    if not fits or min(crop[:2]) < 0 or min(crop[2:]) < 1 or crop[0] + crop[2] > size[0] or crop[1] + crop[3] > size[1]:
        where = parsed.location(films[0]) if films else source.path
        raise EvalsuiteError(
            where, f"a film of {size[0]}×{size[1]} pixels, cropped at {crop[0]}, {crop[1]} to {crop[2]}×{crop[3]}",
            f"1 to {MAX_FILM} pixels a side, {MAX_PIXELS} in all, and a crop window inside", "mend the film, or give --size",
        )  # fmt: skip
    film = mi.load_dict(
        {
            "type": "hdrfilm",
            "width": size[0],
            "height": size[1],
            "pixel_format": "rgb",
            "component_format": "float32",
            "crop_offset_x": crop[0],
            "crop_offset_y": crop[1],
            "crop_width": crop[2],
            "crop_height": crop[3],
            "rfilter": {"type": "box"},
        }
    )
    parsed.put(index, "film", film)
    # Stratified over the pixel and each two-dimensional decision; `reference.render` sets the sample count of a pass.
    parsed.put(index, "sampler", mi.load_dict({"type": "multijitter", "sample_count": 64}))
    sensor = parsed.instantiate(index)
    parameters = mi.traverse(sensor)
    transform = properties.get("to_world")
    camera = Camera(
        to_world=np.eye(4) if transform is None else np.array(transform.matrix, dtype=np.float64),
        fov_x_deg=float(np.ravel(np.array(parameters["x_fov"]))[0]) if "x_fov" in parameters else 45.0,
        film=size,
        crop=crop,
        principal_point=(
            float(properties.get("principal_point_offset_x", 0.0)),
            float(properties.get("principal_point_offset_y", 0.0)),
        ),
        near=float(properties.get("near_clip", 1e-2)),
        far=float(properties.get("far_clip", 1e4)),
    )
    return camera, sensor


def _film_size(film: dict[str, Any], size: tuple[int, int] | None) -> tuple[tuple[int, int], tuple[int, int, int, int]]:
    """Film size and crop window [pixels]. A size that replaces the film's scales the crop window with it."""
    width, height = int(film.get("width", 768)), int(film.get("height", 576))  # Mitsuba's defaults
    x, y = int(film.get("crop_offset_x", 0)), int(film.get("crop_offset_y", 0))
    w, h = int(film.get("crop_width", width)), int(film.get("crop_height", height))
    if size is not None:
        left, right = round(x * size[0] / width), round((x + w) * size[0] / width)
        top, bottom = round(y * size[1] / height), round((y + h) * size[1] / height)
        (width, height), (x, y, w, h) = size, (left, top, max(right - left, 1), max(bottom - top, 1))
    return (width, height), (x, y, w, h)
