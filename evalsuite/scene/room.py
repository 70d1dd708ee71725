"""A scene's real surroundings, as Mitsuba sees them: the scene's objects within them, and their triangles.

The room is a Mitsuba XML that the scene names (`<default name="room" value="rooms/x.xml"/>`), in the same coordinates and
with the same parameters. Its shapes and emitters take the environment's place; its sensor and integrator do not count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.scene.dependencies import ROOM, room_path
from evalsuite.scene.load import LoadedScene
from evalsuite.scene.model import SceneSource
from evalsuite.scene.parse import ParsedScene
from evalsuite.scene.shapes import shape_triangles


@dataclass(frozen=True, eq=False)
class RoomTriangles:
    """corners: (F, 3, 3) float64 world, counter-clockwise from the front. two_sided: (F,) whether the back reflects too."""

    corners: NDArray[np.float64]
    two_sided: NDArray[np.bool_]


def room_source(source: SceneSource) -> SceneSource:
    """The room of a scene. Raises EvalsuiteError for a scene that names none."""
    path = room_path(source.path, source.defines)
    if path is None:
        raise EvalsuiteError(
            source.path,
            "no room",
            "a scene that names its real surroundings",
            f'add <default name="{ROOM}" value="FILE.xml"/>, or choose another target or technique',
        )
    return SceneSource(path, defines=source.defines)


def load_room(source: SceneSource) -> tuple[Any, ParsedScene]:
    """Mitsuba's scene of a room, its shapes unmerged, and the parse it was made from."""
    parsed = ParsedScene(room_source(source))
    return parsed.instantiate(), parsed


def within_room(loaded: LoadedScene, source: SceneSource) -> LoadedScene:
    """The loaded scene with its environment replaced by the room. Raises EvalsuiteError for a scene that names none."""
    import mitsuba as mi

    room, _ = load_room(source)
    parts = [*loaded.mitsuba.shapes(), *room.shapes(), *_lamps(loaded.mitsuba), *_lamps(room)]
    parts += [room.environment()] if room.environment() is not None else []
    # Unmerged: the objects' shapes keep their identity, by which a material is known.
    named = {f"part-{number}": part for number, part in enumerate(parts)}
    both = mi.load_dict({"type": "scene", "sensor": loaded.sensor, **named}, optimize=False)
    materials = {id(shape): m for shape, m in zip(loaded.mitsuba.shapes(), loaded.shape_materials, strict=True)}
    return replace(loaded, mitsuba=both, shape_materials=tuple(materials.get(id(shape), -1) for shape in both.shapes()))


def _lamps(scene: Any) -> list[Any]:
    """Emitters that are neither part of a shape nor an environment."""
    import mitsuba as mi

    elsewhere = (mi.EmitterFlags.Surface, mi.EmitterFlags.Infinite)
    return [light for light in scene.emitters() if not any(mi.has_flag(light.flags(), flag) for flag in elsewhere)]


def room_triangles(source: SceneSource) -> RoomTriangles:
    """The room's triangles. Raises EvalsuiteError naming a shape that has none."""
    import mitsuba as mi

    scene, parsed = load_room(source)
    corners, two_sided = [], []
    for shape in scene.shapes():
        node = parsed.ids[shape.id()]
        triangles = shape_triangles(shape, parsed.plugin(node))
        if triangles is None:
            raise EvalsuiteError(
                parsed.location(node), f"the shape '{parsed.plugin(node)}'", "triangle meshes or analytic shapes in a room"
            )
        corners.append(np.asarray(triangles.positions, np.float64)[triangles.faces])
        back = mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.BackSide)
        two_sided.append(np.full(len(triangles.faces), back))
    return RoomTriangles(np.concatenate(corners), np.concatenate(two_sided))
