"""Where one technique overtakes another along a swept axis, with the interval that both techniques' intervals leave."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.compare.envelopes import Contender, Plane, logarithmic, pairs

Float = NDArray[np.float64]


def crossings(x: ArrayLike, a: tuple[Float, Float, Float], b: tuple[Float, Float, Float], log: bool = True) -> list[dict]:
    """Where the curves a and b over x cross. a, b: (value, low, high) at each x, low and high the 95 % interval.

    With u = ln x (x itself unless log) and **d = ln a − ln b**, straight between neighbours, a crossing is a root of d. Its
    interval holds all u about the root where 0 lies between ln a_low − ln b_high and ln a_high − ln b_low: as the two share a
    reference, whose noise moves both alike, it is wide rather than narrow. How a and b run between grid points it does not know.
    Each: value, ci95 (an end is None where it lies beyond the sweep), between (grid neighbours), first_below (a is the better
    one below the crossing), decided (both ends lie within the sweep)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        d, low, high = (np.log(p) - np.log(q) for p, q in zip(a, (b[0], b[2], b[1]), strict=True))
    low, high = np.nan_to_num(low, nan=-np.inf, neginf=-np.inf), np.nan_to_num(high, nan=np.inf, posinf=np.inf)
    x = np.asarray(x, np.float64)
    keep = np.isfinite(d)
    x, d, low, high = x[keep], d[keep], low[keep], high[keep]
    u, back = (np.log(x), np.exp) if log else (x, float)
    found = []
    signed = np.flatnonzero(d)
    for i, j in pairwise(signed):
        if d[i] * d[j] > 0:
            continue
        # Grid points between the two, if any, are exact ties: the middle of them.
        root = u[i] + (u[j] - u[i]) * d[i] / (d[i] - d[j]) if j == i + 1 else (u[i + 1] + u[j - 1]) / 2
        sign = np.sign(d[i])
        beyond = (low, -high) if sign > 0 else (-high, low)  # > 0 where a and b are told apart: left of the root, right of it
        left, right = _edge(u, beyond[0], range(i, -1, -1), 1), _edge(u, beyond[1], range(j, len(u)), -1)
        ends = [None if end is None else float(back(end)) for end in (left, right)]
        found.append({
            "value": float(back(root)),
            "ci95": ends,
            "between": [float(x[i]), float(x[j])],
            "first_below": bool(sign < 0),
            "decided": None not in ends,
        })  # fmt: skip
    return found


def _edge(u: Float, beyond: Float, nodes: range, inwards: int) -> float | None:
    """Going outwards over the nodes, the first u where the two are told apart."""
    for k in nodes:
        if beyond[k] > 0:
            fall = beyond[k] - beyond[k + inwards]
            # An interval that reaches to 0 has no logarithm there: then only the node itself tells them apart.
            part = beyond[k] / fall if np.isfinite(fall) else 0.0
            return float(u[k] + (u[k + inwards] - u[k]) * part)
    return None


def crossovers(plane: Plane) -> list[dict]:
    """All crossings of all pairs that meet, along x at each y and along y at each x. Each, beside `crossings`: scene, target,
    environment, axis, at (everything held fixed), better_below, better_above (labels), same_truth."""
    found = []
    for values, a, b in pairs(plane):
        for axis, at, points, index in _lines(plane):
            curves = [tuple(grid[index] for grid in (c.drawn, c.low, c.high)) for c in (a, b)]
            for one in crossings(points, *curves, log=logarithmic(points)):
                first, second = (a, b) if one.pop("first_below") else (b, a)
                found.append({
                    "scene": plane.scene, "target": plane.target, "environment": plane.environment, "axis": axis,
                    "at": {**at, **values}, "better_below": first.label, "better_above": second.label,
                    **one, "same_truth": same_truth(a, b),
                })  # fmt: skip
    return found


def same_truth(a: Contender, b: Contender) -> bool:
    """Whether the two are held against the very same references wherever both have a score."""
    both = [(p, q) for p, q in zip(a.truth, b.truth, strict=True) if p is not None and q is not None]
    return bool(both) and all(p == q for p, q in both)


def _lines(plane: Plane) -> Iterator[tuple[str, dict[str, float], Float, tuple]]:
    for j, y in enumerate(plane.ys):
        yield plane.x, {plane.y: float(y)}, plane.xs, (j, slice(None))
    for i, x in enumerate(plane.xs):
        yield plane.y, {plane.x: float(x)}, plane.ys, (slice(None), i)
