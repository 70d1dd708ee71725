"""What paraboloid and sphere maps share: a unit circle in a square of texels. Exact integrals over cut texels, look-ups."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
Lookup = Callable[[Float], Float]


def centred_edges(size: int, border: float = 0.0) -> Float:
    """Texel edges (size + 1,) of a map of size² texels whose unit circle is drawn with radius size/2 − border texels."""
    return (np.arange(size + 1) - 0.5 * size) / (0.5 * size - border)


def centres(size: int, border: float = 0.0) -> Float:
    """Texel centres (size,) in the coordinates of `centred_edges`."""
    return (np.arange(size) + 0.5 - 0.5 * size) / (0.5 * size - border)


def inside_circle(size: int, border: float = 0.0, ring: float = 0.0) -> NDArray[np.bool_]:
    """Whether each texel's centre lies in the circle, (n, n), or within `ring` texels outside it."""
    doubled = (2 * np.arange(size) + 1 - size) ** 2  # whole numbers: the shader's comparison, without rounding
    return doubled[None, :] + doubled[:, None] <= circle_limit(size, border, ring)


def circle_limit(size: int, border: float, ring: float = 0.0) -> int:
    """Largest (2i + 1 − n)² + (2j + 1 − n)² of a texel (i, j) whose centre lies in the circle or in the ring around it."""
    return int(np.floor((size - 2.0 * border + 2.0 * ring) ** 2))


def texel_means(
    lookup: Lookup,
    to_direction: Callable[[Float, Float], Float],
    weigh: Callable[[Float, Float], Float],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    subsamples: int,
    size: int,
    border: float,
) -> tuple[Float, Float]:
    """(mean radiance (N, C), summed weights (N,)) of texels, each over k × k sub-samples at the centres of a regular grid.

    lookup: radiance (..., C) at directions (..., 3); to_direction: (x, y) → direction; weigh: (x, y) → weight of a sub-sample,
    its solid angle up to a factor. Texels without weight are 0.
    """
    radius, shift = 0.5 * size - border, (np.arange(subsamples) + 0.5) / subsamples
    means, weights = [], []
    for part in np.array_split(np.arange(len(rows)), len(rows) * subsamples // 500_000 + 1):  # bounded memory
        x = (columns[part, None] + shift - 0.5 * size) / radius
        total, weight = 0.0, np.zeros(len(part))
        for dy in shift:
            y = ((rows[part] + dy - 0.5 * size) / radius)[:, None]
            w = weigh(x, np.broadcast_to(y, x.shape))
            weight += w.sum(1)
            total = total + np.einsum("nk,nkc->nc", w, lookup(to_direction(x, y)))
        means.append(total / np.where(weight > 0, weight, 1.0)[:, None])
        weights.append(weight)
    return np.concatenate(means), np.concatenate(weights)


def second_difference(corner: Float) -> Float:
    """Integral over each texel from that over [0, x] × [0, y] at its corners, (n + 1, n + 1) → (n, n)."""
    return corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1]


def disc_texels(edges: ArrayLike, line: Callable[[Float, Float], Float], arc: float) -> Float:
    """∫ over texel ∩ unit disc of a density that depends on the radius alone, (n, n), by Green's theorem.

    The density g(ρ) is the divergence of G(ρ)(x, y), so an integral is ∮ G (x dy − y dx). line(a, b): that integral up the line
    x = a from y = 0 to b. arc: its value for one radian of the unit circle, G(1). On lines through the origin it vanishes;
    hence, for x, y ≥ 0, the integral over [0, x] × [0, y] ∩ disc is
        **line(x, min(y, √(1 − x²))) + line(y, min(x, √(1 − y²))) + arc · max(0, asin y − acos x)**,
    odd in x and in y; a texel is its second difference, not below 0 (rounding leaves −10⁻¹⁶ of slivers).
    """
    e = np.clip(np.asarray(edges, np.float64), -1.0, 1.0)
    x, y = np.abs(e)[None, :], np.abs(e)[:, None]
    corner = line(x, np.minimum(y, np.sqrt(1.0 - x * x))) + line(y, np.minimum(x, np.sqrt(1.0 - y * y)))
    corner = corner + arc * np.maximum(0.0, np.arcsin(y) - np.arccos(x))
    texels = second_difference(np.sign(e)[None, :] * np.sign(e)[:, None] * corner)
    edges = np.asarray(edges, np.float64)
    nearest = np.maximum(0.0, np.maximum(edges[:-1], -edges[1:]))
    outside = np.hypot(nearest[None, :], nearest[:, None]) >= 1.0
    return np.where(outside, 0.0, np.maximum(texels, 0.0))


def footprint(size: int, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
    """The texels (n, n) that `bilinear` reads at x, y: (...) in texels."""
    i, j = (np.clip(np.floor(np.asarray(v) - 0.5), 0, size - 1).astype(np.int64) for v in (x, y))
    read = np.zeros((size, size), dtype=bool)
    for dj in (0, 1):
        for di in (0, 1):
            read[np.minimum(j + dj, size - 1), np.minimum(i + di, size - 1)] = True
    return read


def bilinear(texels: ArrayLike, x: ArrayLike, y: ArrayLike) -> Float:
    """Texture look-up clamped to the edge. texels: (h, w, C); x, y: (...) in texels, centres at ½. Returns (..., C) float64."""
    texels = np.asarray(texels)
    height, width = texels.shape[:2]
    x = np.clip(np.asarray(x, np.float64) - 0.5, 0.0, width - 1.0)
    y = np.clip(np.asarray(y, np.float64) - 0.5, 0.0, height - 1.0)
    i, j = np.minimum(x.astype(np.int64), max(width - 2, 0)), np.minimum(y.astype(np.int64), max(height - 2, 0))
    right, below = np.minimum(i + 1, width - 1), np.minimum(j + 1, height - 1)
    p, q = (x - i)[..., None], (y - j)[..., None]
    flat = np.ascontiguousarray(texels).reshape(height * width, -1)

    def texel(row: NDArray[np.int64], column: NDArray[np.int64]) -> Float:
        return np.take(flat, row * width + column, axis=0)  # thrice as fast as texels[row, column]

    upper = (1.0 - p) * texel(j, i) + p * texel(j, right)
    lower = (1.0 - p) * texel(below, i) + p * texel(below, right)
    return (1.0 - q) * upper + q * lower
