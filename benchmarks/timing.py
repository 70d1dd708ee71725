"""Times and ratios of times with their 95 % intervals.

A ratio is formed round by round, both sides one after the other in turns of order, so that what else the machine does falls on
both. Times are skewed to the right and their noise is in proportion to them: values are geometric means, and intervals
Student's t of the logarithms.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import t as student

Step = Callable[[], object]


def seconds(step: Step) -> float:
    """Wall time of one call [s]."""
    started = time.perf_counter()
    step()
    return time.perf_counter() - started


def rounds_of(ours: Step, theirs: Step, rounds: int, warm_up: bool = True) -> tuple[list[float], list[float]]:
    """Seconds of both, a pair a round, every other round in reverse order. warm_up: one call of each before, not counted."""
    if warm_up:
        ours(), theirs()
    times: tuple[list[float], list[float]] = ([], [])
    for number in range(rounds):
        for side in (0, 1) if number % 2 == 0 else (1, 0):
            times[side].append(seconds((ours, theirs)[side]))
    return times


def mean(values: Sequence[float]) -> tuple[float, tuple[float, float]]:
    """Geometric mean of positive values and its 95 % interval. At least two of them."""
    logs = np.log(np.asarray(values, float))
    middle, count = logs.mean(), len(logs)
    if count < 2:
        raise ValueError("a single round has no interval")
    half = student.ppf(0.975, count - 1) * logs.std(ddof=1) / np.sqrt(count)
    return float(np.exp(middle)), (float(np.exp(middle - half)), float(np.exp(middle + half)))


def ratio(ours: Sequence[float], theirs: Sequence[float]) -> tuple[float, tuple[float, float]]:
    """Geometric mean of ours/theirs, round by round, and its 95 % interval."""
    return mean(np.asarray(ours, float) / np.asarray(theirs, float))


def typical(values: Sequence[float]) -> str:
    """Median and range in words: `1.23 s (1.20 to 1.41)`."""
    return f"{np.median(values):.3g} s ({min(values):.3g} to {max(values):.3g})"
