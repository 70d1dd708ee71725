"""Which of two pictures is nearer to the truth, and whether the noise could say otherwise.

Both are compared with one reference, whose noise is then largely the same in both errors. The difference of the two mean squared
errors, with pictures a and b and the reference R = μ + e,

    mse(b) − mse(a) = mean (b − R)² − mean (a − R)² = mean (b − a)(a + b − 2R),

is linear in e: nothing is to be debiased, and its spread is that of mean 2 (b − a) e, which is small where the pictures are
alike, however large either error is. A picture with noise n of its own has its variance taken off, and adds mean 2 (a − R) n.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from evalsuite.compare.statistics import Metric, Noisy, standard_error
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
    apart = worse.mean - better.mean
    value = float((apart * (worse.mean + better.mean - 2 * reference.mean)).mean())
    value += float(np.square(better.standard_error).mean() - np.square(worse.standard_error).mean())
    parts = [standard_error(2 * apart * reference.noise, reference.measured)]
    for picture in (better, worse):
        parts.append(standard_error(2 * (picture.mean - reference.mean) * picture.noise, picture.measured))
    half = Z95 * math.hypot(*parts)
    return Metric(value, (value - half, value + half))


def rank(pictures: Mapping[str, Noisy], reference: Noisy, confidence: float = 0.95) -> tuple[Pair, ...]:
    """The pictures (id → pixels (P, 3)) from the smallest mean squared error to the largest, as pairs of neighbours.

    confidence: with which a decided pair's difference is not 0. Equal pictures stay undecided whatever is sampled."""

    def score(name: str) -> float:
        picture = pictures[name]
        return float((np.square(picture.mean - reference.mean) - np.square(picture.standard_error)).mean())

    quantile = float(ndtri(0.5 + confidence / 2)) / Z95
    pairs = []
    for better, worse in pairwise(sorted(pictures, key=score)):
        found = difference(pictures[better], pictures[worse], reference)
        half = found.ci95[1] - found.value
        pairs.append(Pair(better, worse, found, found.value > quantile * half))
    return tuple(pairs)
