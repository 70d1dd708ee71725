"""Sums of a lat-long map over discs of the sphere, for many centres at once.

On a lat-long map every row meets a disc in one interval, so the sum is one difference of row prefix sums a row:
Δφ = acos((cos r − cos θ cos θ_j)/(sin θ sin θ_j)). The rows are few: a disc is summed on a level of a pyramid whose texels are a
given part of its radius, so that the cost of a centre does not grow with the map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from evalsuite.math.sphere import latlong_solid_angles

Float = NDArray[np.float64]
SMALLEST_ROWS = 16  # a level below this many rows would save nothing
_BATCH = 1 << 18  # numbers at once: they stay in the processor's cache


@dataclass(eq=False)
class Level:
    """A map's energy on a grid of rows × columns. energy: (H, W), ∫ L dω of each texel. Rows sit at θ = jπ/(H − 1), columns at
    φ = 2π(i + ½)/W."""

    energy: Float

    def __post_init__(self) -> None:
        self.height, self.width = self.energy.shape
        self.spacing = np.pi / max(self.height - 1, 1)
        self.theta = np.arange(self.height) * self.spacing
        # Prefix sums over three turns: an interval may begin before the map's left edge and end past its right one.
        self._prefix = np.zeros((self.height, 3 * self.width + 1))
        self.update(np.arange(self.height))

    def update(self, rows: NDArray[np.int64]) -> None:
        """Take over changed rows of `energy`."""
        self._prefix[rows, 1:] = np.cumsum(np.tile(self.energy[rows], 3), axis=1)

    def directions(self, index: NDArray[np.int64]) -> Float:
        """Unit directions (N, 3) of texels by their flat index, local frame of `math.sphere`."""
        row, column = np.divmod(index, self.width)
        phi, sine = 2.0 * np.pi * (column + 0.5) / self.width, np.sin(self.theta[row])
        return np.stack([sine * np.sin(phi), np.cos(self.theta[row]), -sine * np.cos(phi)], axis=-1)

    def disc_sums(self, index: NDArray[np.int64], radius: float, subrows: int = 1) -> Float:
        """Energy within a radius [rad] of the centres of texels, (N,), with the grid's own area error divided out. subrows:
        places across a row that its energy is spread over; near a pole whole rows else go in and out with the radius."""
        reach = int(np.ceil(radius / self.spacing)) + (subrows > 1)
        first = np.arange(self.height) - reach
        inside = np.clip(first[:, None] + np.arange(2 * reach + 1), 0, self.height - 1)
        base, weight = inside * (3 * self.width + 1) + self.width, latlong_solid_angles(self.height, 1)[inside, 0]
        prefix, row, column = self._prefix.ravel(), *np.divmod(index, self.width)
        total, area = np.zeros(len(index)), np.zeros(self.height)
        step = max(1, _BATCH // base.shape[1])
        for offset in (np.arange(subrows) + 0.5) / subrows - 0.5:
            half = self._half_widths(first, reach, radius, offset)
            area += (half * weight).sum(1) * 2.0 / self.width
            # Of a disc about column 0, in each row: where the interval's ends lie in the prefix sums, and how far into a texel.
            for sign, end in ((1.0, 0.5 + half), (-1.0, 0.5 - half)):
                whole = np.floor(end)
                place, part = base + whole.astype(np.int64), end - whole
                for start in range(0, len(index), step):
                    some = slice(start, start + step)
                    here = place[row[some]] + column[some, None]
                    low = prefix.take(here)
                    here += 1
                    within = np.einsum("nr,nr->n", part[row[some]], prefix.take(here, mode="clip") - low)
                    total[some] += sign * (low.sum(1) + within)
        exact = 4.0 * np.pi * np.sin(0.5 * radius) ** 2
        return total * np.divide(exact, area, out=np.zeros_like(area), where=area > 0)[row]

    def _half_widths(self, first: NDArray[np.int64], reach: int, radius: float, offset: float) -> Float:
        """Half widths [columns] of a disc's intervals in the rows around each row's centre, (H, 2 reach + 1)."""
        rows = first[:, None] + np.arange(2 * reach + 1)
        outside = (rows < 0) | (rows >= self.height)
        theta = np.clip((rows + offset) * self.spacing, 0.0, np.pi)
        centre = self.theta[:, None]
        above = np.cos(radius) - np.cos(centre) * np.cos(theta)
        below = np.sin(centre) * np.sin(theta)
        # At a pole every column is in the disc, or none is.
        cosine = np.divide(above, below, out=np.where(above <= 1e-12, -1.0, 1.0), where=below > 1e-9)
        return np.where(outside, 0.0, np.arccos(np.clip(cosine, -1.0, 1.0))) * self.width / (2.0 * np.pi)


class Pyramid:
    """A map's energy on ever coarser grids. Halving hands a texel's energy to the texels that it overlaps (columns), or lies
    between (rows): the sum and its place are kept."""

    def __init__(self, energy: Float) -> None:
        self.levels = [Level(np.array(energy, np.float64))]
        self._rows: list[sparse.csr_matrix] = []
        self._columns: list[sparse.csr_matrix] = []
        while min(self.levels[-1].height // 2 + 1, self.levels[-1].width // 4) >= SMALLEST_ROWS:
            level = self.levels[-1]
            self._rows.append(_between(level.height, level.height // 2 + 1))
            self._columns.append(_overlap(level.width, level.width // 2))
            self.levels.append(Level(self._columns[-1].dot(self._rows[-1].dot(level.energy).T).T.copy()))

    def level(self, spacing: float) -> int:
        """The coarsest level whose rows are no further apart than `spacing` [rad]; the finest where none is."""
        fine = [k for k, level in enumerate(self.levels) if level.spacing <= spacing]
        return max(fine, default=0)

    def remove(self, index: NDArray[np.int64]) -> None:
        """Set texels of the finest level, by flat index, to black on all levels."""
        finest = self.levels[0]
        change = np.zeros_like(finest.energy)
        change.flat[index] = -finest.energy.flat[index]
        rows = np.unique(index // finest.width)
        finest.energy.flat[index] = 0.0
        finest.update(rows)
        for k, (by_row, by_column) in enumerate(zip(self._rows, self._columns, strict=True)):
            coarse = by_row[:, rows]
            touched = np.flatnonzero(np.diff(coarse.indptr))
            part = by_column.dot(coarse[touched].dot(change[rows]).T).T
            change = np.zeros_like(self.levels[k + 1].energy)
            change[touched] = part
            self.levels[k + 1].energy[touched] = np.maximum(self.levels[k + 1].energy[touched] + part, 0.0)
            self.levels[k + 1].update(touched)
            rows = touched

    def nearest(self, index: NDArray[np.int64], fine: int, coarse: int) -> NDArray[np.int64]:
        """Flat indices of the texels of a coarse level that are nearest to texels of a finer one, (N,)."""
        if coarse == fine:
            return index
        source, to = self.levels[fine], self.levels[coarse]
        row, column = np.divmod(index, source.width)
        row = np.rint(row * (source.spacing / to.spacing)).astype(np.int64)
        return row * to.width + ((column + 0.5) * to.width / source.width).astype(np.int64)

    def centres(self, index: NDArray[np.int64], level: int) -> NDArray[np.int64]:
        """Flat indices, each once, of the texels of a level that are nearest to texels of the finest."""
        found = np.zeros(self.levels[level].energy.size, bool)
        found[self.nearest(index, 0, level)] = True
        return np.flatnonzero(found)


def _between(fine: int, coarse: int) -> sparse.csr_matrix:
    """(coarse, fine): each fine row's part in the two coarse rows around it."""
    place = np.arange(fine) * (coarse - 1) / max(fine - 1, 1)
    low = np.minimum(place.astype(np.int64), max(coarse - 2, 0))
    part = place - low
    column = np.arange(fine)
    return sparse.csr_matrix(
        (np.concatenate([1.0 - part, part]), (np.concatenate([low, low + 1]), np.tile(column, 2))), shape=(coarse, fine)
    )


def _overlap(fine: int, coarse: int) -> sparse.csr_matrix:
    """(coarse, fine): each fine column's part in the coarse columns that it overlaps."""
    edges = np.union1d(np.arange(fine + 1) / fine, np.arange(coarse + 1) / coarse)
    middle, length = 0.5 * (edges[:-1] + edges[1:]), np.diff(edges)
    keep = length > 1e-12
    middle, length = middle[keep], length[keep]
    return sparse.csr_matrix(
        (length * fine, ((middle * coarse).astype(np.int64), (middle * fine).astype(np.int64))), shape=(coarse, fine)
    )
