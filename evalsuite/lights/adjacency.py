"""Which triangles meet at which edges: all that shadow volumes need to know of a mesh beforehand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Adjacency:
    """positions: (U, 3) float32, vertices of equal position made one. faces: (F, 3) int32 into them, degenerate ones dropped.
    edges: (E, 2) int32: from, to. edge_faces: (E, 2) int32: the face that has the edge in that direction counter-clockwise from
    outside, hence on its left, and the face that has it the other way; −1 where an edge is open."""

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    edges: NDArray[np.int32]
    edge_faces: NDArray[np.int32]

    @property
    def closed(self) -> bool:
        """Whether every edge has a face on both sides."""
        return bool((self.edge_faces >= 0).all())


def adjacency(positions: ArrayLike, faces: ArrayLike) -> Adjacency:
    """Edges of a triangle mesh. positions: (V, 3); faces: (F, 3) indices, counter-clockwise from outside.

    Faces that run along an edge in the same direction (a third face, or inconsistent winding) get an open edge each.
    """
    positions = np.asarray(positions, np.float32).reshape(-1, 3)
    if len(positions) == 0:
        return Adjacency(*(np.zeros((0, n), t) for n, t in ((3, np.float32), (3, np.int32), (2, np.int32), (2, np.int32))))
    welded, index = np.unique(positions + 0.0, axis=0, return_inverse=True)  # + 0.0: −0 and 0 are one place
    faces = index.reshape(-1)[np.asarray(faces, np.int64).reshape(-1, 3)]
    corners = welded[faces].astype(np.float64)
    doubled_area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = faces[doubled_area > 0.0]

    half = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    owner = np.repeat(np.arange(len(faces)), 3)
    waiting: dict[tuple[int, int], list[int]] = {}
    for (start, end), face in zip(half.tolist(), owner.tolist(), strict=True):
        waiting.setdefault((start, end), []).append(face)
    edges, sides = [], []
    for (start, end), left in waiting.items():
        right = waiting.get((end, start), [])
        # One pair an edge: the others of a crowded edge stay open, each on its own side.
        if right and start < end:
            edges.append((start, end))
            sides.append((left[0], right[0]))
        for face in left[1 if right else 0 :]:
            edges.append((start, end))
            sides.append((face, -1))
    return Adjacency(
        welded,
        faces.astype(np.int32),
        np.array(edges, np.int32).reshape(-1, 2),
        np.array(sides, np.int32).reshape(-1, 2),
    )
