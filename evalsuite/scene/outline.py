"""A scene without its meshes and texels, as JSON: what planning needs, quick to keep and read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.scene.model import Camera, Environment, Material, Scene, Texture, TriangleMesh

#: One degenerate triangle: an outline's mesh is there, but has no shape.
_POINT, _FACE = np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint32)


def outline_to_json(scene: Scene) -> dict:
    """Materials, camera, notes and refusals of a scene as plain values."""
    return {
        "name": scene.name,
        "path": str(scene.path),
        "camera": {
            "to_world": scene.camera.to_world.tolist(),
            "fov_x_deg": scene.camera.fov_x_deg,
            "film": scene.camera.film,
            "crop": scene.camera.crop,
            "principal_point": scene.camera.principal_point,
            "near": scene.camera.near,
            "far": scene.camera.far,
        },
        "meshes": [{"name": mesh.name, "material": mesh.material, "triangles": len(mesh.faces)} for mesh in scene.meshes],
        "materials": [
            {
                "id": m.id,
                "plugin": m.plugin,
                "parameters": {k: v for k, v in m.parameters.items() if k not in m.textures},
                "textures": {k: t.source for k, t in m.textures.items()},
                "normal_map": m.normal_map and m.normal_map.source,
                "two_sided": m.two_sided,
                "undrawable": m.undrawable,
                "location": m.location,
            }
            for m in scene.materials
        ],
        "environment": None
        if scene.environment is None
        else {
            "constant": _constant(scene.environment.radiance),
            "source": scene.environment.source,
            "notes": scene.environment.notes,
            "remarks": scene.environment.remarks,
        },
        "mitsuba_only": scene.mitsuba_only,
        "refused": scene.refused,
        "subject": scene.subject,
        "room_file": scene.room_file and str(scene.room_file),
    }


def _constant(radiance: np.ndarray) -> list[float] | None:
    """The radiance that all texels share, or None."""
    first = radiance[0, 0]
    return [float(c) for c in first] if (radiance == first).all() else None


def _texels(constant: list[float] | None) -> np.ndarray:
    return np.zeros((2, 2, 3), np.float32) if constant is None else np.array(constant, np.float32).reshape(1, 1, 3)


def _material(data: dict) -> Material:
    """A material again; its bitmaps are one grey texel."""
    textures = {key: _texture(source) for key, source in data.pop("textures").items()}
    normal_map = data.pop("normal_map")
    parameters = {**data.pop("parameters"), **textures}
    return Material(**data, parameters=parameters, normal_map=None if normal_map is None else _texture(normal_map))


def _texture(source: str) -> Texture:
    return Texture(np.full((1, 1, 3), 0.5, np.float32), np.eye(3), source=source)


def outline_from_json(data: dict) -> Scene:
    """The scene again, with degenerate meshes; a constant environment is one texel, any other a black stand-in of 2×2."""
    camera, environment = data["camera"], data["environment"]
    return Scene(
        name=data["name"],
        path=Path(data["path"]),
        camera=Camera(
            np.array(camera["to_world"]),
            camera["fov_x_deg"],
            tuple(camera["film"]),
            tuple(camera["crop"]),
            tuple(camera["principal_point"]),
            camera["near"],
            camera["far"],
        ),
        meshes=tuple(TriangleMesh(mesh["name"], _POINT, _POINT, _FACE, mesh["material"]) for mesh in data["meshes"]),
        materials=tuple(_material(dict(m)) for m in data["materials"]),
        environment=None
        if environment is None
        else Environment(
            _texels(environment["constant"]),
            np.eye(3),
            environment["source"],
            tuple(environment["notes"]),
            tuple(environment["remarks"]),
        ),
        mitsuba_only=tuple(data["mitsuba_only"]),
        refused=tuple(data["refused"]),
        subject=tuple(data["subject"]),
        room_file=data["room_file"] and Path(data["room_file"]),
    )
