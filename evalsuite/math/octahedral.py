"""Octahedral maps of the sphere: one square without seams once it has a border of one texel. In float64.

(a, b) in [−1, 1]² is a unit direction's projection onto |x| + |y| + |z| = 1, its lower half folded outwards (Meyer et al.
2010). A map of width w is stored (w + 2, w + 2, C), indexed [row, column] with a along columns: texel i lies at
a = (2i − 1)/w − 1, so that texels 0 and w + 1 are the border. Beyond an edge the map goes on mirrored along
it: a → 2 − a, b → −b.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


def _sign(x: Float) -> Float:
    return np.where(x < 0, -1.0, 1.0)


def from_direction(directions: ArrayLike) -> tuple[Float, Float]:
    """(a, b) of directions (..., 3) of any length but zero."""
    d = np.asarray(directions, np.float64)
    x, y, z = np.moveaxis(d / np.abs(d).sum(-1, keepdims=True), -1, 0)
    return np.where(z < 0, (1 - np.abs(y)) * _sign(x), x), np.where(z < 0, (1 - np.abs(x)) * _sign(y), y)


def to_direction(a: ArrayLike, b: ArrayLike) -> Float:
    """Unit direction (..., 3) at (a, b); inverse of `from_direction`, also a border's width outside the square."""
    a, b = np.broadcast_arrays(np.asarray(a, np.float64), np.asarray(b, np.float64))
    a, b = np.where(np.abs(a) > 1, 2 * _sign(a) - a, a), np.where(np.abs(a) > 1, -b, b)
    a, b = np.where(np.abs(b) > 1, -a, a), np.where(np.abs(b) > 1, 2 * _sign(b) - b, b)
    z = 1 - np.abs(a) - np.abs(b)
    fold = np.maximum(-z, 0)
    d = np.stack([a - _sign(a) * fold, b - _sign(b) * fold, z], -1)
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def texel_directions(width: int) -> Float:
    """Unit direction of each texel with the border, (w + 2, w + 2, 3)."""
    centre = (2.0 * np.arange(width + 2) - 1.0) / width - 1.0
    return to_direction(centre[None, :], centre[:, None])


def bilinear(texels: ArrayLike, directions: ArrayLike) -> Float:
    """(..., C) at directions (..., 3) from a map with its border, (w + 2, w + 2, C)."""
    texels = np.asarray(texels, np.float64)
    width = texels.shape[0] - 2
    x, y = (0.5 * (c + 1.0) * width + 0.5 for c in from_direction(directions))
    i, j = (np.clip(np.floor(c).astype(int), 0, width) for c in (x, y))
    p, q = (x - i)[..., None], (y - j)[..., None]
    upper = (1 - p) * texels[j, i] + p * texels[j, i + 1]
    lower = (1 - p) * texels[j + 1, i] + p * texels[j + 1, i + 1]
    return (1 - q) * upper + q * lower
