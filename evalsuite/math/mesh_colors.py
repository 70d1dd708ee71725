"""Values on the surface of triangles, on a regular lattice of each: mesh colors (Yuksel, Keyser, House 2010).

A triangle cut n times along each edge carries (n + 1)(n + 2)/2 samples, sample (i, j) at the barycentric coordinates
(1 − (i + j)/n, i/n, j/n), row j after row, i fastest; between them values are linear. No uv atlas, no seams to paint over.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]


def sample_count(divisions: ArrayLike) -> Int:
    """Samples of a triangle cut `divisions` times: (n + 1)(n + 2)/2."""
    n = np.asarray(divisions, np.int64)
    return (n + 1) * (n + 2) // 2


def first_sample(divisions: ArrayLike) -> Int:
    """Index of each triangle's sample (0, 0) when all triangles' samples stand in one list, (F,)."""
    return np.concatenate([[0], np.cumsum(sample_count(divisions))[:-1]]).astype(np.int64)


def index(divisions: ArrayLike, i: ArrayLike, j: ArrayLike) -> Int:
    """Position of sample (i, j) among its triangle's: row j begins after Σ_{r<j} (n + 1 − r) = **j(n + 1) − j(j − 1)/2**."""
    n, i, j = (np.asarray(x, np.int64) for x in (divisions, i, j))
    return j * (n + 1) - j * (j - 1) // 2 + i


def lattice(divisions: int) -> Float:
    """(u, v) = (i/n, j/n) of one triangle's samples in their order, (S, 2): weights of its second and third corner."""
    j, i = np.meshgrid(np.arange(divisions + 1), np.arange(divisions + 1), indexing="ij")
    inside = i + j <= divisions
    return np.stack([i[inside], j[inside]], axis=-1) / divisions


def lookup(values: ArrayLike, divisions: ArrayLike, triangles: ArrayLike, u: ArrayLike, v: ArrayLike) -> Float:
    """Linear interpolation, (N, C). values: (S, C) samples of all triangles; divisions: (F,); triangles: (N,) which one;
    u, v: (N,) weights of its second and third corner.

    With x = nu, y = nv and fractions f, g: below the cell's diagonal (f + g ≤ 1) the corners (i, j), (i + 1, j), (i, j + 1)
    weigh **1 − f − g, f, g**; above it (i + 1, j + 1), (i, j + 1), (i + 1, j) weigh **f + g − 1, 1 − f, 1 − g**.
    """
    values, divisions = np.asarray(values, np.float64), np.asarray(divisions, np.int64)
    n, first = divisions[triangles], first_sample(divisions)[triangles]
    x, y = np.clip(u, 0.0, 1.0) * n, np.clip(v, 0.0, 1.0) * n
    # On the far edges the last cell serves, so that all of its corners exist.
    i = np.minimum(np.floor(x).astype(np.int64), n - 1)
    j = np.minimum(np.floor(y).astype(np.int64), n - 1 - i)
    f, g = x - i, y - j
    below = (f + g <= 1.0) | (i + j >= n - 1)
    a = np.where(below, index(n, i, j), index(n, i + 1, j + 1))
    b = np.where(below, index(n, i + 1, j), index(n, i, j + 1))
    c = np.where(below, index(n, i, j + 1), index(n, i + 1, j))
    weights = np.where(below, [1.0 - f - g, f, g], [f + g - 1.0, 1.0 - f, 1.0 - g])[..., None]
    return weights[0] * values[first + a] + weights[1] * values[first + b] + weights[2] * values[first + c]
