"""From error per pixel to a number with a 95 % interval, when the reference (and perhaps the image) carries noise.

Model. The reference is R = μ + e with e independent between pixels, of standard deviation s (its standard error).
Between the channels of a pixel any correlation ρ ≥ 0 is allowed for: a variance is linear in ρ, so the worse of 0 and 1.
The halves A, B give one further realisation h = (A − B)/2 of e: A = R + h and B = R − h each carry twice the variance of R.

Debiasing. For a metric f smooth in the reference, f(R) is too large by b = ½ f″ s² and the mean f̄ of f(A), f(B) by 2b, so
2 f(R) − f̄ is free of it (Richardson). For the squared error this is exactly mean((I − A)(I − B)).

Spread. To first order f(R) − f(μ) is the sum over pixels of f′ e, so its variance is the sum of (f′ s)² with
f′ s = ½ (f(R + s) − f(R − s)): for the squared error 4 D² s², whose expectation is 4 d² s² + 4 s⁴ with the true error d.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.special import stdtrit

from evalsuite.compare.metrics import PerChannel, Pixels

#: Two-sided 95 % quantile of the normal distribution.
Z95 = 1.959963984540054
#: Edge of the window within which SSIM's and FLIP's filters (11 and about 19 pixels wide) correlate neighbours [pixels].
WINDOW = 32
#: Realisations of noise drawn for percentiles.
DRAWS = 8


@dataclass(frozen=True)
class Metric:
    """A number and its 95 % interval, in the metric's unit."""

    value: float
    ci95: tuple[float, float]

    def to_json(self) -> dict[str, object]:
        """Plain JSON; None where not finite (an unbounded psnr, a relative error on a black reference)."""
        value, lo, hi = (float(v) if math.isfinite(v) else None for v in (self.value, *self.ci95))
        return {"value": value, "ci95": [lo, hi]}

    def map(self, f: Callable[[float], float]) -> Metric:
        """The metric and its ends under a monotone f."""
        lo, hi = sorted((f(self.ci95[0]), f(self.ci95[1])))
        return Metric(f(self.value), (lo, hi))

    def within(self, lowest: float, highest: float = math.inf) -> Metric:
        """The interval cut to the values that the metric can take."""
        lo, hi = (min(max(end, lowest), highest) for end in self.ci95)
        return Metric(self.value, (lo, hi))


@dataclass(frozen=True, eq=False)
class Noisy:
    """Pixels (…, 3) of a picture with their standard error and one further realisation of their noise."""

    mean: Pixels
    standard_error: Pixels
    noise: Pixels

    def __getitem__(self, mask: NDArray[np.bool_]) -> Noisy:
        return Noisy(self.mean[mask], self.standard_error[mask], self.noise[mask])

    @property
    def plus(self) -> Pixels:
        """The first half: the mean and its further noise."""
        return self.mean + self.noise

    @property
    def minus(self) -> Pixels:
        """The second half."""
        return self.mean - self.noise

    @property
    def grand_mean(self) -> tuple[float, float]:
        """(mean over pixels and channels, its standard error)."""
        return float(self.mean.mean()), _standard_error(self.standard_error)


def debiased(error: PerChannel, image: Noisy, reference: Noisy, quadratic: bool = False) -> Metric:
    """Mean of a smooth, nonnegative error per channel, free of the noise's own share; value and ends are floored at 0.

    Unless the error is quadratic in the reference, 2 f₁ − f₂ (indices: noise variance) leaves a share of order s⁴. A third
    level shows it: where 3 f₁ − 3 f₂ + f₃ differs by more than its own standard error, the interval reaches to that value too.
    """
    levels = [error(a, b).mean(axis=-1) for a, b in _realisations(image, reference)]
    first, second = levels[0], (levels[1] + levels[2]) / 2
    value = float((2 * first - second).mean())
    if not math.isfinite(value):
        return Metric(math.inf, (math.inf, math.inf))
    half = Z95 * _spread(error, image, reference)
    lo, hi = value - half, value + half
    if not quadratic and reference.noise.any():
        residue = first - 2 * second + _third_level(error, image, reference)
        shift, doubt = float(residue.mean()), float(residue.std()) / math.sqrt(residue.size)
        if abs(shift) > doubt or hi < 0:  # a negative mean square betrays that share as well
            wide = math.hypot(half, Z95 * doubt)
            lo, hi = min(lo, value + shift - wide), max(hi, value + shift + wide)
    return Metric(max(value, 0.0), (max(lo, 0.0), max(hi, 0.0)))


def bias(image: Noisy, reference: Noisy) -> Metric:
    """mean(image − reference); exactly normal for many pixels."""
    (a, da), (b, db) = image.grand_mean, reference.grand_mean
    half = Z95 * math.hypot(da, db)
    return Metric(a - b, (a - b - half, a - b + half))


def relative_bias(image: Noisy, reference: Noisy) -> Metric:
    """mean(image − reference) / mean(reference) = ā / b̄ − 1, with the uncertainty of both means."""
    (a, da), (b, db) = image.grand_mean, reference.grand_mean
    if b == 0:
        return Metric(0.0, (0.0, 0.0)) if a == 0 else Metric(math.inf, (math.inf, math.inf))
    value, half = (a - b) / b, Z95 * math.hypot(da / b, db * a / b**2)
    return Metric(value, (value - half, value + half))


def over_mean(metric: Metric, reference: Noisy) -> Metric:
    """metric / mean(reference), widened by the relative uncertainty of that mean."""
    mean, error = reference.grand_mean
    if mean == 0:
        return Metric(0.0, (0.0, 0.0)) if metric.value == 0 else Metric(math.inf, (math.inf, math.inf))
    lo, hi = (math.hypot(end - metric.value, Z95 * metric.value * error / mean) for end in metric.ci95)
    return Metric(metric.value / mean, (max(metric.value - lo, 0.0) / mean, (metric.value + hi) / mean))


def averaged(error: PerChannel, image: Noisy, reference: Noisy) -> Metric:
    """Mean of an error with a kink at 0 (|a − b|): reported as it is, with an interval that reaches to the noise-free value.
    See `extrapolated`; the order of the noise's share is 1."""
    f, plus, minus = (error(a, b).mean(axis=-1) for a, b in _realisations(image, reference))
    return extrapolated(f, plus, minus, 1.0, _spread(error, image, reference)).within(0.0)


def of_map(f: NDArray, plus: NDArray, minus: NDArray, mask: NDArray[np.bool_], order: float, ratio: bool = False) -> Metric:
    """Mean over the mask of an (H, W) map whose filters correlate neighbours. Half the difference of the two half maps
    responds to h as f does to e; its spread is that of its sums over all windows of WINDOW² pixels (a Bartlett kernel)."""
    count = int(mask.sum())
    response = np.where(mask, (plus - minus) / 2, 0.0)
    second = np.where(mask, (plus + minus) / 2 - f, 0.0)
    about_mean = np.where(mask, second - second.sum() / count, 0.0)
    # The kernel of edge w averages over N / (2w/3)² independent patches; few of them know their own variance badly.
    patches = max(count / (2 * WINDOW / 3) ** 2, 1.0)
    spread = _windowed(response) / count * float(stdtrit(patches, 0.975)) / Z95
    values = (v[mask].astype(np.float64) for v in (f, plus, minus))
    return extrapolated(*values, order, spread, _windowed(about_mean) / count, ratio)


def extrapolated(
    f: NDArray, plus: NDArray, minus: NDArray, order: float, spread: float, bend: float | None = None, ratio: bool = False
) -> Metric:
    """mean(f), with the union of its interval and that of its extrapolation to no noise.

    f, plus, minus: the map at noise variance 1 and twice at 2. If the noise's share grows as variance^(order/2), the
    noise-free value is f − (f̄₂ − f) / (2^(order/2) − 1). Smooth parts of a map have order 2, kinks and roots, which
    dominate where the error is near 0, a lower one; the lowest is the widest. spread: standard error of mean(f). bend:
    standard error of mean(½(plus + minus) − f), from independent pixels if not given. ratio: extrapolate 1/f instead, for
    maps whose noise stands in a denominator.
    """
    value = float(f.mean())
    second = (plus + minus) / 2 - f
    change = float(second.mean())
    bend = float(second.std()) / math.sqrt(second.size) if bend is None else bend
    gain = 1 / (2 ** (order / 2) - 1)
    clean = value - gain * change
    wide = math.hypot(spread, gain * bend)
    if ratio and change and value > 0 and value + change > 0:
        inverse = (1 + gain) / value - gain / (value + change)
        clean = 1 / inverse if inverse > 0 else math.inf
        wide *= min((clean / value) ** 2, 1e6)
    lo, hi = min(value - Z95 * spread, clean - Z95 * wide), max(value + Z95 * spread, clean + Z95 * wide)
    return Metric(value, (lo, hi))


def maximum(f: Callable[[Pixels, Pixels], Pixels], image: Noisy, reference: Noisy, lowest: float) -> Metric:
    """Largest error of all pixels. Upper end: the pixel that truly is the largest carries ordinary noise. Lower end:
    `lowest`, that of a percentile; the largest of many noisy pixels says too little by itself where tails are heavy."""
    error = f(image.mean, reference.mean)
    sigma = np.hypot(image.standard_error, reference.standard_error).max(axis=-1)
    if not sigma.any():
        return Metric(float(error.max()), (float(error.max()), float(error.max())))
    return Metric(float(error.max()), (lowest, float((error + Z95 * sigma).max())))


def percentile(f: Callable[[Pixels, Pixels], Pixels], q: float, image: Noisy, reference: Noisy) -> Metric:
    """q-th percentile of the error; noise of the known standard errors, drawn anew, gives its spread and its share."""
    value = float(np.percentile(f(image.mean, reference.mean), q))
    sigma = np.hypot(image.standard_error, reference.standard_error)
    if not sigma.any():
        return Metric(value, (value, value))
    generator = np.random.default_rng(0)
    plus, minus = np.empty(DRAWS), np.empty(DRAWS)
    for k in range(DRAWS):
        noise = sigma * generator.standard_normal(sigma.shape[:-1])[..., None]
        plus[k] = np.percentile(f(image.mean, reference.mean + noise), q)
        minus[k] = np.percentile(f(image.mean, reference.mean - noise), q)
    spread = math.sqrt(np.square(plus - minus).mean()) / 2 * float(stdtrit(DRAWS, 0.975)) / Z95
    bend = float(((plus + minus) / 2).std())
    one = (np.array([v]) for v in (value, plus.mean(), minus.mean()))
    return extrapolated(*one, 1.0, spread, bend).within(0.0)


def _realisations(image: Noisy, reference: Noisy) -> tuple[tuple[Pixels, Pixels], ...]:
    return (image.mean, reference.mean), (image.plus, reference.plus), (image.minus, reference.minus)


def _spread(error: PerChannel, image: Noisy, reference: Noisy) -> float:
    """Standard error of the mean of an error per channel, to first order in both pictures' independent noise."""
    b, db, a, da = reference.mean, reference.standard_error, image.mean, image.standard_error
    parts = [_standard_error((error(a, b + db) - error(a, b - db)) / 2)]
    if da.any():
        parts.append(_standard_error((error(a + da, b) - error(a - da, b)) / 2))
    return math.hypot(*parts)


def _third_level(error: PerChannel, image: Noisy, reference: Noisy) -> Pixels:
    """Error per pixel at three times the noise variance: the halves with one more drawn realisation."""
    generator = np.random.default_rng(2)
    a, b = (p.standard_error * generator.standard_normal(p.mean.shape[:-1])[..., None] for p in (image, reference))
    plus, minus = error(image.plus + a, reference.plus + b), error(image.minus - a, reference.minus - b)
    return (plus + minus).mean(axis=-1) / 2


def _standard_error(sigma: Pixels) -> float:
    """Of the mean over pixels and channels of independent pixels with signed channel responses sigma, the worse of fully
    correlated and independent channels."""
    together = np.square(sigma.mean(axis=-1)).sum()
    apart = np.square(sigma).sum() / sigma.shape[-1] ** 2
    return math.sqrt(max(together, apart)) / (sigma.size // sigma.shape[-1])


def _windowed(values: NDArray) -> float:
    """Standard deviation of the sum of a map with correlations shorter than WINDOW: root mean square of its sums over all
    windows, times the root of their number a map holds."""
    padded = np.pad(values.astype(np.float64), WINDOW // 2)
    sums = uniform_filter(padded, WINDOW, mode="constant") * WINDOW**2
    return math.sqrt(np.square(sums).sum()) / WINDOW
