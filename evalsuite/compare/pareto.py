"""Accuracy against cost: which contenders no other beats in both."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from evalsuite.compare.envelopes import Plane
from evalsuite.compare.statistics import Metric

Float = NDArray[np.float64]

#: What a technique costs: one frame, and once an environment [ms].
COSTS = ("gpu_ms", "prepare_ms")


def over_plane(value: Float, low: Float, high: Float) -> Metric:
    """Root mean square of errors with 95 % intervals, whose noise is independent: the squares' half widths add in quadrature."""
    square = np.square(value)
    mean, down, up = square.mean(), np.hypot.reduce(square - low**2), np.hypot.reduce(high**2 - square)
    ends = (math.sqrt(max(mean - down / value.size, 0.0)), math.sqrt(mean + up / value.size))
    return Metric(math.sqrt(mean), ends)


def mean_cost(values: Float) -> Metric:
    """Mean of the timings over a plane's cells and Student's 95 % interval of it; unbounded for a single one."""
    mean, count = float(values.mean()), len(values)
    half = float(stdtrit(count - 1, 0.975)) * float(values.std(ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return Metric(mean, (max(mean - half, 0.0), mean + half))


def front(points: list[tuple[Metric, Metric]]) -> list[tuple[bool, bool]]:
    """Of (error, cost) points: (on the front, decided). On it is what no other beats in one without losing in the other.
    Decided: on it still if every other's interval were used against it, or off it even if all were used for it."""
    found = []
    for k, (error, cost) in enumerate(points):
        rivals = [p for i, p in enumerate(points) if i != k]
        beaten = any(
            e.value <= error.value and c.value <= cost.value and (e.value, c.value) != (error.value, cost.value)
            for e, c in rivals
        )
        if beaten:
            decided = any(e.ci95[1] < error.ci95[0] and c.ci95[1] < cost.ci95[0] for e, c in rivals)
        else:
            decided = not any(e.ci95[0] <= error.ci95[1] and c.ci95[0] <= cost.ci95[1] for e, c in rivals)
        found.append((not beaten, decided))
    return found


def pareto(plane: Plane) -> list[dict]:
    """The contenders of a plane by root mean square rel_rmse over the cells that all of them have, against each cost. One entry a
    cost: cost, cells (how many), points: contender, technique, at, rel_rmse and cost with their intervals, on_front, decided."""
    common = np.logical_and.reduce([np.isfinite(c.value) for c in plane.contenders])
    entries = []
    for name in COSTS:
        use = np.logical_and.reduce([common, *(np.isfinite(getattr(c, name)) for c in plane.contenders)])
        if not use.any():
            continue
        points = [(over_plane(c.value[use], c.low[use], c.high[use]), mean_cost(getattr(c, name)[use])) for c in plane.contenders]
        entries.append({
            "scene": plane.scene, "target": plane.target, "environment": plane.environment, "over": [plane.x, plane.y],
            "cells": int(use.sum()), "cost": name,
            "points": [
                {"contender": c.label, "technique": c.technique, "at": dict(c.at), "rel_rmse": error.to_json(),
                 name: cost.to_json(), "on_front": on, "decided": decided}
                for c, (error, cost), (on, decided) in zip(plane.contenders, points, front(points), strict=True)
            ],
        })  # fmt: skip
    return entries
