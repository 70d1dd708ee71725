"""How much of a disc-shaped light at infinity polygons cover, seen from a point; all in float64.

The light's disc is drawn on the plane that touches the sphere of directions at its centre D: radius tan α there, 1 after scaling.
A point's view of an edge is then two points a, b of that plane, and the disc is the unit disc about 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
_BATCH = 1 << 16  # points × triangles at once


def half_plane(offset: ArrayLike) -> Float:
    """Visible part of the unit disc beside a straight edge at a signed offset x from its centre:
    **V = ½ + (x √(1 − x²) + asin x)/π**, 0 at x ≤ −1 and 1 at x ≥ 1."""
    x = np.clip(np.asarray(offset, np.float64), -1.0, 1.0)
    return 0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / np.pi


def tangent_frame(direction: ArrayLike) -> tuple[Float, Float]:
    """(T, B), unit and normal to a unit direction D, with T × B = D."""
    d = np.asarray(direction, np.float64)
    t = np.cross((1.0, 0.0, 0.0) if abs(d[0]) < 0.9 else (0.0, 1.0, 0.0), d)
    t /= np.linalg.norm(t)
    return t, np.cross(d, t)


def _cross(a: Float, b: Float) -> Float:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _angle(a: Float, b: Float) -> Float:
    return np.arctan2(_cross(a, b), (a * b).sum(-1))


def chord(a: ArrayLike, b: ArrayLike) -> tuple[Float, Float, NDArray[np.bool_]]:
    """(q₀, q₁, whether there is any): the part of the segments a → b, (..., 2), within the unit disc.

    t± = (−a·d ± √(|d|² − (a × b)²))/|d|², d = b − a, within [0, 1].
    """
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    d = b - a
    length2 = (d * d).sum(-1)
    root = length2 - _cross(a, b) ** 2
    some = (root > 0.0) & (length2 > 0.0)
    root, divisor = np.sqrt(np.where(some, root, 0.0)), np.where(length2 > 0.0, length2, 1.0)
    middle = -(a * d).sum(-1)
    first, last = np.clip((middle - root) / divisor, 0.0, 1.0), np.clip((middle + root) / divisor, 0.0, 1.0)
    return a + first[..., None] * d, a + last[..., None] * d, some & (first < last)


def segment_sliver(a: ArrayLike, b: ArrayLike) -> Float:
    """Part of the unit disc between the chord of a → b and its rim, seen from the centre, positive where the centre lies on the
    left: **s = (θ − q₀ × q₁)/2π**, θ the angle from q₀ to q₁. 0 without a chord."""
    q0, q1, some = chord(a, b)
    return np.where(some, (_angle(q0, q1) - _cross(q0, q1)) / (2.0 * np.pi), 0.0)


def segment_area(a: ArrayLike, b: ArrayLike) -> Float:
    """Signed area of the unit disc within the triangle (0, a, b): **S = ½ [∠(a, q₀) + ∠(q₁, b) + q₀ × q₁]**, ½ ∠(a, b) without a
    chord. Summed around a polygon it is the area that the polygon covers."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    q0, q1, some = chord(a, b)
    return 0.5 * np.where(some, _angle(a, q0) + _angle(q1, b) + _cross(q0, q1), _angle(a, b))


def coverage_of_triangles(
    points: ArrayLike, triangles: ArrayLike, direction: ArrayLike, radius: float, tolerance: float = 1e-5
) -> Float:
    """Part of a light's disc that closed meshes cover, seen from points (P, 3): (P,), not clamped, since layers add up.

    triangles: (F, 3, 3), counter-clockwise from outside; those turned away from a point count, so that a convex mesh counts
    once. direction, radius: of the light, unit and [rad]. tolerance: distance from a triangle's plane, in units of the scene,
    below which a point lies in it. Each triangle is clipped to what lies before the light, projected, and its S summed.
    """
    points, triangles = np.asarray(points, np.float64), np.asarray(triangles, np.float64)
    d = np.asarray(direction, np.float64)
    t, b = tangent_frame(d)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normal, axis=1)
    triangles, normal = triangles[area > 0], normal[area > 0] / area[area > 0, None]
    covered = np.zeros(len(points))
    step = max(1, _BATCH // max(len(triangles), 1))
    scale = 1.0 / np.tan(radius)
    for first in range(0, len(points), step):
        part = points[first : first + step]
        away = np.einsum("fc,pfc->pf", normal, triangles[None, :, 0] - part[:, None]) > tolerance
        point, face = np.nonzero(away)
        if len(point) == 0:
            continue
        seen = triangles[face] - part[point][:, None]
        polygon = _before(seen, seen @ d)
        height = polygon @ d
        flat = np.stack([polygon @ t, polygon @ b], axis=-1) * (scale / height)[..., None]
        area_of = segment_area(flat, np.roll(flat, -1, axis=1)).sum(1) / np.pi
        covered[first : first + step] = np.bincount(point, np.nan_to_num(area_of), len(part))
    return covered


def _before(corners: Float, height: Float) -> Float:
    """Triangles (N, 3, 3) cut off where their height (N, 3) falls to next to nothing: polygons (N, 6, 3), corners repeated
    where there are fewer, NaN where nothing is left."""
    least = 1e-7 * np.abs(corners).max(axis=(1, 2))[:, None] + 1e-300
    height = height - least
    polygon = np.full((len(corners), 6, 3), np.nan)
    for k in range(3):
        here, there = height[:, k], height[:, (k + 1) % 3]
        crosses = (here > 0) != (there > 0)
        part = np.divide(here, here - there, out=np.zeros_like(here), where=crosses)[:, None]
        polygon[here > 0, 2 * k] = corners[here > 0, k]
        polygon[crosses, 2 * k + 1] = (corners[:, k] + part * (corners[:, (k + 1) % 3] - corners[:, k]))[crosses]
    start = np.argmax(~np.isnan(polygon[..., 0]), axis=1)
    last = polygon[np.arange(len(polygon)), start]
    for k in range(6):
        last = np.where(np.isnan(polygon[:, k]), last, polygon[:, k])
        polygon[:, k] = last
    return polygon


def disc_directions(direction: ArrayLike, radius: float, count: int, seed: int = 0) -> Float:
    """About `count` directions (N, 3), not normalised, jittered evenly over a light's disc in the plane that touches at its
    centre."""
    d = np.asarray(direction, np.float64)
    t, b = tangent_frame(d)
    side = max(1, int(np.sqrt(count)))
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1).reshape(-1, 2)
    u = (cell + np.random.default_rng(seed).random((side * side, 2))) / side
    distance, azimuth = np.tan(radius) * np.sqrt(u[:, :1]), 2.0 * np.pi * u[:, 1:]
    return d + distance * (np.cos(azimuth) * t + np.sin(azimuth) * b)


def visible_fraction_sampled(
    points: ArrayLike, triangles: ArrayLike, direction: ArrayLike, radius: float, samples: int = 256, nearest: float = 1e-4
) -> Float:
    """Visible part of a light's disc by brute force: rays to `samples` places of it, stopped by any triangle (F, 3, 3) from
    either side beyond `nearest`, in units of the scene. (P,)."""
    points, triangles = np.asarray(points, np.float64), np.asarray(triangles, np.float64)
    rays = disc_directions(direction, radius, samples)
    e1, e2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(rays[:, None], e2[None])
    determinant = np.einsum("rfc,fc->rf", p, e1)
    inverse = np.divide(1.0, determinant, out=np.full_like(determinant, np.nan), where=determinant != 0)
    visible = np.empty(len(points))
    for i, point in enumerate(points):
        s = point - triangles[:, 0]
        q = np.cross(s, e1)
        u, v = np.einsum("rfc,fc->rf", p, s) * inverse, rays @ q.T * inverse
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & ((e2 * q).sum(-1) * inverse > nearest)
        visible[i] = 1.0 - hit.any(axis=1).mean()
    return visible
