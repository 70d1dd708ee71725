"""Which of two pictures is nearer to the truth, and whether the noise could say otherwise.

Both are compared with one reference, whose noise is then largely the same in both errors. The difference of the two mean squared
errors, with pictures a and b and the reference R = μ + e,

    mse(b) − mse(a) = mean (b − R)² − mean (a − R)² = mean (b − a)(a + b − 2R),

is linear in e: nothing is to be debiased, and its spread is that of mean 2 (b − a) e, which is small where the pictures are
alike, however large either error is. A picture's own noise is freed as `statistics` says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from evalsuite.compare.statistics import Metric, Noisy, measured, standard_error
from evalsuite.compare.unified import Z95


@dataclass(frozen=True)
class Pair:
    """Two neighbours in an order. difference: worse − better [radiance²]. decided: whether it differs from 0 at the confidence
    asked for."""

    better: str
    worse: str
    difference: Metric
    decided: bool

    def to_json(self) -> dict[str, object]:
        return {
            "better": self.better,
            "worse": self.worse,
            "difference": self.difference.to_json(),
            "decided": self.decided,
        }


def difference(better: Noisy, worse: Noisy, reference: Noisy) -> Metric:
    """mse(worse) − mse(better) against one reference, over pixels (P, 3) [radiance²], without bias, with its 95 % interval."""
    a, b, r = better.complex, worse.complex, reference.complex
    found = (b - a) * (a + b - 2 * r)
    value, half = float(found.real.mean()), Z95 * standard_error(found.imag, measured(better, worse, reference))
    return Metric(value, (value - half, value + half))


def rank(pictures: Mapping[str, Noisy], reference: Noisy, confidence: float = 0.95) -> tuple[Pair, ...]:
    """The pictures (id → pixels (P, 3)) from the smallest mean squared error to the largest, as pairs of neighbours.

    confidence: with which a decided pair's difference is not 0. Equal pictures stay undecided whatever is sampled."""

    def score(name: str) -> float:
        return float(np.square(pictures[name].complex - reference.complex).real.mean())

    quantile = float(ndtri(0.5 + confidence / 2)) / Z95
    pairs = []
    for better, worse in pairwise(sorted(pictures, key=score)):
        found = difference(pictures[better], pictures[worse], reference)
        half = found.ci95[1] - found.value
        pairs.append(Pair(better, worse, found, found.value > quantile * half))
    return tuple(pairs)
