"""A lobe's integral over an environment in any direction, as exactly as float64 and a spline allow: what a filter stands for.

The environment is convolved with the lobe on a grid of directions through spherical harmonics (`zonal`), which is exact there but
for the cut tail; between the nodes, four or more of them to the lobe's standard deviation, a quintic spline interpolates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from evalsuite.math import zonal
from evalsuite.math.radial_lobe import RadialLobe
from evalsuite.math.sphere import direction_to_latlong

Float = NDArray[np.float64]

_ORDER = 5
_PAD = 12  # nodes beyond the poles and the seam, so that the spline sees no edge: its weights fall by 0.43 a node
_NODES = 5.0  # to the lobe's standard deviation 1/√(N + 1)
#: Of what the spline returns, over the largest value of the field (measured on a lamp of one texel: N = 1, whose
#: horizon is a kink; from N = 2 on below 10⁻⁶).
TOLERANCE = 3e-5


_RADIAL_DEGREE = 128
#: Of a tabulated lobe's field, rms, against sums over the lobe in the office (α = 0.1 … 0.4).
RADIAL_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class LobeField:
    """coefficients: of the spline, (C, rows + 2 pad, columns + 2 pad). largest: of the field at its nodes, (C,). order: of the
    spline."""

    coefficients: Float
    rows: int
    largest: Float
    order: int = _ORDER

    def __call__(self, directions: ArrayLike) -> Float:
        """∫ K(r·l) L(l) dl at directions (P, 3) in the map's local frame, (P, C)."""
        u, v = direction_to_latlong(np.asarray(directions, np.float64))
        place = np.stack([v * (self.rows - 1), u * 2 * (self.rows - 1)]) + _PAD
        return np.stack([
            ndimage.map_coordinates(c, place, order=self.order, prefilter=False, mode="nearest") for c in self.coefficients
        ], axis=-1)  # fmt: skip

    def cubic(self) -> LobeField:
        """The same nodes under a cubic spline, three times as quick: within 2·10⁻³ of the largest value."""
        nodes = self.coefficients
        for axis in (1, 2):
            nodes = ndimage.correlate1d(nodes, np.array([1.0, 26.0, 66.0, 26.0, 1.0]) / 120.0, axis, mode="mirror")
        return LobeField(np.array([ndimage.spline_filter(c, 3, mode="mirror") for c in nodes]), self.rows, self.largest, 3)


def field(radiance: ArrayLike, bands: ArrayLike, rows: int) -> LobeField:
    """radiance: (H, W, C) lat-long, the bilinear interpolant; bands: λ_l of a kernel K (`zonal`); rows: of the grid."""
    grid = zonal.convolve_grid(radiance, bands, rows)
    half = rows - 1
    # Beyond a pole the field goes on half a turn round.
    over = np.roll(grid, half, axis=1)
    above, below = over[_PAD:0:-1], over[-2 : -_PAD - 2 : -1]
    padded = np.concatenate([above, grid, below])
    padded = np.concatenate([padded[:, -_PAD:], padded, padded[:, :_PAD]], axis=1)
    filtered = [ndimage.spline_filter(padded[..., c], order=_ORDER, mode="mirror") for c in range(padded.shape[-1])]
    return LobeField(np.array(filtered), rows, np.abs(grid).max(axis=(0, 1)))


def radial(radiance: ArrayLike, lobes: Sequence[RadialLobe]) -> tuple[LobeField, ...]:
    """∫ p L dl / ∫ p dl of lobes tabulated over the distance from their axes. Spectra are cut where
    all have fallen to 10⁻⁴, or at degree 128."""
    bands = np.stack([zonal.round_bands(lambda a, p=p: p(2.0 * np.sin(0.5 * a)), _RADIAL_DEGREE) for p in lobes], axis=-1)
    bands = bands / bands[0]
    degree = max(16, int(np.nonzero((np.abs(bands) > 1e-4).any(axis=-1))[0].max()))
    whole = field(radiance, bands[: degree + 1], max(129, int(2.5 * degree)))
    channels = np.asarray(radiance).shape[-1]
    return tuple(
        LobeField(whole.coefficients[k : k + channels], whole.rows, whole.largest[k : k + channels])
        for k in range(0, channels * len(lobes), channels)
    )


def phong(radiance: ArrayLike, exponent: float) -> LobeField:
    """∫ (N + 1)/2π (r·l)₊^N L(l) dl; N = 1 is E/π about a normal."""
    # The clamped cosine's kink at the horizon falls off as l⁻²·⁵ only; other small exponents likewise.
    kink = exponent < 4.0
    degree = max(zonal.phong_degree(exponent), 320 if kink else 0)
    rows = int(np.clip(np.ceil(np.pi * np.sqrt(exponent + 1.0) * _NODES), 257 if kink else 129, 1281))
    return field(radiance, zonal.phong_bands(exponent, degree), rows)
