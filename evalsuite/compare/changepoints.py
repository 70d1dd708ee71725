"""Where the level of a series changes, of measurements whose errors are known.

The model is a mean that is constant in pieces, and normal noise of known standard error about it. Its best pieces are those of
the least sum of squared, whitened residuals plus β a change (penalised likelihood), found exactly in O(n²): Jackson et al., An
Algorithm for Optimal Partitioning of Data on an Interval, IEEE Signal Processing Letters 12, 2005. A piece may be of one.

β follows from the rate of false alarms. In the best partition the levels of two neighbouring pieces are √β standard errors apart
or more, else they would be cheaper as one. Of n measurements there are C(n + 1, 3) pairs of neighbouring pieces, so with
P(χ²₁ > β) = α / C(n + 1, 3) a series without change has a false one with a probability of at most α.

Noise that several measurements share (the same seed) does not average out: a level is known only as well as its different seeds
allow, and what is not √β apart by that is one level.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri


class Level(NamedTuple):
    """Measurements first … last (both counted) have this mean; error: its standard error, of independent noise only."""

    first: int
    last: int
    value: float
    error: float


def levels(values: Sequence[float], errors: Sequence[float], noises: Sequence[Hashable], alarm: float) -> list[Level]:
    """The levels of a series in its own unit; one where nothing changed, none of nothing. errors: standard errors, all > 0.
    noises: measurements of the same one share their noise. alarm: probability that a series without change has one."""
    # The same number with the same noise is the same measurement.
    runs = [[*run] for _, run in groupby(range(len(values)), lambda i: (values[i], errors[i], noises[i]))]
    if not runs:
        return []
    first = [run[0] for run in runs]
    x, s = np.asarray(values, float)[first], np.asarray(errors, float)[first]
    limit = threshold(len(runs), alarm)
    ends = _partition(x, s, limit**2)
    noise = [noises[i] for i in first]
    while True:
        found = [_level(x[a:b], s[a:b], noise[a:b]) for a, b in zip([0, *ends], [*ends, len(x)], strict=True)]
        apart = [abs(v - u) / math.hypot(d, e) for (u, d), (v, e) in pairwise(found)]
        if not apart or min(apart) >= limit:
            break
        del ends[int(np.argmin(apart))]
    spans = zip([0, *ends], [*ends, len(runs)], found, strict=True)
    return [Level(runs[a][0], runs[b - 1][-1], value, error) for a, b, (value, error) in spans]


def threshold(count: int, alarm: float) -> float:
    """√β: standard errors that two neighbouring levels of `count` measurements are apart at least."""
    return -float(ndtri(alarm / 2 / max(math.comb(count + 1, 3), 1)))


def _partition(x: NDArray, s: NDArray, penalty: float) -> list[int]:
    """Where the second and later pieces of the best partition begin."""
    x, weight = x - np.median(x), s**-2.0
    w, wx, wxx = (np.concatenate([[0.0], np.cumsum(weight * x**k)]) for k in (0, 1, 2))
    best, before = np.zeros(len(x) + 1), np.zeros(len(x) + 1, int)
    for end in range(1, len(x) + 1):
        residual = wxx[end] - wxx[:end] - (wx[end] - wx[:end]) ** 2 / (w[end] - w[:end])
        total = best[:end] + residual + penalty * (np.arange(end) > 0)
        before[end] = np.argmin(total)
        best[end] = total[before[end]]
    ends, end = [], int(before[-1])
    while end:
        ends.append(end)
        end = int(before[end])
    return ends[::-1]


def _level(x: NDArray, s: NDArray, noises: Sequence[Hashable]) -> tuple[float, float]:
    """(mean, its standard error): measurements that share their noise count as one."""
    shared: dict[Hashable, list[int]] = {}
    for k, noise in enumerate(noises):
        shared.setdefault(noise, []).append(k)
    means = np.array([x[k].mean() for k in shared.values()])
    weights = np.array([np.mean(s[k] ** 2) for k in shared.values()]) ** -1.0
    return float(np.average(means, weights=weights)), float(weights.sum() ** -0.5)
