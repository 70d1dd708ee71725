"""Triangles for Mitsuba's analytic shapes, once for both renderers: vertices on the true surface, exact normals there.

Each function gives (positions, normals, uvs, faces) in the shape's own canonical frame, counter-clockwise from outside,
with Mitsuba's uv layout; `place` carries them into the world. Sizes are chosen so that the chord's sag stays below 3·10⁻⁴
of the radius (1 − cos(π/128)).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

AROUND = 128
ALONG = 64


class Triangles(NamedTuple):
    """positions, normals: (V, 3) float64; uvs: (V, 2) float64; faces: (F, 3) uint32, counter-clockwise from outside."""

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    uvs: NDArray[np.float64]
    faces: NDArray[np.uint32]


def _grid(rows: int, columns: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.uint32]]:
    """(u, v) of a (rows+1) × (columns+1) vertex grid, flattened, and two triangles per cell (u to the right, v down)."""
    v, u = np.meshgrid(np.arange(rows + 1) / rows, np.arange(columns + 1) / columns, indexing="ij")
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)[None, :]).ravel()
    below = corner + columns + 1
    faces = np.stack([corner, below, below + 1, corner, below + 1, corner + 1], axis=1).reshape(-1, 3)
    return u.ravel(), v.ravel(), faces.astype(np.uint32)


def _circle(u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # Exactly closed: the seam's two columns must be the same points.
    phi = 2.0 * np.pi * (u % 1.0)
    return np.cos(phi), np.sin(phi)


def sphere() -> Triangles:
    """Unit sphere about the origin; u = φ/2π, v = θ/π, θ from +z."""
    u, v, faces = _grid(ALONG, AROUND)
    cos_phi, sin_phi = _circle(u)
    sin_theta = np.where((v == 0.0) | (v == 1.0), 0.0, np.sin(np.pi * v))
    points = np.stack([sin_theta * cos_phi, sin_theta * sin_phi, np.cos(np.pi * v)], axis=1)
    area = np.linalg.norm(np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]), axis=1)
    return Triangles(points, points.copy(), np.stack([u, v], axis=1), faces[area > 1e-12])  # one triangle a cell at the poles


def cylinder() -> Triangles:
    """Unit cylinder about z from z = 0 to 1, without caps, as in Mitsuba; u = φ/2π, v = z."""
    u, v, faces = _grid(1, AROUND)
    cos_phi, sin_phi = _circle(u)
    zero = np.zeros_like(u)
    points = np.stack([cos_phi, sin_phi, v], axis=1)
    return Triangles(points, np.stack([cos_phi, sin_phi, zero], axis=1), np.stack([u, v], axis=1), faces[:, [0, 2, 1]])


def disk() -> Triangles:
    """Unit disk in z = 0 facing +z; u = radius, v = φ/2π. A centre vertex per slice, so that v is right there too."""
    u = np.arange(AROUND + 1) / AROUND
    cos_phi, sin_phi = _circle(u)
    rim = np.stack([cos_phi, sin_phi, np.zeros_like(u)], axis=1)
    points = np.concatenate([rim, np.zeros((AROUND, 3))])
    uvs = np.concatenate([np.stack([np.ones_like(u), u], 1), np.stack([np.zeros(AROUND), u[:-1] + 0.5 / AROUND], 1)])
    slices = np.arange(AROUND)
    faces = np.stack([slices + AROUND + 1, slices, slices + 1], axis=1)
    return Triangles(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)), uvs, faces.astype(np.uint32))


CANONICAL = {"sphere": sphere, "cylinder": cylinder, "disk": disk}


def place(shape: Triangles, to_world: NDArray[np.float64], inward: bool) -> Triangles:
    """The triangles under an affine (4, 4) to_world. inward: the normals shall point against the canonical ones' images
    (Mitsuba's `flip_normals`). Normals go by the inverse transpose; the winding follows the normals, mirrored or not."""
    linear = np.asarray(to_world, np.float64)[:3, :3]
    positions = shape.positions @ linear.T + np.asarray(to_world, np.float64)[:3, 3]
    normals = shape.normals @ np.linalg.inv(linear)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    if inward:
        normals = -normals
    faces = orient(positions, normals[shape.faces].sum(axis=1), shape.faces)
    return Triangles(positions, normals, shape.uvs, faces)


def orient(positions: NDArray, face_normals: NDArray, faces: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """faces, wound so that each is counter-clockwise seen from where its given (F, 3) normal points."""
    a, b, c = (np.asarray(positions, np.float64)[faces[:, i]] for i in range(3))
    away = np.einsum("ij,ij->i", np.cross(b - a, c - a), face_normals) < 0.0
    return np.where(away[:, None], faces[:, [0, 2, 1]], faces).astype(np.uint32)


def unweld(positions: NDArray, face_normals: NDArray, faces: NDArray[np.uint32], uvs: NDArray | None) -> Triangles:
    """Three own vertices for each triangle, all with the face's normal: flat shading."""
    index = faces.ravel()
    new_uvs = None if uvs is None else uvs[index]
    new_faces = np.arange(len(index), dtype=np.uint32).reshape(-1, 3)
    return Triangles(positions[index], np.repeat(face_normals, 3, axis=0), new_uvs, new_faces)
