"""Dual paraboloid maps (Heidrich, course notes §2.3–2.4; Heidrich and Seidel 1998), in float64.

The map's frame: d₀ = +z points to the viewer of the front map. The paraboloid z = ½ − ½(x² + y²) reflects a direction r to the
point (x, y) whose normal (x, y, 1) is along d₀ + r. Hemisphere 0 (front) holds r_z ≥ 0, hemisphere 1 (back) the rest, with the
same x and y: on the rim both maps agree. A map is (2, n, n, C), indexed [hemisphere, row, column]; the unit circle is drawn
with radius n/2 − border texels about its centre, x grows with the column and y with the row. Outside the circle the
paraboloid goes on, and a texel there repeats what the other map holds at (x, y)/(x² + y²).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.disc_map import (
    Lookup,
    bilinear,
    centred_edges,
    centres,
    disc_texels,
    second_difference,
    texel_means,
)

Float = NDArray[np.float64]

FRONT, BACK = 0, 1

# Eq 10: divides by the z component.
P = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 0]], dtype=np.float64)


def direction_to_paraboloid(directions: ArrayLike, hemisphere: ArrayLike | None = None) -> tuple[NDArray[np.int64], Float, Float]:
    """(hemisphere, x, y) of directions (..., 3) in the map's frame, any length but zero.

    hemisphere: the map to use, also beyond its circle (infinitely far out at the other map's centre); None chooses by r_z.
    d₀ + r = k (x, y, 1) (Eq 8) with |r| = 1  ⇒  **x = r_x/(1 + r_z), y = r_y/(1 + r_z)**, and 1 − r_z for the back map.
    """
    d = np.asarray(directions, dtype=np.float64)
    half = np.where(d[..., 2] >= 0, FRONT, BACK) if hemisphere is None else np.broadcast_to(hemisphere, d.shape[:-1])
    below = np.linalg.norm(d, axis=-1) + np.where(half == FRONT, d[..., 2], -d[..., 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        return half, d[..., 0] / below, d[..., 1] / below


def paraboloid_to_direction(hemisphere: ArrayLike, x: ArrayLike, y: ArrayLike) -> Float:
    """Unit direction (..., 3) at (x, y) of a map, in or beyond its circle: r = 2(n·d₀)n − d₀ (Eq 6) with n ∝ (x, y, 1) (Eq 7)

    ⇒  **r = (2x, 2y, ±(1 − x² − y²)) / (1 + x² + y²)**, + in front.
    """
    hemisphere, x, y = np.broadcast_arrays(hemisphere, np.asarray(x, np.float64), np.asarray(y, np.float64))
    squared = x * x + y * y
    z = np.where(hemisphere == FRONT, 1.0 - squared, squared - 1.0)
    return np.stack([2.0 * x, 2.0 * y, z], axis=-1) / (1.0 + squared)[..., None]


def matrix_s(hemisphere: int) -> Float:
    """S (4, 4): homogeneous (r, 1) → d₀ + r in front; behind −d₀ + r with x and y turned round, so that P gives +x and +y.

    The printed Eq 11 (both papers) forms d₀ − r, which suits d₀ = (0, 0, −1) and a reflection r = d₀ + 2(n·d₀)n alone; with the
    d₀ = (0, 0, 1) of the course notes Eq 8 wants the sum.
    """
    side = 1.0 if hemisphere == FRONT else -1.0
    return np.array([[side, 0, 0, 0], [0, side, 0, 0], [0, 0, 1, side], [0, 0, 0, 1]])


def texture_matrix(hemisphere: int, size: int, border: float = 0.0, to_world: ArrayLike | None = None) -> Float:
    """(4, 4) that brings a unit world reflection (r, 1) to texture coordinates (s q, t q, q, q): Eq 9 and 12,

    **[½ scale, ½ shift] · P · S · M⁻¹**, with M = to_world (3, 3), the map's axes in the world as columns, and the circle
    shrunk by the border. q ≤ 0 only at the other map's centre.
    """
    inverse = np.eye(4)
    inverse[:3, :3] = np.eye(3) if to_world is None else np.asarray(to_world, np.float64).T
    scale = 0.5 - border / size
    to_texture = np.array([[scale, 0, 0, 0.5], [0, scale, 0, 0.5], [0, 0, 1, 0], [0, 0, 0, 1]])
    # P·S leaves (d₀ + r)_z in the third and fourth place, so the constant ½ is multiplied by it before the division.
    turned = to_texture @ P @ matrix_s(hemisphere) @ inverse
    return turned if hemisphere == FRONT else np.diag([-1.0, -1.0, -1.0, -1.0]) @ turned


def texel_directions(size: int, border: float = 0.0) -> Float:
    """Unit direction of each texel centre in the map's frame, (2, n, n, 3), also outside the circle."""
    c = centres(size, border)
    return np.stack([paraboloid_to_direction(half, c[None, :], c[:, None]) for half in (FRONT, BACK)])


def texel_solid_angles(size: int, border: float = 0.0, inside: bool = True) -> Float:
    """Exact solid angle of each texel of one map, (n, n) [sr]. inside: only what lies in the circle; both maps together then
    sum to 4π. Else of the whole texel on the paraboloid that goes on.

    Eq 2: dω = dA/‖f‖² with ‖f‖ = ½(1 + ρ²): dω = 4/(1 + ρ²)² dA, four times less on the rim than at the centre. It is the
    divergence of 2(x, y)/(1 + ρ²), whence up a line x = a from 0 to b: **2a/√(1 + a²) · atan(b/√(1 + a²))**.
    """

    def line(a: Float, b: Float) -> Float:
        root = np.sqrt(1.0 + a * a)
        return 2.0 * a / root * np.arctan(b / root)

    edges = centred_edges(size, border)
    if inside:
        return disc_texels(edges, line, 1.0)
    x, y = edges[None, :], edges[:, None]
    return second_difference(line(x, y) + line(y, x))


def matched_radius(face_size: int) -> float:
    """Radius [texels] of two circles that hold as many texels as a cube map: 2πR² = 6w²  ⇒  **R = w √(3/π)**."""
    return float(face_size * np.sqrt(3.0 / np.pi))


def matched_border(size: int) -> float:
    """Border [texels] of a map of size² whose circles hold as many texels as a cube map with faces size/2 wide; at least the 2
    that bilinear filtering across the seam takes."""
    return max(2.0, 0.5 * size - matched_radius(size // 2))


def subsamples_per_texel(size: int, border: float, spacing: float) -> int:
    """Sub-samples k a side so that they lie at most 0.4 of `spacing` [rad] of the source apart; a texel at the centre, where
    they are largest, spans 2/R [rad]."""
    return int(np.clip(np.ceil(2.0 / (0.5 * size - border) / (0.4 * spacing)), 2, 64)) if np.isfinite(spacing) else 1


def resample(lookup: Lookup, size: int, border: float, subsamples: int, wanted: ArrayLike | None = None) -> Float:
    """Both maps, (2, n, n, C), each texel its mean radiance over solid angle, the border and the corners included.

    lookup: radiance (..., C) at directions (..., 3) in the map's frame. wanted: (2, n, n) bool, the texels to make; the others
    are 0. Mean over k × k sub-samples weighted by 1/(1 + ρ²)².
    """
    wanted = np.ones((2, size, size), bool) if wanted is None else np.asarray(wanted)
    out: Float | None = None
    for half in (FRONT, BACK):
        rows, columns = np.nonzero(wanted[half])

        def to_direction(x: Float, y: Float, half: int = half) -> Float:
            return paraboloid_to_direction(half, x, y)

        mean, _ = texel_means(lookup, to_direction, _density, rows, columns, subsamples, size, border)
        if out is None:
            out = np.zeros((2, size, size, mean.shape[-1]))
        out[half, rows, columns] = mean
    return out


def _density(x: Float, y: Float) -> Float:
    return (1.0 + x * x + y * y) ** -2.0


def integral(maps: ArrayLike, border: float) -> Float:
    """∫ L dω over the sphere, (C,) [W m⁻²], each texel times its exact solid angle inside the circle."""
    maps = np.asarray(maps, dtype=np.float64)
    return np.einsum("hyxc,yx->c", maps, texel_solid_angles(maps.shape[1], border))


def box_mips(level0: ArrayLike) -> list[Float]:
    """The chain that hardware makes: plain 2 × 2 means down to 1 × 1. level0: (2, n, n, C), n = 2^k."""
    return _mips(level0, lambda size: np.ones((size, size)))


def weighted_mips(level0: ArrayLike, border: float) -> list[Float]:
    """The chain of the course notes §2.4: 2 × 2 means weighted by solid angle. level0: (2, n, n, C), n = 2^k, as `resample` makes
    it: the border and the corners hold what the other map does, so that filtering crosses the seam."""
    halved = iter(range(64))
    return _mips(level0, lambda size: texel_solid_angles(size, border / 2.0 ** next(halved), inside=False))


def _mips(level0: ArrayLike, weights: Callable[[int], Float]) -> list[Float]:
    def sum4(a: Float) -> Float:
        return a[..., ::2, ::2, :] + a[..., 1::2, ::2, :] + a[..., ::2, 1::2, :] + a[..., 1::2, 1::2, :]

    levels = [np.asarray(level0, dtype=np.float64)]
    while levels[-1].shape[1] > 1:
        w = weights(levels[-1].shape[1])[..., None]
        levels.append(sum4(levels[-1] * w) / sum4(w))
    return levels


class DualParaboloid:
    """Twin of two 2D textures clamped to the edge, bilinear in a level."""

    def __init__(self, levels: Sequence[ArrayLike], border: float) -> None:
        """levels: (2, n, n, C), (2, n/2, n/2, C) … radiance; one is enough. border [texels of level 0]."""
        self.levels = [np.asarray(level) for level in levels]
        self.border = border

    @property
    def size(self) -> int:
        """Texels along a side of level 0, border included."""
        return self.levels[0].shape[1]

    def texture_coordinates(self, directions: ArrayLike, hemisphere: ArrayLike | None = None) -> tuple[NDArray, Float, Float]:
        """(hemisphere, s, t) of directions (..., 3) in the map's frame; s and t are 0 … 1 across the whole map."""
        half, x, y = direction_to_paraboloid(directions, hemisphere)
        scale = 0.5 - self.border / self.size
        return half, 0.5 + scale * x, 0.5 + scale * y

    def bilinear(self, directions: ArrayLike, level: int = 0, hemisphere: ArrayLike | None = None) -> Float:
        """Radiance (..., C) at directions (..., 3) in one level of the map that r_z chooses, or of the one given."""
        half, s, t = self.texture_coordinates(directions, hemisphere)
        texels = self.levels[level]
        size = texels.shape[1]
        out = np.empty((*half.shape, texels.shape[-1]))
        for which in (FRONT, BACK):
            used = half == which
            out[used] = bilinear(texels[which], np.nan_to_num(s[used]) * size, np.nan_to_num(t[used]) * size)
        return out
