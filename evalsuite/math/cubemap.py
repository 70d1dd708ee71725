"""Cubemaps in OpenGL's face order and orientation: the one place where directions become (face, s, t), in float64.

Faces are +x, −x, +y, −y, +z, −z; level 0 of a map is (6, w, w, C), indexed [face, row, column] with s = (column + ½)/w and
t = (row + ½)/w. World directions are used as they are. The shaders rely on the hardware for the same mapping.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.math.sphere import latlong_lookup, latlong_spacing

Float = NDArray[np.float64]

# OpenGL 4.5 core, table 8.19: a direction on a face is AXIS + a S + b T with a = 2s − 1, b = 2t − 1 in [−1, 1].
AXIS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
S = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], dtype=np.float64)
T = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]], dtype=np.float64)


def direction_to_face(directions: ArrayLike) -> tuple[NDArray[np.int64], Float, Float]:
    """directions: (..., 3) world, any length but zero. Returns face index and s, t in [0, 1], each (...)."""
    d = np.asarray(directions, dtype=np.float64)
    magnitude = np.abs(d)
    axis = np.argmax(magnitude, axis=-1)  # ties go to x, then y
    major = np.take_along_axis(magnitude, axis[..., None], -1)[..., 0]
    face = 2 * axis + (np.take_along_axis(d, axis[..., None], -1)[..., 0] < 0)
    s = 0.5 * ((d * S[face]).sum(-1) / major + 1.0)
    t = 0.5 * ((d * T[face]).sum(-1) / major + 1.0)
    return face, s, t


def face_to_direction(face: ArrayLike, s: ArrayLike, t: ArrayLike) -> Float:
    """Unit world direction (..., 3) at (face, s, t); inverse of `direction_to_face`."""
    face = np.asarray(face)
    a, b = 2.0 * np.asarray(s, np.float64)[..., None] - 1.0, 2.0 * np.asarray(t, np.float64)[..., None] - 1.0
    d = AXIS[face] + a * S[face] + b * T[face]
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def texel_directions(width: int) -> Float:
    """Unit world direction of each texel centre, (6, w, w, 3)."""
    centre = (np.arange(width) + 0.5) / width
    t, s = np.meshgrid(centre, centre, indexing="ij")
    face = np.broadcast_to(np.arange(6)[:, None, None], (6, width, width))
    return face_to_direction(face, np.broadcast_to(s, face.shape), np.broadcast_to(t, face.shape))


def texel_solid_angles(width: int) -> Float:
    """Exact solid angle of each texel of one face, (w, w) [sr]; the six faces together sum to 4π.

    The solid angle of the rectangle [0, a] × [0, b] on the plane z = 1 is Ω(a, b) = atan(ab / √(a² + b² + 1)); a texel is
    the second difference of Ω over its corners.
    """
    edge = 2.0 * np.arange(width + 1) / width - 1.0
    a, b = edge[None, :], edge[:, None]
    corner = np.arctan2(a * b, np.sqrt(a * a + b * b + 1.0))
    return corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1]


def default_face_size(latlong_width: int) -> int:
    """Smallest power of two w with 4w ≥ the lat-long width (the equator keeps its texels), held within 16 … 1024."""
    return int(np.clip(1 << max(0, int(np.ceil(np.log2(latlong_width / 4.0)))), 16, 1024))


def check_face_size(width: int) -> int:
    """Return width as int, or raise EvalsuiteError: 2 × 2 boxes need a power of two."""
    if isinstance(width, bool) or int(width) != width or not 1 <= width <= 8192 or int(width) & (int(width) - 1):
        raise EvalsuiteError("face_size", repr(width), "a power of two from 1 to 8192", "choose one, e.g. 256")
    return int(width)


def subsamples_per_texel(width: int, latlong_shape: tuple[int, int]) -> int:
    """Sub-samples k per side of a cube texel so that their spacing is at most 0.4 of a lat-long texel.

    At a face's centre, where texels are largest, a texel spans 2/w [rad]; a lat-long texel spans 2π/W and π/(H−1). The
    bilinear hat of a single bright texel is then summed to better than 1 %.
    """
    spacing = latlong_spacing(*latlong_shape)
    return 1 if np.isinf(spacing) else int(np.clip(np.ceil((2.0 / width) / (0.4 * spacing)), 2, 64))


def resample_latlong(radiance: ArrayLike, to_world: ArrayLike, width: int, subsamples: int | None = None) -> Float:
    """Lat-long environment → cubemap level 0, (6, w, w, C) float64; see `resample`.

    radiance: (H, W, C) [W m⁻² sr⁻¹] in `math.sphere`'s layout; to_world: (3, 3) local → world.
    """
    radiance, to_local = np.asarray(radiance), np.asarray(to_world, np.float64)
    k = subsamples_per_texel(width, radiance.shape[:2]) if subsamples is None else subsamples
    return resample(lambda d: latlong_lookup(radiance, d @ to_local), width, k)


def resample(lookup: Callable[[Float], Float], width: int, subsamples: int) -> Float:
    """Level 0 of a cubemap, (6, w, w, C) float64, each texel its mean radiance over solid angle.

    lookup: radiance (..., C) at world directions (..., 3). Mean over k × k sub-samples at the centres of a regular grid,
    weighted by their differential solid angle (1 + a² + b²)^(−3/2).
    """
    k, total, weight = subsamples, 0.0, np.zeros((width, width))
    for j in range(k):
        for i in range(k):
            s = (np.arange(width) + (i + 0.5) / k) / width
            t = (np.arange(width) + (j + 0.5) / k) / width
            a, b = (2 * s - 1)[None, :], (2 * t - 1)[:, None]
            omega = (1.0 + a * a + b * b) ** -1.5
            weight += omega
            d = (AXIS[face] + a[..., None] * S[face] + b[..., None] * T[face] for face in range(6))
            total = total + np.stack([omega[..., None] * lookup(directions) for directions in d])
    return total / weight[..., None]


def box_mips(level0: ArrayLike) -> list[Float]:
    """The chain that hardware makes: 2 × 2 mean on each face by itself, down to 1 × 1. level0: (6, w, w, C), w = 2^n."""
    levels = [np.asarray(level0, dtype=np.float64)]
    while levels[-1].shape[1] > 1:
        finer = levels[-1]
        levels.append(0.25 * (finer[:, ::2, ::2] + finer[:, 1::2, ::2] + finer[:, ::2, 1::2] + finer[:, 1::2, 1::2]))
    return levels


def integral(level0: ArrayLike) -> Float:
    """∫ L dω over the sphere, (C,) [W m⁻²], each texel times its exact solid angle."""
    level0 = np.asarray(level0, dtype=np.float64)
    return np.einsum("fyxc,yx->c", level0, texel_solid_angles(level0.shape[1]))


def _with_border(level: Float) -> Float:
    """Level with one texel around each face taken from its neighbours, (6, w+2, w+2, C): seamless filtering's footprint.

    An edge texel is the neighbouring face's adjacent one; the missing fourth texel at a cube corner is the mean of the
    other three (OpenGL 4.5 core, 8.14.1).
    """
    width = level.shape[1]
    out = np.empty((6, width + 2, width + 2, level.shape[-1]))
    out[:, 1:-1, 1:-1] = level
    inside, outside = (2.0 * np.arange(width) + 1.0) / width - 1.0, 1.0 + 1.0 / width
    for face in range(6):
        for side in (-1, 1):
            edge = slice(0, 1) if side < 0 else slice(-1, None)
            for across, along, index in ((S, T, np.s_[1:-1, edge]), (T, S, np.s_[edge, 1:-1])):
                d = AXIS[face] + side * outside * across[face] + inside[:, None] * along[face]
                f, s, t = direction_to_face(d)
                # Just outside the edge at texel centres: the neighbour's first row, same place along the edge.
                row, column = (np.minimum((x * width).astype(int), width - 1) for x in (t, s))
                out[(face, *index)] = level[f, row, column].reshape(out[(face, *index)].shape)
        for y, yy in ((0, 1), (-1, -2)):
            for x, xx in ((0, 1), (-1, -2)):
                out[face, y, x] = (out[face, yy, xx] + out[face, y, xx] + out[face, yy, x]) / 3.0
    return out


class SeamlessCube:
    """Twin of `textureLod(samplerCube, …)` with seamless filtering: bilinear in a level, linear between levels."""

    def __init__(self, levels: Sequence[ArrayLike]) -> None:
        """levels: (6, w, w, C), (6, w/2, w/2, C) … (6, 1, 1, C) radiance."""
        self.levels = [np.asarray(level, dtype=np.float64) for level in levels]
        self._bordered = [_with_border(level) for level in self.levels]

    @property
    def width(self) -> int:
        """Texels along an edge of level 0."""
        return self.levels[0].shape[1]

    @property
    def max_level(self) -> int:
        """Index of the coarsest level."""
        return len(self.levels) - 1

    def bilinear(self, directions: ArrayLike, level: int) -> Float:
        """Radiance (..., C) at directions (..., 3) in one level."""
        width, texels = self.levels[level].shape[1], self._bordered[level]
        face, s, t = direction_to_face(directions)
        x, y = s * width - 0.5, t * width - 0.5
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        p, q = (x - i)[..., None], (y - j)[..., None]
        i, j = np.clip(i, -1, width - 1), np.clip(j, -1, width - 1)
        flat, stride = texels.reshape(-1, texels.shape[-1]), width + 2
        first = (face * stride + j + 1) * stride + i + 1

        def texel(right: int, below: int) -> Float:
            return np.take(flat, first + right + stride * below, axis=0)  # thrice as fast as texels[face, row, column]

        upper = (1 - p) * texel(0, 0) + p * texel(1, 0)
        lower = (1 - p) * texel(0, 1) + p * texel(1, 1)
        return (1 - q) * upper + q * lower

    def lookup(self, directions: ArrayLike, lod: ArrayLike) -> Float:
        """Trilinear radiance (..., C); lod: (...) or scalar, clamped to the levels that exist."""
        d = np.asarray(directions, dtype=np.float64)
        lod = np.broadcast_to(np.clip(np.asarray(lod, np.float64), 0, self.max_level), d.shape[:-1])
        out = np.zeros((*d.shape[:-1], self.levels[0].shape[-1]))
        for level in range(len(self.levels)):
            weight = np.maximum(0.0, 1.0 - np.abs(lod - level))
            used = weight > 0
            if used.any():
                out[used] += weight[used][..., None] * self.bilinear(d[used], level)
        return out


def reflection_lod(directions: ArrayLike, width: int) -> Float:
    """What hardware chooses before any bias for an (H, W, 3) picture of look-up directions r, (H−1, W−1):

    λ = log₂ max(|∂(s,t)w/∂x|, |∂(s,t)w/∂y|) on each pixel's own face, by the quotient rule from forward differences of r,
    ∂s/∂x = ½ (∂s_c/∂x · m − s_c · ∂m/∂x)/m² with m the major component (OpenGL 4.5 core, 8.14.1, which leaves the way open).
    """
    d = np.asarray(directions, dtype=np.float64)
    here = d[:-1, :-1]
    face = direction_to_face(here)[0]

    def components(v: Float) -> tuple[Float, Float, Float]:
        return tuple((v * table[face]).sum(-1) for table in (S, T, AXIS))

    s, t, m = components(here)
    steps = []
    for neighbour in (d[:-1, 1:], d[1:, :-1]):
        ds, dt, dm = components(neighbour - here)
        steps.append(np.hypot(ds * m - s * dm, dt * m - t * dm) * 0.5 * width / m**2)
    return np.log2(np.maximum(np.maximum(*steps), 1e-30))
