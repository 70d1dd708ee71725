"""Sphere maps (Heidrich, course notes §2.1): the picture of a small mirror ball seen from one direction, in float64.

The map's frame: +z = v₀ points to the viewer, +x to his right, +y up. A direction r is found at the xy of the ball's normal
h = (v₀ + r)/‖v₀ + r‖, in the unit disc. r = v₀ is the centre, and the whole rim is the one direction r = −v₀. A map is (n, n, C),
indexed [row, column], x growing with the column and y with the row; the disc has radius n/2 − border texels. Outside it lies
the rim's direction too.

With θ_r = 2θ_h and ρ = sin θ_h, dω = sin θ_r dθ_r dφ = 4 sin θ_h cos θ_h dθ_h dφ = **4 dA**: all texels have one solid angle.
What goes to zero towards −v₀ is the sampling along the radius, dρ/dθ_r = ½ cos θ_h, while that along the rim grows without bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.disc_map import Lookup, bilinear, centred_edges, centres, disc_texels, texel_means

Float = NDArray[np.float64]


def frame(view: ArrayLike) -> Float:
    """(3, 3) rotation from the map's frame to the world, columns right, up, v₀. view: (3,) v₀, towards the viewer, any length
    but zero. Up is the world's +y as far as it can be, −z where v₀ is vertical."""
    v0 = np.asarray(view, dtype=np.float64)
    v0 = v0 / np.linalg.norm(v0)
    right = np.cross([0.0, 1.0, 0.0] if abs(v0[1]) < 1.0 - 1e-9 else [0.0, 0.0, -1.0], v0)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(v0, right), v0], axis=-1)


def direction_to_disc(directions: ArrayLike) -> tuple[Float, Float]:
    """(x, y), each (...), of directions (..., 3) in the map's frame, any length but zero.

    ‖v₀ + r‖ = √(2(1 + r_z))  ⇒  **(x, y) = (r_x, r_y)/√(2(1 + r_z))**; behind, where 1 + r_z cancels, the same with
    1 + r_z = (r_x² + r_y²)/(1 − r_z). At r = −v₀ itself any point of the rim would do; (0, −1) is returned.
    """
    d = np.asarray(directions, dtype=np.float64)
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    z, side = d[..., 2], np.hypot(d[..., 0], d[..., 1])
    front = 1.0 / np.sqrt(2.0 * np.maximum(1.0 + z, 0.5))
    beside = side > 1e-300  # the reciprocal of less has no number
    scale = np.where(z > 0, front, np.sqrt(0.5 * (1.0 - z)) / np.where(beside, side, 1.0))
    singular = ~beside & (z < 0)
    return d[..., 0] * scale, np.where(singular, -1.0, d[..., 1] * scale)


def disc_to_direction(x: ArrayLike, y: ArrayLike) -> Float:
    """Unit direction (..., 3) at (x, y): r = 2(h·v₀)h − v₀ with h = (x, y, √(1 − x² − y²)); outside the disc −v₀.

    **r = (2 h_z x, 2 h_z y, 1 − 2(x² + y²))**.
    """
    x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    squared = np.minimum(x * x + y * y, 1.0)
    h_z = np.sqrt(1.0 - squared)
    return np.stack([2.0 * h_z * x, 2.0 * h_z * y, 1.0 - 2.0 * squared], axis=-1)


def texel_directions(size: int, border: float = 0.0) -> Float:
    """Unit direction of each texel centre in the map's frame, (n, n, 3)."""
    c = centres(size, border)
    return disc_to_direction(c[None, :], c[:, None])


def texel_solid_angles(size: int, border: float = 0.0) -> Float:
    """Exact solid angle of each texel's part inside the disc, (n, n) [sr]; they sum to 4π. 4 times the area: 4 is the
    divergence of 2(x, y), whence 2ab up a line x = a from 0 to b."""
    return disc_texels(centred_edges(size, border), lambda a, b: 2.0 * a * b, 2.0)


def matched_radius(face_size: int) -> float:
    """Radius [texels] of a disc that holds as many texels as a cube map: πR² = 6w²  ⇒  **R = w √(6/π)**."""
    return float(face_size * np.sqrt(6.0 / np.pi))


def subsamples(size: int, border: float, spacing: float) -> NDArray[np.int64]:
    """Sub-samples a side for each texel, (n, n), one of a few numbers: so many that they lie at most 0.4 of `spacing` [rad] of
    the source apart along the radius, where a texel spans from 2/R at the centre to 2√(2/R) [rad] on the rim. At least 2 (1 in
    a constant map), at most 64."""
    if not np.isfinite(spacing):
        return np.ones((size, size), dtype=np.int64)
    radius = 0.5 * size - border
    c = centres(size, border)
    rho = np.hypot(c[None, :], c[:, None])
    reach = 0.5 * np.sqrt(2.0) / radius  # half a texel's diagonal
    outer, inner = np.minimum(rho + reach, 1.0), np.minimum(np.maximum(rho - reach, 0.0), 1.0)
    span = 2.0 * (np.arcsin(outer) - np.arcsin(inner))
    steps = np.array([2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64])
    return steps[np.searchsorted(steps, np.clip(span / np.sqrt(2.0) / (0.4 * spacing), 2.0, 64.0) - 1e-9)]


def resample(lookup: Lookup, size: int, border: float, counts: ArrayLike, wanted: ArrayLike | None = None) -> Float:
    """The map, (n, n, C), each texel its mean radiance over the solid angle of its part inside the disc.

    lookup: radiance (..., C) at directions (..., 3) in the map's frame. counts: (n, n) sub-samples a side. wanted: (n, n) bool,
    the texels to make. Sub-samples on the rim count by how much of their own cell lies inside; texels wholly outside, and
    unwanted ones, hold the radiance of −v₀.
    """
    counts, radius = np.asarray(counts), 0.5 * size - border
    rim = lookup(np.array([[0.0, 0.0, -1.0]]))[0]
    out = np.broadcast_to(rim, (size, size, len(rim))).copy()
    c = centres(size, border)
    touched = np.hypot(c[None, :], c[:, None]) < 1.0 + 1.5 / radius
    touched &= True if wanted is None else np.asarray(wanted)
    for k in np.unique(counts[touched]):
        rows, columns = np.nonzero(touched & (counts == k))

        def inside(x: Float, y: Float, k: int = k) -> Float:
            return np.clip(0.5 + (1.0 - np.hypot(x, y)) * radius * k, 0.0, 1.0)

        mean, weight = texel_means(lookup, disc_to_direction, inside, rows, columns, int(k), size, border)
        some = weight > 0
        out[rows[some], columns[some]] = mean[some]
    return out


def integral(texels: ArrayLike, border: float) -> Float:
    """∫ L dω over the sphere, (C,) [W m⁻²], each texel times its exact solid angle."""
    texels = np.asarray(texels, dtype=np.float64)
    return np.einsum("yxc,yx->c", texels, texel_solid_angles(texels.shape[0], border))


def map_lookup(texels: ArrayLike, border: float, directions: ArrayLike) -> Float:
    """Bilinear radiance (..., C) at directions (..., 3) in the map's frame, clamped to the edge. texels: (n, n, C)."""
    size = np.shape(texels)[0]
    x, y = direction_to_disc(directions)
    radius = 0.5 * size - border
    return bilinear(texels, 0.5 * size + radius * x, 0.5 * size + radius * y)
