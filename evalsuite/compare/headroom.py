"""How good a technique could be with its best parameter, and what the published choice costs.

Error of a candidate: J(c) = mean (I_c − A)(I_c − B), the mean square free of the reference's noise, A and B its halves. The noise
e of the reference R enters differences J(c) − J(c′) as −2 mean (I_c − I_c′) e alone: candidates share it, so that the best
parameter and the regret are known far better than the error itself.

The best parameter is the vertex c* of a parabola through three values. With weights w_k = ∂c*/∂J_k, which add up to 0, its
variance is that of −2 mean Σ w_k I_k e (the delta method): Var c* = (2/N)² Σ_pixels (Σ w_k I_k s)², s the standard error of R,
which is Var(∂J)/J″² with slope and curvature by differences. Where there is no parabola (whole numbers, a bound), the interval
spans the values that are not worse than the best at 95 %, one-sided.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import statistics
from evalsuite.compare.headroom_search import Range, best_drawn, bracket, vertex
from evalsuite.compare.statistics import Z95, Metric, Noisy

Float = NDArray[np.float64]
#: One-sided 95 % quantile of the normal distribution.
Z90 = 1.6448536269514722


@dataclass(frozen=True)
class Headroom:
    """published: value, as published. best, best_ci95: of the parameter. rel_rmse of both, of their paired difference (regret),
    and with each pixel its own choice among the candidates. at_bound: the best lies at an end of what was searched, or may, as
    past an end of a MIP chain, where nothing changes any more. drawn: value → debiased mean square error [radiance²]."""

    published: float
    published_rel_rmse: Metric
    best: float
    best_ci95: tuple[float, float]
    best_rel_rmse: Metric
    regret: Metric
    per_pixel_rel_rmse: Metric
    at_bound: bool
    drawn: Mapping[float, float]

    def to_json(self) -> dict[str, object]:
        """Plain JSON."""
        named = ("published_rel_rmse", "best_rel_rmse", "regret", "per_pixel_rel_rmse")
        return {
            "published": self.published,
            "best": self.best,
            "best_ci95": list(self.best_ci95),
            **{name: getattr(self, name).to_json() for name in named},
            "at_bound": self.at_bound,
            "drawn": [{"value": value, "mse": self.drawn[value]} for value in sorted(self.drawn)],
        }


def reference(halves: tuple[NDArray, NDArray], standard_error: NDArray) -> Noisy:
    """The truth from its two independent halves and the standard error of their mean, each (P, 3)."""
    a, b = (np.asarray(half, np.float64) for half in halves)
    return Noisy(0.5 * (a + b), np.asarray(standard_error, np.float64), 0.5 * (a - b), measured=True)


def mean_square(picture: NDArray, truth: Noisy) -> float:
    """J: debiased, hence perhaps below 0."""
    picture = np.asarray(picture, np.float64)
    return float(((picture - truth.plus) * (picture - truth.minus)).mean())


def headroom(where: Range, pictures: Mapping[float, NDArray], truth: Noisy) -> Headroom:
    """What the drawn candidates (value → (P, 3) picture, pixels in the mask) say, the published one among them."""
    images = {value: np.asarray(picture, np.float64) for value, picture in pictures.items()}
    drawn = {value: mean_square(image, truth) for value, image in images.items()}
    lowest = best_drawn(where, drawn)
    best, interval, second = _best(where, images, drawn, lowest, truth)
    at_bound = not where.whole and (bracket(where, drawn) is None or interval[0] == where.low or interval[1] == where.high)
    published, best_image = images[where.published], images[lowest]
    # What the published choice may still lose where noise hides whether it is the best.
    hidden = 0.5 * second * max(abs(end - where.published) for end in interval) ** 2
    hidden = hidden if interval[0] <= where.published <= interval[1] else 0.0
    return Headroom(
        published=where.published,
        published_rel_rmse=_relative_rms(published, truth),
        best=best,
        best_ci95=interval,
        best_rel_rmse=_relative_rms(best_image, truth),
        regret=_regret(published, best_image, truth, hidden),
        per_pixel_rel_rmse=_per_pixel(list(images.values()), best_image, truth),
        at_bound=at_bound,
        drawn=drawn,
    )


def _best(
    where: Range, images: Mapping[float, Float], drawn: Mapping[float, float], lowest: float, truth: Noisy
) -> tuple[float, tuple[float, float], float]:
    """Best value, its interval, and the error's second derivative there (0 where no parabola says)."""
    three = None if where.whole else bracket(where, drawn)
    if three is not None:
        errors = tuple(drawn[x] for x in three)
        found, second = vertex(three, errors)
        same = [x for x, image in images.items() if np.array_equal(image, images[lowest])]
        if second > 0 and len(same) == 1:
            best = float(np.clip(found, three[0], three[2]))
            half = Z95 * _noise(_vertex_slope(three, errors, images), truth)
            return best, (max(best - half, where.low), min(best + half, where.high)), second
    near = [x for x, image in images.items() if drawn[x] - drawn[lowest] <= Z90 * _noise(image - images[lowest], truth)]
    ends = min(near), max(near)
    # Nothing was drawn beyond the outermost value: what is as good there may be so further on.
    low = where.low if ends[0] == min(drawn) else ends[0]
    high = where.high if ends[1] == max(drawn) else ends[1]
    return lowest, (low, high), 0.0


def _vertex_slope(three: tuple[float, float, float], errors: tuple[float, float, float], images: Mapping[float, Float]) -> Float:
    """Σ ∂c*/∂J_k I_k, by the closed form c* = ½(a + b) − l/q, l = (f_b − f_a)/(b − a), q = J″."""
    a, b, c = three
    _, second = vertex(three, errors)
    left = (errors[1] - errors[0]) / (b - a)
    of_left = np.array([-1.0, 1.0, 0.0]) / (b - a)
    of_right = np.array([0.0, -1.0, 1.0]) / (c - b)
    of_second = 2.0 * (of_right - of_left) / (c - a)
    weights = -of_left / second + left / second**2 * of_second
    return sum(weight * images[x] for weight, x in zip(weights, three, strict=True))


def _noise(difference: Float, truth: Noisy) -> float:
    """Standard error of 2 mean(difference · e), the channels of a pixel independent or moving together, whichever is worse."""
    parts = difference * truth.standard_error
    together, apart = np.square(parts.sum(-1)).sum(), np.square(parts).sum()
    return 2.0 * sqrt(max(together, apart)) / difference.size


def _relative_rms(image: Float, truth: Noisy) -> Metric:
    """As the cell's own rel_rmse."""
    still = np.zeros_like(image)
    return statistics.relative_root(Noisy(image, still, still), truth)


def _over_mean(metric: Metric, truth: Noisy) -> Metric:
    """metric / mean(truth), widened by the relative uncertainty of that mean, as if the two were independent."""
    mean, error = truth.grand_mean
    if mean == 0:
        return Metric(0.0, (0.0, 0.0)) if metric.value == 0 else Metric(inf, (inf, inf))
    low, high = (hypot(end - metric.value, Z95 * metric.value * error / mean) for end in metric.ci95)
    return Metric(metric.value / mean, (max(metric.value - low, 0.0) / mean, (metric.value + high) / mean))


def _regret(published: Float, best: Float, truth: Noisy, hidden: float) -> Metric:
    """√J_published − √J_best over the mean reference, from the paired difference of the squares, which is where the shared noise
    cancels. hidden: that this difference may be without the noise showing it [radiance²]."""
    base = mean_square(best, truth)
    difference = mean_square(published, truth) - base
    noise, base_noise = Z95 * _noise(published - best, truth), Z95 * _noise(best - truth.mean, truth)

    def root(square: float, extra: float) -> float:
        return sqrt(max(square + extra, 0.0)) - sqrt(max(square, 0.0))

    lowest = root(max(base, 0.0) + base_noise, difference - noise)
    highest = root(max(base - base_noise, 0.0), max(difference + noise, hidden))
    return _over_mean(Metric(root(max(base, 0.0), difference), (max(lowest, 0.0), highest)), truth)


def _per_pixel(images: list[Float], best: Float, truth: Noisy) -> Metric:
    """Relative RMSE with the best candidate in each pixel, chosen by one half and scored by the other: (I − B)² against the best
    candidate's is linear in the noise of B, which the choice by A knows nothing of. A choice by a noisy half is worse than the
    best one, so the value is too large on average; chosen and scored by the same reference it is too small: the lower end."""

    def gain(chooser: Float, scorer: Float) -> float:
        chosen = _chosen(images, chooser)
        return float((np.square(best - scorer) - np.square(chosen - scorer)).mean())

    base = mean_square(best, truth)
    split = base - max(
        0.5 * (gain(truth.plus, truth.minus) + gain(truth.minus, truth.plus)), 0.0
    )  # one choice for all is a choice
    same = base - gain(truth.mean, truth.mean)
    half = Z95 * _noise(_chosen(images, truth.mean) - truth.mean, truth)
    ends = max(min(same, split) - half, 0.0), max(split + half, 0.0)
    return _over_mean(Metric(max(split, 0.0), ends).map(sqrt), truth)


def _chosen(images: list[Float], truth: Float) -> Float:
    """In each pixel the candidate nearest to the truth, all channels together, (P, 3)."""
    nearest = np.argmin([np.square(image - truth).sum(-1) for image in images], axis=0)
    return np.stack(images)[nearest, np.arange(len(truth))]
