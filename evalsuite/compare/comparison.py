"""`compare`: all metrics with intervals, and the maps, of one picture against one reference."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import uniform_filter

from evalsuite.compare import error_map, metrics, perceptual, statistics
from evalsuite.compare.statistics import Metric, Noisy
from evalsuite.errors import EvalsuiteError
from evalsuite.image.color import luminance


class Scale(NamedTuple):
    """Range of a map, and how noise enters its mean (see `statistics.extrapolated`)."""

    lowest: float
    highest: float
    order: float
    ratio: bool = False


#: Differences of colour have a kink at 0, which FLIP raises to the power 0.7; in SSIM the noise's variance stands in the
#: denominator (order 2), of a mean over unlike windows (hence a little less).
PERCEPTUAL = {
    "ssim": Scale(-1.0, 1.0, 1.5, ratio=True),
    "delta_e2000": Scale(0.0, math.inf, 1.0),
    "flip": Scale(0.0, 1.0, 0.7),
    "flip_hdr": Scale(0.0, 1.0, 0.7),
}


@dataclass(frozen=True, eq=False)
class Comparison:
    """metrics: name → value with 95 % interval, over the mask, and over the whole picture with the suffix `_full`.
    difference: (H, W, 3) image − reference. relative: (H, W, 3) that over (reference + ε). zscore: (H, W) |error| in
    standard errors; noise_decided: (H, W) bool, where z < 2; both None without a standard error or halves. flip_map:
    (H, W). exposure: factor of the tone-mapped pictures [1/radiance]. mean_image, mean_reference: mean luminance in the
    mask, which has `pixels` pixels."""

    metrics: Mapping[str, Metric]
    difference: NDArray[np.float32]
    relative: NDArray[np.float32]
    flip_map: NDArray[np.float32]
    zscore: NDArray[np.float32] | None
    noise_decided: NDArray[np.bool_] | None
    exposure: float
    mean_image: float
    mean_reference: float
    pixels: int
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        told = (("rel_rmse", self.metrics["rel_rmse"]), ("rel_bias", self.metrics["rel_bias"]), ("flip", self.metrics["flip"]))
        words = ", ".join(f"{name} {m.value:.3g} [{m.ci95[0]:.3g}, {m.ci95[1]:.3g}]" for name, m in told)
        return f"Comparison({words}; {self.pixels} pixels)"

    def to_json(self) -> dict[str, object]:
        """All but the maps, as plain JSON."""
        return {
            "metrics": {name: metric.to_json() for name, metric in self.metrics.items()},
            "exposure": self.exposure,
            "mean_image": self.mean_image,
            "mean_reference": self.mean_reference,
            "pixels": self.pixels,
            "notes": list(self.notes),
        }


def compare(
    image: ArrayLike,
    reference: ArrayLike,
    standard_error: ArrayLike | None = None,
    halves: tuple[ArrayLike, ArrayLike] | None = None,
    mask: ArrayLike | None = None,
    image_standard_error: ArrayLike | None = None,
    skew: ArrayLike | None = None,
) -> Comparison:
    """Compare two (H, W, 3) linear pictures.

    standard_error: (H, W, 3) of the reference. halves: two independent estimates whose mean is the reference. mask: (H, W)
    bool, or coverage of which more than one half counts; the whole picture if None. image_standard_error: (H, W, 3), for
    pictures that carry Monte Carlo noise themselves. skew: (H, W, 3), cube root of the third cumulant of the reference's noise,
    which `relmse` minds. With neither standard error nor halves nothing is debiased and the
    intervals are single points, which a note says.
    Raises EvalsuiteError for shapes that differ, an empty mask and values that are not finite, naming the first pixel.
    """
    notes: list[str] = []
    truth = _picture("reference", reference)
    picture = _picture("image", image, truth.shape)
    inside = _mask(mask, truth.shape)
    truth = noisy_reference(truth, standard_error, halves, notes, skew)
    noise = _picture("image standard error", image_standard_error, picture.shape) if image_standard_error is not None else None
    picture = noisy_picture(picture, noise, seed=1)

    view = perceptual.view_of(truth.mean, inside)
    views = (view, *other_views(truth[inside], view))
    maps = [_perceptual_maps(picture, truth, each) for each in views]
    if len(views) > 1:
        notes.append("the exposure of the tone-mapped pictures is within the noise of a step: their intervals hold for each side")
    everywhere = np.ones_like(inside)
    result = _score(picture, truth, inside, views, maps)
    whole = result if inside.all() else _score(picture, truth, everywhere, views, maps)
    result |= {f"{name}_full": metric for name, metric in whole.items()}

    scale = float(truth.mean[inside].mean())
    if scale <= 0:
        notes.append("the reference is black inside the mask: relative metrics are undefined unless the image is black too")
    sigma = np.hypot(truth.standard_error, picture.standard_error)
    noise_known = any(given is not None for given in (standard_error, halves, image_standard_error))
    zscore = error_map.z_score(picture.mean, truth.mean, sigma, scale) if noise_known else None
    means = (float(luminance(p.mean[inside]).mean()) for p in (picture, truth))
    return Comparison(
        metrics=result,
        difference=error_map.signed(picture.mean, truth.mean),
        relative=error_map.relative(picture.mean, truth.mean, scale),
        flip_map=maps[0]["flip"][0],
        zscore=zscore,
        noise_decided=None if zscore is None else zscore < error_map.NOISE_DECIDES,
        exposure=view.exposure,
        mean_image=next(means),
        mean_reference=next(means),
        pixels=int(inside.sum()),
        notes=tuple(notes),
    )


def debiased_metrics(picture: Noisy, truth: Noisy) -> dict[str, Metric]:
    """The metrics that are free of the noise's own share, over pixels (P, 3); their intervals hold the truth in 95 %."""
    mean, _ = truth.grand_mean
    mse = statistics.debiased(metrics.squared_error, picture, truth, quadratic=True)
    return {
        "mse": mse,
        "rmse": mse.map(math.sqrt),
        "relmse": statistics.debiased(metrics.relative_squared_error(mean), picture, truth),
        "rel_rmse": statistics.relative_root(picture, truth),
        "bias": statistics.bias(picture, truth),
        "rel_bias": statistics.relative_bias(picture, truth),
    }


def _score(
    picture: Noisy,
    truth: Noisy,
    mask: NDArray[np.bool_],
    views: Sequence[perceptual.View],
    maps: Sequence[Mapping[str, tuple[NDArray, ...]]],
) -> dict[str, Metric]:
    a, b = picture[mask], truth[mask]
    largest = metrics.largest_channel_error
    p99 = statistics.percentile(largest, 99.0, a, b)
    simple = pixelwise(a, b)
    seen = [_seen(simple["mse"], mask, *each) for each in zip(views, maps, strict=True)]
    return {
        **simple,
        **{name: metric.reaching(*(other[name] for other in seen[1:])) for name, metric in seen[0].items()},
        "max_abs": statistics.maximum(largest, a, b, p99.ci95[0]),
        "p99_abs": p99,
    }


def _seen(
    mse: Metric, mask: NDArray[np.bool_], view: perceptual.View, maps: Mapping[str, tuple[NDArray, ...]]
) -> dict[str, Metric]:
    """The metrics of tone-mapped pictures, at one exposure."""
    peak = 1.0 / view.exposure
    return {
        "psnr": mse.map(lambda v: 10 * math.log10(peak**2 / v) if v > 0 else math.inf),
        **{
            name: statistics.of_map(*maps[name], mask, scale.order, scale.ratio).within(scale.lowest, scale.highest)
            for name, scale in PERCEPTUAL.items()
        },
    }


def other_views(truth: Noisy, view: perceptual.View) -> tuple[perceptual.View, ...]:
    """How the noise-free reference could be looked at instead, as far as noise hides which step of exposure its percentiles are
    in. truth: pixels (P, 3)."""
    still = replace(truth, standard_error=np.zeros_like(truth.standard_error))
    white = statistics.redrawn(lambda _, b: perceptual.anchors(luminance(b)).white, still, truth)
    median = statistics.redrawn(lambda _, b: perceptual.anchors(luminance(b)).median, still, truth)
    # An end at 0 says that noise is all there is: half the value stands for it.
    ends = [[max(end, metric.value / 2) for end in metric.ci95] for metric in (white, median)]
    possible = {perceptual.view_between(w, min(m, w)) for w, m in product(*ends)}
    return tuple(sorted(possible - {view}, key=lambda other: other.exposure))


def pixelwise(a: Noisy, b: Noisy) -> dict[str, Metric]:
    """The metrics that are means over pixels, each by itself: a is the image, b the reference, both (N, 3)."""
    return debiased_metrics(a, b) | {
        "mae": statistics.averaged(metrics.absolute_error, a, b),
        "smape": statistics.averaged(metrics.symmetric_relative_error, a, b),
    }


def mean_square(a: Noisy, b: Noisy) -> Metric:
    """mean (a − b)², free of noise."""
    return statistics.debiased(metrics.squared_error, a, b, quadratic=True)


def _perceptual_maps(picture: Noisy, truth: Noisy, view: perceptual.View) -> dict[str, tuple[NDArray, ...]]:
    """name → the map of the means and of the two halves (thrice the same where there is no noise)."""
    mean = perceptual.maps(picture.mean, truth.mean, view)
    if not (picture.noise.any() or truth.noise.any()):
        return {name: (value, value, value) for name, value in mean.items()}
    plus, minus = perceptual.maps(picture.plus, truth.plus, view), perceptual.maps(picture.minus, truth.minus, view)
    return {name: (value, plus[name], minus[name]) for name, value in mean.items()}


def noisy_reference(
    mean: NDArray,
    standard_error: ArrayLike | None,
    halves: tuple[ArrayLike, ArrayLike] | None,
    notes: list[str],
    skew: ArrayLike | None = None,
) -> Noisy:
    """A reference (H, W, 3) of which more or less of the noise is known; `notes` is told what was missing."""
    sigma = _picture("standard error", standard_error, mean.shape) if standard_error is not None else None
    if halves is None:
        if sigma is None:
            notes.append("no standard error and no halves of the reference: nothing is debiased, intervals are single points")
        else:
            notes.append("no halves of the reference: debiased by its standard error")
        return noisy_picture(mean, sigma, seed=0)
    first, second = (_picture(f"half {i + 1}", half, mean.shape) for i, half in enumerate(halves))
    noise = (first - second) / 2
    if sigma is None:
        sigma = np.sqrt(uniform_filter(np.square(noise), (5, 5, 0)))
        notes.append("no standard error of the reference: estimated from its halves over 5 × 5 pixels")
    third = _picture("skew", skew, mean.shape) if skew is not None else None
    return Noisy(mean, np.abs(sigma), noise, True, third)


def noisy_picture(mean: NDArray, sigma: NDArray | None, seed: int) -> Noisy:
    """A picture (H, W, 3). Without halves, ± the standard error stands for a realisation of the noise, its sign drawn
    per pixel."""
    if sigma is None:
        return Noisy(mean, np.zeros(mean.shape), np.zeros(mean.shape))
    signs = np.random.default_rng(seed).integers(0, 2, mean.shape[:2]) * 2.0 - 1.0
    return Noisy(mean, np.abs(sigma), np.abs(sigma) * signs[..., None])


def _picture(what: str, array: ArrayLike, shape: tuple[int, ...] | None = None) -> NDArray[np.float64]:
    values = np.asarray(array, dtype=np.float64)
    expected = shape or "(H, W, 3)"
    if values.ndim != 3 or values.shape[2] != 3 or 0 in values.shape or (shape and values.shape != shape):
        raise EvalsuiteError(what, f"shape {values.shape}", f"shape {expected}")
    finite = np.isfinite(values)
    if not finite.all():
        y, x, channel = np.argwhere(~finite)[0]
        raise EvalsuiteError(
            what,
            f"{values[y, x, channel]} at pixel x={x}, y={y}, channel {'RGB'[channel]} ({np.count_nonzero(~finite)} in all)",
            "finite values",
        )
    return values


def _mask(mask: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    if mask is None:
        return np.ones(shape[:2], bool)
    values = np.asarray(mask)
    inside = values if values.dtype == bool else values > 0.5
    if inside.shape != shape[:2]:
        raise EvalsuiteError("mask", f"shape {inside.shape}", f"shape {shape[:2]}")
    if not inside.any():
        raise EvalsuiteError("mask", "no pixel inside", "at least one")
    return inside
