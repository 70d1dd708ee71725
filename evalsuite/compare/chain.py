"""A technique's error split by cause: a chain of truths from the full one to the technique's own picture, each giving up one
more thing.

With pictures X₀ (full truth) … X_n (the technique's), rung k is d_k = X_{k+1} − X_k and D = X_n − X₀ the whole error. A rung's
share of the mean squared error is **⟨d_k, D⟩/N**: the shares add up to ⟨D, D⟩/N, and may be negative, where a cause makes up for
others.

Noise. X₀'s stands in both factors of rung 0 alone, so that product is formed across its two independent halves A, B:
½ [(X₁ − A)(X_n − B) + (X₁ − B)(X_n − A)], and all others with their mean. The sum is then exactly (X_n − A)(X_n − B), the mean
squared error without the reference's noise. An image with noise of its own has it in both factors of the last rung, where its
variance is taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.statistics import Z95, Metric
from evalsuite.errors import EvalsuiteError

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Step:
    """One picture of a chain, its pixels in the mask (P, 3): mean of `halves`, which are None for a picture without noise, and
    its standard error."""

    mean: Float
    standard_error: Float
    halves: tuple[Float, Float] | None = None

    @classmethod
    def of(cls, halves: tuple[NDArray, NDArray], standard_error: NDArray) -> Step:
        """From two independent halves and the standard error of their mean."""
        a, b = (np.asarray(half, np.float64) for half in halves)
        return cls(0.5 * (a + b), np.asarray(standard_error, np.float64), (a, b))

    @classmethod
    def drawn(cls, image: NDArray, standard_error: NDArray | None = None) -> Step:
        """A technique's own picture."""
        image = np.asarray(image, np.float64)
        return cls(image, np.zeros_like(image) if standard_error is None else np.asarray(standard_error, np.float64))


@dataclass(frozen=True)
class Rung:
    """share: of the mean squared error [radiance²], fraction: that over all of it. rel_rmse, rel_bias: of the rung's own
    difference, over the mean of the full truth."""

    share: Metric
    fraction: float
    rel_rmse: Metric
    rel_bias: Metric


@dataclass(frozen=True)
class Chain:
    """rungs, from full truth to image. total: mean squared error. closure: what the shares' sum misses of it, relative."""

    rungs: tuple[Rung, ...]
    total: float
    closure: float


def split(steps: Sequence[Step]) -> Chain:
    """The shares of a chain of at least two pictures. Raises EvalsuiteError where the full truth has no halves."""
    truth, image = steps[0], steps[-1]
    if len(steps) < 2 or truth.halves is None:
        raise EvalsuiteError("chain", f"{len(steps)} pictures", "a full truth with two halves, and at least one picture more")
    a, b = truth.halves
    own_variance = float((image.standard_error**2).mean())
    total = float(((image.mean - a) * (image.mean - b)).mean()) - own_variance
    mean = float(truth.mean.mean())
    rungs = []
    for k, (start, end) in enumerate(pairwise(steps)):
        difference, error = end.mean - start.mean, image.mean - truth.mean
        if k == 0:
            share = 0.5 * float(((end.mean - a) * (image.mean - b) + (end.mean - b) * (image.mean - a)).mean())
        else:
            share = float((difference * error).mean())
        if k == len(steps) - 2:
            share -= own_variance
        rungs.append(
            Rung(
                _interval(share, _spread(k, steps, difference, error)),
                share / total if total else 0.0,
                _relative_rms(start, end, difference, mean),
                _relative_bias(start, end, difference, mean),
            )
        )
    missing = total - sum(rung.share.value for rung in rungs)
    return Chain(tuple(rungs), total, abs(missing) / abs(total) if total else abs(missing))


def _interval(value: float, deviation: float) -> Metric:
    return Metric(value, (value - Z95 * deviation, value + Z95 * deviation))


def _spread(k: int, steps: Sequence[Step], difference: Float, error: Float) -> float:
    """Standard deviation of a share: what each picture's noise moves it by, and noise times noise. Channels of a pixel may move
    together, so they are added before squaring; pixels do not."""
    slope: dict[int, Float] = {}
    for index, part in ((k + 1, error), (k, -error), (len(steps) - 1, difference), (0, -difference)):
        slope[index] = slope.get(index, 0.0) + part
    first = sum(((part * steps[index].standard_error).sum(-1) ** 2).sum() for index, part in slope.items())
    of_difference = (steps[k].standard_error ** 2 + steps[k + 1].standard_error ** 2).sum(-1)
    of_error = (steps[0].standard_error ** 2 + steps[-1].standard_error ** 2).sum(-1)
    return float(np.sqrt(first + (of_difference * of_error).sum())) / difference.size


def _relative_rms(start: Step, end: Step, difference: Float, mean: float) -> Metric:
    variance = start.standard_error**2 + end.standard_error**2
    square = float((difference**2 - variance).mean())
    first = ((2.0 * np.abs(difference) * np.sqrt(variance)).sum(-1) ** 2).sum()
    interval = _interval(square, float(np.sqrt(first + 2.0 * (variance.sum(-1) ** 2).sum())) / difference.size)
    return interval.within(0.0).map(lambda x: float(np.sqrt(max(x, 0.0))) / mean if mean > 0 else float("nan"))


def _relative_bias(start: Step, end: Step, difference: Float, mean: float) -> Metric:
    together = (np.sqrt(start.standard_error**2 + end.standard_error**2).sum(-1) ** 2).sum()
    scale = 1.0 / mean if mean > 0 else float("nan")
    return _interval(float(difference.mean()) * scale, float(np.sqrt(together)) / difference.size * scale)
