"""Which value of a free parameter to draw next: a search that knows nothing but the values drawn and their errors.

Whole numbers: each in turn. Others: five values a step apart about the published one, further outwards while the best lies at
the end, then the gaps beside the best halved to a sixteenth of a step, then the vertex of the parabola through the last three.
It finds the valley that holds the best of the first values: an error with several valleys may have a deeper one elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

#: Halvings of a step.
HALVINGS = 4
#: A gap this much wider is no wider.
SLACK = 1 + 1e-9


@dataclass(frozen=True)
class Range:
    """Where to search. low, high: bounds. step: between the first values. published: tried first. whole: integers alone."""

    low: float
    high: float
    step: float
    published: float
    whole: bool = False

    @property
    def finest(self) -> float:
        """Gap at which halving ends."""
        return self.step / 2**HALVINGS


def next_value(where: Range, drawn: Mapping[float, float]) -> float | None:
    """The value to try next, None when done. drawn: value → error (debiased mean square) of those tried."""
    if where.published not in drawn:
        return where.published
    return _next_whole(where, drawn) if where.whole else _next_real(where, drawn)


def best_drawn(where: Range, drawn: Mapping[float, float]) -> float:
    """The value of least error; of several, the one nearest to what is published."""
    return min(drawn, key=lambda x: (drawn[x], abs(x - where.published), x))


def bracket(where: Range, drawn: Mapping[float, float]) -> tuple[float, float, float] | None:
    """The best drawn value between its neighbours, of those on the grid of `finest`; None where it lies at an end."""
    grid = sorted(x for x in drawn if _on_grid(where, x))
    middle = grid.index(best_drawn(where, {x: drawn[x] for x in grid}))
    return tuple(grid[middle - 1 : middle + 2]) if 0 < middle < len(grid) - 1 else None


def vertex(three: tuple[float, float, float], errors: tuple[float, float, float]) -> tuple[float, float]:
    """Where the parabola through three points has its vertex, and its second derivative (≤ 0: there is no minimum)."""
    (a, b, c), (fa, fb, fc) = three, errors
    left, right = (fb - fa) / (b - a), (fc - fb) / (c - b)
    second = 2.0 * (right - left) / (c - a)
    return (0.5 * (a + b) - left / second if second > 0 else b), second


def _next_whole(where: Range, drawn: Mapping[float, float]) -> float | None:
    """Each number from the lowest on; a cap that makes no difference any more ends it, as all above make none either."""
    for value in range(int(where.low), int(where.high) + 1):
        if float(value) not in drawn:
            return float(value)
        if value < where.published and drawn[value] == drawn[where.published]:
            return None
    return None


def _next_real(where: Range, drawn: Mapping[float, float]) -> float | None:
    for k in (-1, 1, -2, 2):
        value = where.published + k * where.step
        if where.low <= value <= where.high and value not in drawn:
            return value
    best, ends = best_drawn(where, drawn), (min(drawn), max(drawn))
    for end, outwards, bound in ((ends[0], -where.step, where.low), (ends[1], where.step, where.high)):
        if best == end != bound:
            return max(end + outwards, bound) if outwards < 0 else min(end + outwards, bound)
    grid = sorted(x for x in drawn if _on_grid(where, x))
    if len(grid) < len(drawn):
        return None  # the vertex has been drawn
    at = grid.index(best)
    gaps = [(y - x, x) for x, y in ((grid[k], grid[k + 1]) for k in (at - 1, at) if 0 <= k < len(grid) - 1)]
    width, start = max(gaps, key=lambda gap: (gap[0], -gap[1]), default=(0.0, 0.0))
    if width > where.finest * SLACK:
        return start + 0.5 * width
    three = bracket(where, drawn)
    if three is None:
        return None
    x, second = vertex(three, tuple(drawn[v] for v in three))
    return x if second > 0 and three[0] < x < three[2] and not _on_grid(where, x) else None


def _on_grid(where: Range, x: float) -> bool:
    """Whether a value is a bound, or whole parts of `finest` from the published one (to a sixteenth of them)."""
    parts = (x - where.published) / where.finest
    return x in (where.low, where.high) or abs(parts - round(parts)) < 1 / 16
