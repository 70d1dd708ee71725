"""How each cell's `rel_rmse` went over the checks, and at which of them its level changed: `trends.json`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from evalsuite.compare.changepoints import levels
from evalsuite.compare.unified import Z95
from evalsuite.gate.history import Cell, Check
from evalsuite.gate.tolerance import DRIFT

SCHEMA = "evalsuite.trends/1"
#: Probability that the trends of a report in which nothing changed have a change anywhere.
ALARM = 0.01
#: Checks that a trend looks back on.
LAST = 500


def trends(report: str, checks: Sequence[Check]) -> dict:
    """Everything in trends.json (docs/gate.md). Each cell and renderer is a series of its own, as another driver's pictures are
    others; those with the latest change come first, then those checked last."""
    found: dict[tuple[str, str | None], list[tuple[Check, Cell]]] = {}
    for check in checks:
        for name, cell in check.cells.items():
            if cell.rel_rmse is not None:
                found.setdefault((name, check.gl_renderer), []).append((check, cell))
    series = [_series(*key, points, ALARM / len(found)) for key, points in found.items()]
    series.sort(key=_order)
    facts = [{name: getattr(c, name) for name in ("number", "created", "commit", "gl_renderer", "passed")} for c in checks]
    return {"schema": SCHEMA, "report": report, "last": LAST, "alarm": ALARM, "checks": facts, "series": series}


def _series(name: str, renderer: str | None, points: Sequence[tuple[Check, Cell]], alarm: float) -> dict:
    # What noise leaves open at an end has no weight.
    known = [(check, cell) for check, cell in points if cell.low is not None and cell.high is not None]
    cells = [cell for _, cell in known]
    found = levels([c.rel_rmse for c in cells], [_error(c) for c in cells], [c.seed for c in cells], alarm)
    pieces = [(known[level.first][0], known[level.last][0], level) for level in found]
    changes = []
    for (_, last, before), (first, _, after) in pairwise(pieces):
        changes.append(
            {
                "check": first.number,
                "after": last.number,
                "commit": first.commit,
                "after_commit": last.commit,
                "verdict": first.cells[name].verdict,
                "from": _with_interval(before.value, before.error),
                "to": _with_interval(after.value, after.error),
                "difference": _with_interval(after.value - before.value, math.hypot(before.error, after.error)),
            }
        )
    return {
        "cell": name,
        "gl_renderer": renderer,
        "changes": changes,
        "levels": [{"first": a.number, "last": b.number, **_with_interval(level.value, level.error)} for a, b, level in pieces],
        "points": [
            {
                "check": check.number,
                "value": cell.rel_rmse,
                "ci95": [cell.low, cell.high],
                "verdict": cell.verdict,
                "seed": cell.seed,
            }
            for check, cell in points
        ],
    }


def _order(series: dict) -> tuple[int, int, str]:
    changed = max((change["check"] for change in series["changes"]), default=-1)
    return -changed, -series["points"][-1]["check"], series["cell"]


def _error(cell: Cell) -> float:
    """Standard error: the longer side of the interval, which is not symmetric near 0; and what drift may do without noise."""
    return math.hypot(max(cell.high - cell.rel_rmse, cell.rel_rmse - cell.low) / Z95, DRIFT)


def _with_interval(value: float, error: float) -> dict:
    return {"value": value, "ci95": [value - Z95 * error, value + Z95 * error]}
