"""Lat-long maps on the sphere, in the layout of Mitsuba 3.9's `envmap`: the one place where directions become texels.

Local frame: +y is the pole of row 0, u = 0 looks along −z and grows towards +x. Texel *centres* sit at u = (i + ½)/W and
wrap around; texel *corners* bound v: row 0 is the +y pole itself, row H−1 the −y pole. All in float64.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


def direction_to_latlong(directions: ArrayLike) -> tuple[Float, Float]:
    """Lat-long coordinates of directions.

    directions: (..., 3) in the map's local frame, any length but zero. Returns (u, v), each (...), u in [0, 1), v in [0, 1]:
    u = atan2(x, −z) / 2π mod 1, v = θ/π with θ the angle from +y.
    """
    x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    u = np.arctan2(x, -z) / (2.0 * np.pi)
    u -= np.floor(u)
    u = np.where(u >= 1.0, 0.0, u)  # −1e-20 wraps to exactly 1
    # atan2 rather than acos(y): full precision near the poles.
    return u, np.arctan2(np.hypot(x, z), y) / np.pi


def latlong_to_direction(u: ArrayLike, v: ArrayLike) -> Float:
    """Unit direction (..., 3) in the local frame at lat-long coordinates u, v; inverse of `direction_to_latlong`."""
    phi, theta = np.broadcast_arrays(2.0 * np.pi * np.asarray(u, np.float64), np.pi * np.asarray(v, np.float64))
    sin_theta = np.sin(theta)
    return np.stack([sin_theta * np.sin(phi), np.cos(theta), -sin_theta * np.cos(phi)], axis=-1)


def latlong_directions(height: int, width: int) -> Float:
    """Unit direction of each texel, (H, W, 3), local frame. All texels of the first (last) row are the +y (−y) pole."""
    v = np.arange(height) / (height - 1) if height > 1 else np.array([0.5])
    return latlong_to_direction((np.arange(width) + 0.5)[None, :] / width, v[:, None])


def latlong_lookup(radiance: ArrayLike, directions: ArrayLike) -> Float:
    """Bilinear look-up, the float64 twin of Mitsuba's `envmap`.

    radiance: (H, W, C) lat-long [W m⁻² sr⁻¹]. directions: (..., 3), local frame. Returns (..., C) float64.
    A map of one row is constant in v, of one column constant in u.
    """
    radiance = np.asarray(radiance)
    height, width = radiance.shape[:2]
    u, v = direction_to_latlong(directions)
    x, y = u * width - 0.5, v * (height - 1)
    column, row = np.floor(x), np.clip(np.floor(y), 0, max(height - 2, 0))
    across, down = (x - column)[..., None], (y - row)[..., None]
    left, top = column.astype(np.int64) % width, row.astype(np.int64)
    right, bottom = (left + 1) % width, np.minimum(top + 1, height - 1)
    texels = np.ascontiguousarray(radiance).reshape(height * width, -1)

    def texel(row: NDArray[np.int64], column: NDArray[np.int64]) -> Float:
        return np.take(texels, row * width + column, axis=0).astype(np.float64)  # thrice as fast as radiance[row, column]

    upper = (1.0 - across) * texel(top, left) + across * texel(top, right)
    lower = (1.0 - across) * texel(bottom, left) + across * texel(bottom, right)
    return (1.0 - down) * upper + down * lower


def latlong_spacing(height: int, width: int) -> float:
    """Smaller of a texel's two sides at the equator [rad]: 2π/W and π/(H−1). Infinite for a constant map of 1 × 1."""
    return float("inf") if height * width == 1 else min(2.0 * np.pi / width, np.pi / max(height - 1, 1))


def latlong_solid_angles(height: int, width: int) -> Float:
    """Exact weights ω [sr], (H, W), with Σ L·ω = ∫ of the bilinear interpolant of L over the sphere; they sum to 4π.

    Row j carries the hat function Λ of half width δ = π/(H−1) centred at θ_j = jδ:
        ∫ Λ(θ−θ_j) sin θ dθ = sin θ_j · 2(1 − cos δ)/δ     inside,
        ∫₀^δ (1 − θ/δ) sin θ dθ = 1 − sin δ/δ               at the two poles,
    times 2π/W for each column.
    """
    if height == 1:
        return np.full((1, width), 4.0 * np.pi / width)
    delta = np.pi / (height - 1)
    # 1 − cos δ = 2 sin²(δ/2): no cancellation for tall maps.
    rows = np.sin(np.arange(height) * delta) * 4.0 * np.sin(delta / 2) ** 2 / delta
    rows[0] = rows[-1] = 1.0 - np.sin(delta) / delta
    return np.repeat((rows * (2.0 * np.pi / width))[:, None], width, axis=1)
