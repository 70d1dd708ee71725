"""Who is best where on a swept plane, and where one overtakes another: what the page and the figures draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import crossover
from evalsuite.compare.envelopes import Contender, Plane, logarithmic

Float = NDArray[np.float64]

#: Points an axis, between the measured ones.
FINE = 160


def fine(values: Float) -> Float:
    """FINE points from the first measured one to the last, in the axis' own scale."""
    inner = np.geomspace if logarithmic(values) else np.linspace
    return inner(values[0], values[-1], FINE)


def interpolate(plane: Plane, grid: Float) -> Float:
    """(Y, X) on the measured points → (FINE, FINE), bilinear in the axes' own scales; NaN beside points without a score."""

    def across(points: Float, rows: Float) -> Float:
        at, u = (np.log(v) if logarithmic(points) else v for v in (fine(points), points))
        return np.stack([np.interp(at, u, row) for row in rows])

    return across(plane.ys, across(plane.xs, grid).T).T


@dataclass(frozen=True)
class Crossing:
    """At plane's y, a and b are equal at x = value; low, high: its 95 % interval, open ends at the sweep's."""

    y: float
    value: float
    low: float
    high: float
    decided: bool
    a: Contender
    b: Contender


@dataclass(frozen=True)
class Territory:
    """One slice of a plane: members, of which there are at least two, over FINE × FINE points."""

    plane: Plane
    members: Sequence[Contender]

    @cached_property
    def _logs(self) -> tuple[Float, Float, Float]:
        with np.errstate(divide="ignore"):
            value, low, high = (
                np.stack([interpolate(self.plane, np.log(np.maximum(getattr(c, name), 1e-9))) for c in self.members])
                for name in ("drawn", "low", "high")
            )
        known = np.isfinite(value)
        return np.where(known, value, np.inf), np.where(known, low, np.inf), high

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """(members, FINE, FINE): where each has a score."""
        return np.isfinite(self._logs[0])

    @property
    def value(self) -> Float:
        """(members, FINE, FINE) log of relative RMSE; Inf where unknown."""
        return self._logs[0]

    @cached_property
    def best(self) -> NDArray[np.intp]:
        """(FINE, FINE) number of the member with the smallest error; −1 where none has a score."""
        return np.where(self.known.any(axis=0), np.argmin(self.value, axis=0), -1)

    @cached_property
    def undecided(self) -> NDArray[np.bool_]:
        """(FINE, FINE): the best one's 95 % interval overlaps another's."""
        _, low, high = self._logs
        chosen = np.maximum(self.best, 0)[None]
        others = np.where(np.arange(len(self.members))[:, None, None] == chosen, np.inf, low).min(axis=0)
        return (np.take_along_axis(high, chosen, 0)[0] >= others) & (self.best >= 0)

    def neighbours(self) -> set[tuple[int, int]]:
        """Pairs of members whose territories touch."""
        best = self.best
        sides = ((best[:, 1:], best[:, :-1]), (best[1:], best[:-1]))
        pairs = {tuple(sorted((int(a), int(b)))) for p, q in sides for a, b in zip(p[p != q], q[p != q], strict=True)}
        return {pair for pair in pairs if pair[0] >= 0}

    def crossings(self) -> list[Crossing]:
        """Where two neighbours are equal along x, at each measured y, as far as they are the best two there."""
        plane, found = self.plane, []
        xs, ys = fine(plane.xs), fine(plane.ys)
        for pair in sorted(self.neighbours()):
            a, b = (self.members[k] for k in pair)
            for j, y in enumerate(plane.ys):
                rows = (tuple(grid[j] for grid in (c.drawn, c.low, c.high)) for c in (a, b))
                for one in crossover.crossings(plane.xs, *rows, log=logarithmic(plane.xs)):
                    i = int(np.abs(np.log(xs / one["value"]) if logarithmic(plane.xs) else xs - one["value"]).argmin())
                    row = set(self.best[int(np.abs(ys - y).argmin()), max(i - 2, 0) : i + 3])
                    if row & set(pair) and row <= set(pair):
                        ends = zip(one["ci95"], (plane.xs[0], plane.xs[-1]), strict=True)
                        low, high = (float(edge if end is None else end) for end, edge in ends)
                        found.append(Crossing(float(y), float(one["value"]), low, high, bool(one["decided"]), a, b))
        return found


def of(plane: Plane) -> list[tuple[dict, Territory]]:
    """The slices of a plane that have rivals: (values of the other axes, territory)."""
    slices = ((dict(values), plane.at(values)) for values in plane.slices)
    return [(values, Territory(plane, members)) for values, members in slices if len(members) > 1]
