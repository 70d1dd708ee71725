"""What several values of one quantity say of its mean: Student's t over maps, directions or views."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from scipy.special import stdtrit


def mean(values: Iterable[float]) -> dict[str, object]:
    """{"value", "ci95"} of the mean; no interval for fewer than two values."""
    x = np.asarray(list(values), np.float64)
    if len(x) < 2:
        return {"value": float(x.mean()), "ci95": [None, None]}
    half = float(stdtrit(len(x) - 1, 0.975) * x.std(ddof=1) / len(x) ** 0.5)
    return {"value": float(x.mean()), "ci95": [float(x.mean()) - half, float(x.mean()) + half]}


def geometric(ratios: Iterable[float]) -> dict[str, object]:
    """The same of ratios, which are as likely to be k as 1/k: the mean of their logarithms, raised again."""
    of_log = mean(np.log(list(ratios)))
    return {
        "value": float(np.exp(of_log["value"])),
        "ci95": [None if end is None else float(np.exp(end)) for end in of_log["ci95"]],
    }


def above(metric: Mapping, limit: float) -> bool:
    """Whether the whole interval lies above the limit."""
    return metric["ci95"][0] is not None and metric["ci95"][0] > limit


def below(metric: Mapping, limit: float) -> bool:
    """Whether the whole interval lies below the limit."""
    return metric["ci95"][1] is not None and metric["ci95"][1] < limit


def within(metric: Mapping, low: float, high: float) -> bool:
    """Whether the whole interval lies between the limits."""
    return above(metric, low) and below(metric, high)
