"""From error per pixel to a number with a 95 % interval, when the reference (and perhaps the image) carries noise.

Model. The reference is R = μ + e with e independent between pixels, normal, of standard deviation s (its standard error).
The halves A, B give one further realisation h = (A − B)/2 of e, as large and independent of it.

Then z = R + i h is a complex normal variable about μ that no rotation in the complex plane changes. An analytic function f has at
the centre of such a disc its mean over it (the mean value property), and so has f²:

    E f(z) = f(μ) and E f(z)² = f(μ)², hence E Re f(z) = f(μ) and Var Re f(z) = E (Im f(z))².

So **Re f(R + i h) is free of the noise's own share, to all orders, and (Im f)² states its variance without bias**, for functions
of several channels with any correlation between them too. For the squared error Re f is (I − A)(I − B) and Im f is −2 (I − R) h,
whose mean square is 4 d² s² + 4 s⁴ with the true error d. A sum over pixels has the sum of their variances. Each has one degree
of freedom, the sum those of Welch and Satterthwaite, and Student's t widens the interval where a few pixels decide it. Where
only a standard error is known, ± s stands for h, and of the channels' correlation the worse of 0 and 1 is taken.

Skewed noise of third cumulant κ adds −f‴ κ / 3 to E f(z), which two halves cannot know of (no function of A and B is unbiased
for a cubic); a renderer that has seen many passes can. The mean of f over z + c, z + c ω, z + c ω², with ω a third root of 1
and c = ∛(2 κ), is f(z) + f‴(z) κ / 3 up to the sixth order, and takes it back. See docs/intervals.md.

An error with a kink at 0 is not analytic; see `averaged`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.special import stdtrit

from evalsuite.compare.metrics import PerChannel, Pixels, squared_error
from evalsuite.compare.unified import Z95, nonnegative_interval

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

    def reaching(self, *others: Metric) -> Metric:
        """The number with an interval that holds those of the others too."""
        ends = [self.ci95, *(other.ci95 for other in others)]
        return Metric(self.value, (min(lo for lo, _ in ends), max(hi for _, hi in ends)))

    def within(self, lowest: float, highest: float = math.inf) -> Metric:
        """The interval cut to the values that the metric can take."""
        lo, hi = (min(max(end, lowest), highest) for end in self.ci95)
        return Metric(self.value, (lo, hi))


@dataclass(frozen=True, eq=False)
class Noisy:
    """Pixels (…, 3) of a picture with their standard error and one further realisation of their noise, which was measured
    (by two halves) or made up from the standard error. skew: cube root of the noise's third cumulant, where that is known."""

    mean: Pixels
    standard_error: Pixels
    noise: Pixels
    measured: bool = False
    skew: Pixels | None = None

    def __getitem__(self, chosen: NDArray) -> Noisy:
        """Those of pixels, by a mask or by their indices."""
        everything = chosen.dtype == bool and chosen.all()  # a view, at no cost

        def inside(values: Pixels) -> Pixels:
            return values.reshape(-1, 3) if everything else values[chosen]

        skew = None if self.skew is None else inside(self.skew)
        return Noisy(inside(self.mean), inside(self.standard_error), inside(self.noise), self.measured, skew)

    @property
    def still(self) -> bool:
        """Whether there is no noise in it."""
        return not (self.noise.any() or self.standard_error.any())

    @property
    def complex(self) -> NDArray[np.complex128]:
        """R + i h."""
        return self.mean + 1j * self.noise

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
        return float(self.mean.mean()), standard_error(self.noise, self.measured)


def debiased(error: PerChannel, image: Noisy, reference: Noisy, quadratic: bool = False) -> Metric:
    """Mean of a nonnegative error per channel, analytic in both pictures, free of the noise's own share; value and ends are not
    below 0 (`unified`).

    Richardson's 2 f(R) − ½ (f(A) + f(B)) removes the same share to second order only; what is left has another sign and size.
    Where the noise is too far from normal for its third order to tell all, the interval reaches over both: where that order is
    more than a standard error or, of unknown skewness, where the two differ by more. quadratic: the error is, in both pictures:
    there is no third order."""
    if image.still and reference.still:
        value = float(error(image.mean, reference.mean).mean())
        return _exact(value if math.isfinite(value) else math.inf)
    found = error(image.complex, reference.complex) if quadratic else _analytic(error, image.complex, reference)
    value, known = float(found.real.mean()), measured(image, reference)
    if not math.isfinite(value):
        return _exact(math.inf)
    spread = standard_error(found.imag, known)
    lo, hi = nonnegative_interval(value, spread)
    if quadratic:
        return Metric(max(value, 0.0), (lo, hi))
    first, plus, minus = (error(a, b) for a, b in _realisations(image, reference))
    second_order = float((2 * first - (plus + minus) / 2).mean())
    if reference.skew is None:
        doubtful = abs(second_order - value) > spread
    else:
        doubtful = abs(float(error(image.complex, reference.complex).real.mean()) - value) > spread
    if doubtful:
        other = nonnegative_interval(second_order, standard_error((plus - minus) / 2, known))
        lo, hi = min(lo, other[0]), max(hi, other[1])
    return Metric(max(value, 0.0), (lo, hi))


def _exact(value: float) -> Metric:
    return Metric(value, (value, value))


def _analytic(error: PerChannel, image: NDArray[np.complex128], reference: Noisy) -> NDArray[np.complex128]:
    """f(z) of complex pictures, its third order in the reference's noise freed of skewness."""
    z = reference.complex
    if reference.skew is None:
        return error(image, z)
    c = np.cbrt(2.0) * reference.skew
    return sum(error(image, z + c * root) for root in _ROOTS) / 3


_ROOTS = np.exp(2j * np.pi / 3 * np.arange(3))


def bias(image: Noisy, reference: Noisy) -> Metric:
    """mean(image − reference); exactly normal for many pixels."""
    (a, da), (b, db) = image.grand_mean, reference.grand_mean
    half = Z95 * math.hypot(da, db)
    return Metric(a - b, (a - b - half, a - b + half))


def relative_bias(image: Noisy, reference: Noisy) -> Metric:
    """mean(image − reference) / mean(reference) = ā / b̄ − 1, with the uncertainty of both means."""
    (a, da), (b, db) = image.grand_mean, reference.grand_mean
    if b == 0:
        return _exact(0.0 if a == 0 else math.inf)
    value, half = (a - b) / b, Z95 * math.hypot(da / b, db * a / b**2)
    return Metric(value, (value - half, value + half))


def relative_root(image: Noisy, reference: Noisy) -> Metric:
    """√(mean (a − b)²) / b̄, debiased. The noise of the reference's mean b̄ is the same that moves the error, so both go into
    one response: to first order mse / b̄² moves by (−2 (a − b) − 2 mse / b̄) e / b̄²."""
    mean, _ = reference.grand_mean
    mse = debiased(squared_error, image, reference, quadratic=True).value
    if mean == 0:
        return _exact(0.0 if mse == 0 else math.inf)

    def error(a: Pixels, b: Pixels) -> Pixels:
        return (np.square(a - b) - 2 * mse / mean * (b - mean)) / mean**2

    return debiased(error, image, reference, quadratic=True).map(math.sqrt)


def averaged(error: PerChannel, image: Noisy, reference: Noisy) -> Metric:
    """Mean of an error with a kink at 0 (|a − b|): reported as it is, with an interval that reaches to the noise-free value.
    See `extrapolated`; the order of the noise's share is 1."""
    if image.still and reference.still:
        return _exact(float(error(image.mean, reference.mean).mean()))
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
        return _exact(float(error.max()))
    return Metric(float(error.max()), (lowest, float((error + Z95 * sigma).max())))


def percentile(f: Callable[[Pixels, Pixels], Pixels], q: float, image: Noisy, reference: Noisy) -> Metric:
    """q-th percentile of the error."""
    return redrawn(lambda a, b: float(np.percentile(f(a, b), q)), image, reference)


def redrawn(f: Callable[[Pixels, Pixels], float], image: Noisy, reference: Noisy) -> Metric:
    """A nonnegative number of whole pictures; noise of the known standard errors, drawn anew, gives its spread and its share."""
    value = f(image.mean, reference.mean)
    sigma = np.hypot(image.standard_error, reference.standard_error)
    if not sigma.any():
        return _exact(value)
    generator = np.random.default_rng(0)
    plus, minus = np.empty(DRAWS), np.empty(DRAWS)
    for k in range(DRAWS):
        noise = sigma * generator.standard_normal(sigma.shape[:-1])[..., None]
        plus[k] = f(image.mean, reference.mean + noise)
        minus[k] = f(image.mean, reference.mean - noise)
    spread = math.sqrt(np.square(plus - minus).mean()) / 2 * float(stdtrit(DRAWS, 0.975)) / Z95
    bend = float(((plus + minus) / 2).std())
    one = (np.array([v]) for v in (value, plus.mean(), minus.mean()))
    return extrapolated(*one, 1.0, spread, bend).within(0.0)


def _realisations(image: Noisy, reference: Noisy) -> tuple[tuple[Pixels, Pixels], ...]:
    return (image.mean, reference.mean), (image.plus, reference.plus), (image.minus, reference.minus)


def _spread(error: PerChannel, image: Noisy, reference: Noisy) -> float:
    """Standard error of the mean of an error per channel, to first order in both pictures' independent noise."""
    a, b = image, reference
    parts = [standard_error((error(a.mean, b.plus) - error(a.mean, b.minus)) / 2, b.measured)]
    if a.noise.any():
        parts.append(standard_error((error(a.plus, b.mean) - error(a.minus, b.mean)) / 2, a.measured))
    return math.hypot(*parts)


def measured(*pictures: Noisy) -> bool:
    """Whether all noise there is was measured."""
    return all(picture.measured or not picture.noise.any() for picture in pictures)


def standard_error(response: Pixels, measured: bool) -> float:
    """Of the mean over pixels and channels, pixels being independent, from the response of each to a further realisation of the
    noise; widened by Student's t for the degrees of freedom that measured noise has: ν = 3 (Σ v)² / Σ v² − 2, of one each (Welch
    1947, Satterthwaite 1946), taken halfway to 1, since of one pixel beside many it promises too much (92 % where it has half of
    the variance; 93 so, and 95 to 97 for few alike). Made-up noise knows no correlation of channels: the worse of 0 and 1."""
    together = np.square(response.mean(axis=-1))
    total = together.sum()
    if not measured:
        total = max(total, np.square(response).sum() / response.shape[-1] ** 2)
    elif total > 0:
        freedom = 3 * total**2 / np.square(together).sum() - 2
        total *= (float(stdtrit((freedom + 1) / 2, 0.975)) / Z95) ** 2
    return math.sqrt(total) / together.size


def _windowed(values: NDArray) -> float:
    """Standard deviation of the sum of a map with correlations shorter than WINDOW: root mean square of its sums over all
    windows, times the root of their number a map holds."""
    padded = np.pad(values.astype(np.float64), WINDOW // 2)
    sums = uniform_filter(padded, WINDOW, mode="constant") * WINDOW**2
    return math.sqrt(np.square(sums).sum()) / WINDOW
