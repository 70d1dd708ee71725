"""Sums over the sphere with a smooth lobe, made short: the map is gathered on a grid that is coarse beside the lobe.

A lobe is smooth, hence interpolates well between few nodes: K(r·l) ≈ Σ_c w_c(l) K(r·l_c) with six-point Lagrange weights along
θ and φ. Put into ∫ L K dω, the weights go to the map: **∫ L K dω ≈ Σ_c Φ_c K(r·l_c) with Φ_c = ∫ L w_c dω**, which keeps a
lamp where it is, as averaging into texels does not. The sums, made at the same nodes, are interpolated the same way.

Nodes lie at θ = (j + ½)π/R, φ = (i + ½)2π/2R in the map's local frame: texel centres, no pole. Beyond a pole the grid goes on
half a turn round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]

TAPS = 6
LOWEST_EXPONENT, HIGHEST_EXPONENT = 1.0, 1e4
#: Node spacing over the lobe's standard deviation 1/√(N + 1). Six points then interpolate a Gaussian to 0.073 · 0.33⁶ = 10⁻⁴.
_SPACING = 0.33
_FEWEST_ROWS, _ROWS_WITH_KINK, _MOST_ROWS = 64, 96, 640
_GAUSS = 4


def grid_rows(exponent: float) -> int:
    """Rows R of the grid for a cosine-power lobe. Up to N = 3 its edge at the horizon is no smoother than a kink, which takes
    more; up to N = 10⁴, beyond which spacing is over half the standard deviation, no more than 640."""
    fewest = _ROWS_WITH_KINK if exponent < 4 else _FEWEST_ROWS
    return int(np.clip(np.ceil(np.pi * np.sqrt(exponent + 1.0) / _SPACING), fewest, _MOST_ROWS))


def lagrange(x: ArrayLike) -> tuple[NDArray[np.int64], Float]:
    """First node (...) and weights (..., 6) of the six nodes around positions x (...) on a line with nodes at the integers:
    w_k = Π_{j≠k} (x − x_j)/(x_k − x_j). They sum to 1."""
    x = np.asarray(x, np.float64)
    low = np.floor(x).astype(np.int64)
    t = (x - low)[..., None]
    nodes = np.arange(TAPS) - (TAPS // 2 - 1)
    weights = np.ones((*x.shape, TAPS))
    for k in range(TAPS):
        for j in range(TAPS):
            if j != k:
                weights[..., k] *= (t[..., 0] - nodes[j]) / (nodes[k] - nodes[j])
    return low + nodes[0], weights


def gather(radiance: ArrayLike, rows: int) -> Float:
    """Φ, (R, 2R, C) [W m⁻²], of a lat-long map (H, W, C), the bilinear interpolant of `math.sphere.latlong_lookup`.

    Map and weights are products of functions of θ and of φ, and so is Φ: two matrix products.
    """
    radiance = np.asarray(radiance, np.float64)
    columns, (height, width) = 2 * rows, radiance.shape[:2]
    if height == 1:
        radiance, height = np.repeat(radiance, 2, axis=0), 2
    along_phi = np.zeros((columns, width))
    x, weight, cell, fraction = _gauss_nodes(width, columns)
    first, taps = lagrange(x * columns - 0.5 + 0.5 * columns / width)  # texel centres at i + ½, nodes too
    for k in range(TAPS):
        for column, share in ((cell, 1.0 - fraction), (cell + 1, fraction)):
            np.add.at(along_phi, ((first + k) % columns, column % width), taps[:, k] * share * weight * 2.0 * np.pi)
    # Rows 0 … R − 1 here, R … 2R − 1 those beyond a pole.
    along_theta = np.zeros((2 * rows, height))
    y, weight, cell, fraction = _gauss_nodes(height - 1, rows)
    first, taps = lagrange(y * rows - 0.5)
    for k in range(TAPS):
        node = (first + k) % (2 * rows)  # row −1 − j is row j on the other side, and so is row 2R − 1 − j
        node = np.where(node < rows, node, rows + (2 * rows - 1 - node))
        for row, share in ((cell, 1.0 - fraction), (cell + 1, fraction)):
            np.add.at(along_theta, (node, row), taps[:, k] * share * weight * np.pi * np.sin(np.pi * y))
    narrow = np.tensordot(along_phi, radiance, axes=(1, 1))  # (2R, H, C)
    both = np.tensordot(along_theta, narrow, axes=(1, 1))  # (2R, 2R, C)
    return both[:rows] + np.roll(both[rows:], rows, axis=1)


def _gauss_nodes(cells: int, nodes: int) -> tuple[Float, Float, NDArray[np.int64], Float]:
    """Gauss points over [0, 1] in `cells` cells: position, weight, cell and fraction of it; more where the grid is finer."""
    per_cell = int(_GAUSS * max(1.0, np.ceil(nodes / cells)))
    point, weight = np.polynomial.legendre.leggauss(min(per_cell, 64))
    fraction = np.tile(0.5 * (point + 1.0), cells)
    cell = np.repeat(np.arange(cells), len(point))
    return (cell + fraction) / cells, np.tile(0.5 * weight / cells, cells), cell, fraction


def reach(exponent: float, cut: float = 1e-5) -> float:
    """1 − cos of the angle at which cos^N falls to `cut`, and that share of its energy is left; at most 1, the
    horizon."""
    return float(min(1.0, -np.expm1(np.log(cut) / exponent)))
