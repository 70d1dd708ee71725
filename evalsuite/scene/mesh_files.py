"""Mesh files, looked through before Mitsuba's native readers get them: a count that the file does not hold, or a triangle of
vertices that there are not, ends those in a crash or takes all memory."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from evalsuite.image.files import file_stamp
from evalsuite.scene import ply_file, serialized_file
from evalsuite.scene.mesh_damage import Damaged


def mesh_problem(path: Path, plugin: str, shape_index: int = 0) -> str | None:
    """What is wrong with a `ply` or `serialized` file that says it has more than it has, or whose triangles name other vertices
    than its own, in words; None for any other. Of other plugins' files nothing is read. shape_index: of the meshes in a
    serialized file."""
    if plugin not in ("ply", "serialized"):
        return None
    return _problem(path, plugin, shape_index, file_stamp(path))


@lru_cache(maxsize=256)
def _problem(path: Path, plugin: str, shape_index: int, stamp: tuple[int, ...]) -> str | None:
    del stamp  # part of the key: a changed file is read again
    try:
        data = path.read_bytes()
        vertices, corners = ply_file.triangles(data) if plugin == "ply" else serialized_file.triangles(data, shape_index)
    except Damaged as error:
        return str(error)
    except OSError as error:
        return f"no readable file ({error.strerror})"
    if corners.size and not (0 <= corners.min() and corners.max() < vertices):
        return f"a triangle of vertex {corners.max() if corners.max() >= vertices else corners.min()} of {vertices}"
    return None
