"""Techniques that draw a scene's real room: its light, baked once, and what they drew held against Mitsuba's radiance there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.compare.probe import compare_faces
from evalsuite.scene.dependencies import dependencies, parameters, room_path
from evalsuite.scene.model import Room, SceneSource
from evalsuite.store.cache import digest, file_digest, package_versions, source_digest

if TYPE_CHECKING:
    from evalsuite.steps import Steps

#: Relative standard error of Mitsuba's radiance at the probe, mean over the texels: below what it is there to show.
PROBE_ERROR = 0.02


def fingerprint(source: SceneSource) -> dict:
    """All that decides a room and its light; where the objects are does not. Raises EvalsuiteError."""
    path = room_path(source.path, source.defines)
    known = parameters(path, source.defines) if path else {}
    return {
        "files": [file_digest(file) for file in dependencies(path, source.defines)] if path else [],
        "defines": {name: value for name, value in source.defines.items() if name in known},
        "code": source_digest("scene", "reference/room.py", "math/mesh_colors.py", "math/cubemap.py"),
        "versions": package_versions("mitsuba", "drjit"),
    }


def room(steps: Steps, source: SceneSource) -> Room:
    """The room with light baked onto it. Raises EvalsuiteError."""
    key = digest(fingerprint(source))

    def make() -> tuple[Path, dict]:
        steps.progress.step(f"baking the room of {source.path.stem}")
        baked = steps.workers.reference.call("evalsuite.reference.worker:bake_room", source)
        return steps.store.put("room", key, {}, lambda folder: np.savez_compressed(folder / "room.npz", **vars(baked)))

    place, *_ = steps.once("room", key, make)
    with np.load(place / "room.npz") as data:
        return Room(**{name: data[name] if data[name].ndim else data[name].item() for name in data})


def probe_error(steps: Steps, source: SceneSource, drawn: Path) -> dict:
    """What a probe drew (probe.npz) against Mitsuba's radiance at that point; see `compare.probe`."""
    with np.load(drawn) as data:
        position, faces = tuple(float(c) for c in data["position"]), data["faces"]
    key = digest([fingerprint(source), position, faces.shape[1], PROBE_ERROR])

    def make() -> tuple[Path, dict]:
        steps.progress.step(f"Mitsuba's radiance at the probe of {source.path.stem}")
        request = (source, position, faces.shape[1], PROBE_ERROR)
        truth, error = steps.workers.reference.call("evalsuite.reference.worker:probe_room", *request)
        return steps.store.put("probe", key, {}, lambda folder: np.savez(folder / "probe.npz", truth=truth, error=error))

    place, *_ = steps.once("probe", key, make)
    with np.load(place / "probe.npz") as data:
        return {"position": list(position), **compare_faces(faces, data["truth"], data["error"])}
