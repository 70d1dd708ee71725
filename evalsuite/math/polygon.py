"""Light from triangles and rays against them, in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


def form_factor(points: ArrayLike, normals: ArrayLike, triangle: ArrayLike) -> Float:
    """∫ (n·l)₊ dω over a triangle seen from points, (N,) [sr]: its irradiance for unit radiance, nothing in between.

    points, normals: (N, 3), unit normals; triangle: (3, 3). The triangle is clipped at each point's horizon; then Lambert's
    formula, with unit vectors v_k to the corners and Θ_k the angle between v_k and v_{k+1}:
        **E = ½ |Σ_k Θ_k n · (v_k × v_{k+1})/|v_k × v_{k+1}||**.
    Which side of the triangle shines is the caller's to ask.
    """
    points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    corners = np.asarray(triangle, np.float64)[None] - points[:, None]
    height = np.einsum("nkc,nc->nk", corners, normals)
    # Sutherland–Hodgman at height 0: each edge hands on its first corner if that is above, and where it crosses.
    polygon = np.zeros((len(points), 6, 3))
    for k in range(3):
        here, there = height[:, k], height[:, (k + 1) % 3]
        crosses = (here > 0) != (there > 0)
        t = np.divide(here, here - there, out=np.zeros_like(here), where=crosses)[:, None]
        crossing = corners[:, k] + t * (corners[:, (k + 1) % 3] - corners[:, k])
        polygon[:, 2 * k] = np.where((here > 0)[:, None], corners[:, k], np.nan)
        polygon[:, 2 * k + 1] = np.where(crosses[:, None], crossing, np.nan)
    return _lambert(_compact(polygon), normals)


def _compact(polygon: Float) -> Float:
    """Gaps (NaN) filled with the corner before, which adds nothing to the sum; all 0 where no corner is left."""
    first = np.argmax(~np.isnan(polygon[:, :, 0]), axis=1)
    last = polygon[np.arange(len(polygon)), first]
    out = np.empty_like(polygon)
    for k in range(polygon.shape[1]):
        last = np.where(np.isnan(polygon[:, k]), last, polygon[:, k])
        out[:, k] = last
    return np.nan_to_num(out)


def _lambert(polygon: Float, normals: Float) -> Float:
    length = np.linalg.norm(polygon, axis=-1, keepdims=True)
    v = np.divide(polygon, length, out=np.zeros_like(polygon), where=length > 0)
    following = np.roll(v, -1, axis=1)
    cross = np.cross(v, following)
    sine = np.linalg.norm(cross, axis=-1)
    angle = np.arctan2(sine, (v * following).sum(-1))
    per_edge = np.divide(angle, sine, out=np.zeros_like(angle), where=sine > 0)
    return 0.5 * np.abs(np.einsum("nk,nkc,nc->n", per_edge, cross, normals))


def first_hit(origin: ArrayLike, directions: ArrayLike, triangles: ArrayLike) -> tuple[NDArray[np.int64], Float, Float]:
    """The nearest front-facing triangle (counter-clockwise seen from the origin) along rays from one point.

    origin: (3,); directions: (N, 3), any length; triangles: (F, 3, 3). Returns, each (N,), its index (−1 for none) and
    the weights u, v of its second and third corner there (Möller and Trumbore 1997).
    """
    directions, triangles = np.asarray(directions, np.float64), np.asarray(triangles, np.float64)
    nearest = np.full(len(directions), np.inf)
    hit, out_u, out_v = np.full(len(directions), -1), np.zeros(len(directions)), np.zeros(len(directions))
    to_origin = np.asarray(origin, np.float64) - triangles[:, 0]
    for number, ((a, b, c), s) in enumerate(zip(triangles, to_origin, strict=True)):
        e1, e2 = b - a, c - a
        if np.cross(e1, e2) @ s <= 0:  # the origin is behind it
            continue
        p = np.cross(directions, e2)
        determinant = p @ e1
        with np.errstate(divide="ignore", invalid="ignore"):
            u = p @ s / determinant
            q = np.cross(s, e1)
            v = directions @ q / determinant
            t = e2 @ q / determinant
        closer = (determinant > 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < nearest)
        nearest[closer], hit[closer], out_u[closer], out_v[closer] = t[closer], number, u[closer], v[closer]
    return hit, out_u, out_v
