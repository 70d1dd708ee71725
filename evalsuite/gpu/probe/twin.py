"""The probe's faces once more, by casting rays in float64: independent of the rasteriser, its buffers and its filters."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import cubemap, mesh_colors, polygon
from evalsuite.math.probe import SUBSAMPLES, subsample_offsets
from evalsuite.scene.model import Room

Float = NDArray[np.float64]


@lru_cache(maxsize=8)
def faces(room: Room, centre: tuple[float, float, float], width: int, lit_here: bool) -> Float:
    """(6, w, w, 3) mean radiance of the room over the texels of a cubemap at centre, on the samples that the GPU takes.

    lit_here: light from the lamps alone, without shadows; else what was baked."""
    total, weight = np.zeros((6, width, width, 3)), np.zeros((width, width, 1))
    row, column = np.meshgrid(np.arange(width), np.arange(width), indexing="ij")
    for x, y in subsample_offsets(SUBSAMPLES):
        a, b = 2.0 * (column + x) / width - 1.0, 2.0 * (row + y) / width - 1.0
        omega = ((1.0 + a * a + b * b) ** -1.5)[..., None]
        weight += omega
        for face in range(6):
            d = cubemap.AXIS[face] + a[..., None] * cubemap.S[face] + b[..., None] * cubemap.T[face]
            total[face] += omega * radiance(room, centre, d.reshape(-1, 3), lit_here).reshape(width, width, 3)
    return total / weight


def radiance(room: Room, centre: tuple[float, float, float], directions: Float, lit_here: bool) -> Float:
    """(N, 3) radiance that arrives at centre from directions (N, 3); 0 where the room is open."""
    corners = room.corners.astype(np.float64)
    hit, u, v = polygon.first_hit(centre, directions, corners)
    seen = hit >= 0
    out, at = np.zeros((len(directions), 3)), (hit[seen], u[seen], v[seen])
    if not lit_here:
        out[seen] = mesh_colors.lookup(room.radiance, room.divisions, *at)
        return out
    triangle = corners[at[0]]
    edges = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    points = triangle[:, 0] + at[1][:, None] * edges[0] + at[2][:, None] * edges[1]
    normal = np.cross(*edges)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    irradiance = np.zeros_like(points)
    first = mesh_colors.first_sample(room.divisions)
    for number, lamp in enumerate(corners):
        count = int(mesh_colors.sample_count(room.divisions[number]))
        emitted = room.emission[first[number] : first[number] + count].astype(np.float64).mean(axis=0)
        if emitted.max() > 0:
            shone_on = (points - lamp[0]) @ np.cross(lamp[1] - lamp[0], lamp[2] - lamp[0]) > 0
            irradiance += (polygon.form_factor(points, normal, lamp) * shone_on)[:, None] * emitted
    out[seen] = mesh_colors.lookup(room.emission, room.divisions, *at)
    out[seen] += mesh_colors.lookup(room.reflectance, room.divisions, *at) / np.pi * irradiance
    return out
