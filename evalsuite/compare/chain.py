"""A technique's error split by cause: a chain of truths from the full one to the technique's own picture, each giving up one
more thing.

With pictures X₀ (full truth) … X_n (the technique's), rung k is d_k = X_{k+1} − X_k and D = X_n − X₀ the whole error. A rung's
share of the mean squared error is **⟨d_k, D⟩/N**: the shares add up to ⟨D, D⟩/N, and may be negative, where a cause makes up for
others.

Noise. It stands in both factors: X₀'s in those of rung 0, and every picture's where two are rendered with the same random
numbers, as targets of one seed largely are. So a share is Re ⟨d_k, D⟩ of the complex pictures R + i h (`statistics`): the
product formed across the two independent halves of all pictures, ½ [d_k(A) D(B) + d_k(B) D(A)]. The shares then add up to the
mean squared error without the noise's part, and Im ⟨d_k, D⟩ states their spread. A technique's own noise has no halves; ± its
standard error stands for h.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.metrics import squared_error
from evalsuite.compare.statistics import Metric, Noisy, bias, debiased, standard_error
from evalsuite.compare.unified import Z95
from evalsuite.errors import EvalsuiteError

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Step:
    """One picture of a chain, its pixels in the mask (P, 3), its standard error, and a further realisation of its noise, which
    two halves have measured (their mean is the picture) or the standard error made up. tolerance: what its own numerics leave
    open, in the picture's unit (P, 3) or 0; intervals are widened by it, as by an error that has one sign everywhere."""

    mean: Float
    standard_error: Float
    noise: Float
    measured: bool
    tolerance: Float | float = 0.0

    @classmethod
    def of(cls, halves: tuple[NDArray, NDArray], standard_error: NDArray) -> Step:
        """From two independent halves and the standard error of their mean."""
        a, b = (np.asarray(half, np.float64) for half in halves)
        return cls(0.5 * (a + b), np.asarray(standard_error, np.float64), 0.5 * (a - b), True)

    @classmethod
    def drawn(cls, image: NDArray, standard_error: NDArray | None = None) -> Step:
        """A technique's own picture."""
        image = np.asarray(image, np.float64)
        sigma = np.zeros_like(image) if standard_error is None else np.asarray(standard_error, np.float64)
        sign = np.random.default_rng(1).integers(0, 2, len(image)) * 2.0 - 1.0
        return cls(image, sigma, sigma * sign[:, None], False)

    @classmethod
    def computed(cls, image: NDArray, tolerance: float, of_change: float = 0.0, before: NDArray | None = None) -> Step:
        """A picture without noise. tolerance: relative to each value; of_change: to what it changes of the picture before."""
        image = np.asarray(image, np.float64)
        changed = 0.0 if before is None else of_change * np.abs(image - before)
        return cls(image, np.zeros_like(image), np.zeros_like(image), True, tolerance * np.abs(image) + changed)

    def __sub__(self, other: Step) -> Noisy:
        sigma = np.hypot(self.standard_error, other.standard_error)
        known = all(step.measured or not step.noise.any() for step in (self, other))
        return Noisy(self.mean - other.mean, sigma, self.noise - other.noise, known)


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
    if len(steps) < 2 or not truth.measured:
        raise EvalsuiteError("chain", f"{len(steps)} pictures", "a full truth with two halves, and at least one picture more")
    error = image - truth
    total = float(np.square(error.complex).real.mean())
    mean = float(truth.mean.mean())
    rungs = []
    for start, end in pairwise(steps):
        rung = end - start
        product = rung.complex * error.complex
        open_to = start.tolerance + end.tolerance + np.zeros_like(error.mean)
        half = Z95 * standard_error(product.imag, rung.measured and error.measured) + float((open_to * np.abs(error.mean)).mean())
        share = float(product.real.mean())
        rungs.append(
            Rung(
                Metric(share, (share - half, share + half)),
                share / total if total else 0.0,
                _widened(_relative_rms(rung, mean), float(np.sqrt(np.square(open_to).mean())), mean).within(0.0),
                _widened(_relative_bias(rung, mean), float(open_to.mean()), mean),
            )
        )
    missing = total - sum(rung.share.value for rung in rungs)
    return Chain(tuple(rungs), total, abs(missing) / abs(total) if total else abs(missing))


def _widened(metric: Metric, by: float, mean: float) -> Metric:
    by = by / mean if mean > 0 else 0.0
    return Metric(metric.value, (metric.ci95[0] - by, metric.ci95[1] + by))


def _relative_rms(rung: Noisy, mean: float) -> Metric:
    square = debiased(squared_error, _NOTHING, rung, quadratic=True)
    return square.map(lambda x: float(np.sqrt(x)) / mean if mean > 0 else float("nan"))


def _relative_bias(rung: Noisy, mean: float) -> Metric:
    return bias(rung, _NOTHING).map(lambda x: x / mean if mean > 0 else float("nan"))


_NOTHING = Noisy(*(np.zeros((1, 3)) for _ in range(3)), measured=True)
