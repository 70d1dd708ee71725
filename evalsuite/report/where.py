"""Where the error is, for a cell's page: the sentence on the worst region, and the curves as plots."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from evalsuite.compare.regions import ORDER
from evalsuite.report.scales import REGIONS

#: Regions smaller than this part of the object are listed, but not named as the worst.
LEAST_PART = 0.005
WIDTH, HEIGHT = 380.0, 190.0
#: Room about the plot [SVG units].
LEFT, RIGHT, TOP, BOTTOM = 52.0, 10.0, 10.0, 38.0

TITLES = {
    "face_angle": "angle to the cube face's centre [°]",
    "n_dot_v": "n · v, cosine of the viewing angle",
}
SAYS = {
    "highlight": "the brightest 1 % of the reference",
    "silhouette": "within three pixels of an edge of the object, or between two surfaces",
    "penumbra": "the area lights' light arrives in part",
    "umbra": "less than 1 % of the area lights' light arrives",
    "face-corner": "within 10° of a corner of the cube map",
    "face-edge": "within 5° of an edge of the cube map, corners apart",
    "grazing": "n · v below 0.3",
    "face-centre": "within 15° of the centre of a cube face, to compare with",
    "unshadowed": "more than 99 % of the area lights' light arrives",
}
#: (name, what it says, number, CSS colour) of the table's rows.
ROWS = tuple((name, SAYS[name], number, f"rgb{REGIONS[number]}") for number, name in enumerate(ORDER, 1))
SERIES = (("rel_rmse", "relative RMSE"), ("rel_bias", "relative bias"))


@dataclass(frozen=True)
class Bar:
    """A bin, in SVG units: its extent, its middle, its value, its interval; and the same in words."""

    x0: float
    x1: float
    middle: float
    y: float
    low: float
    high: float
    says: str


@dataclass(frozen=True)
class Plot:
    """ticks: (SVG position, label). series: (metric, name, bars). zero: height of the zero line."""

    label: str
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    series: tuple[tuple[str, str, tuple[Bar, ...]], ...]
    zero: float


def worst(cell: Mapping) -> dict[str, object] | None:
    """The region where the error is densest: {"name", "part": of the object's pixels, "share": of its squared error, "times":
    one over the other}; None where none stands out of its interval."""
    pixels, found = cell.get("mask_pixels") or 0, None
    for name, region in (cell.get("regions") or {}).items():
        part, share = region["pixels"] / pixels if pixels else 0.0, region["share"]
        if part >= LEAST_PART and share["ci95"][0] > part and (found is None or share["value"] / part > found["times"]):
            found = {"name": name, "part": part, "share": share, "times": share["value"] / part, "region": region}
    return found


def plots(cell: Mapping) -> list[Plot]:
    """The curves of a cell."""
    curves = cell.get("curves") or {}
    return [plot(TITLES[name], curves[name]["bins"]) for name in TITLES if curves.get(name, {}).get("bins")]


def plot(label: str, bins: Iterable[Mapping]) -> Plot:
    """Relative RMSE and bias of bins against what the bins are of. The ends of the plot follow the values: an interval of a few
    pixels may leave it."""
    bins = list(bins)
    values = [b[name]["value"] for b in bins for name, _ in SERIES if b[name]["value"] is not None]
    low, high = min([0.0, *values]), max([0.0, *values])
    step = _step(high - low)
    low = step * math.floor(low / step)
    high = max(step * math.ceil(high / step), low + step)
    first, last = min(b["edges"][0] for b in bins), max(b["edges"][1] for b in bins)

    def x(value: float) -> float:
        return round(LEFT + (WIDTH - LEFT - RIGHT) * (value - first) / (last - first), 1)

    def y(value: float | None, otherwise: float) -> float:
        value = otherwise if value is None else min(max(value, low), high)
        return round(TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / (high - low), 1)

    def bar(b: Mapping, name: str, words: str) -> Bar:
        (x0, x1), (lo, hi) = b["edges"], b[name]["ci95"]
        says = (
            f"{x0:.3g} to {x1:.3g}, {b['pixels']} pixels: {words} {_percent(b[name]['value'])} ({_percent(lo)} to {_percent(hi)})"
        )
        return Bar(x(x0), x(x1), x((x0 + x1) / 2), y(b[name]["value"], 0.0), y(lo, low), y(hi, high), says)

    lines = range(round(low / step), round(high / step) + 1)
    stride = _step(last - first)
    return Plot(
        label,
        tuple((x(k * stride), f"{k * stride:g}") for k in range(math.ceil(first / stride), math.floor(last / stride + 1e-9) + 1)),
        tuple((y(k * step, 0.0), f"{100 * k * step:g} %".replace("-", "−")) for k in lines),
        tuple((name, words, tuple(bar(b, name, words) for b in bins if b[name]["value"] is not None)) for name, words in SERIES),
        y(0.0, 0.0),
    )


def _percent(value: float | None) -> str:
    return "∞" if value is None else f"{100 * value:.3g} %".replace("-", "−")


def _step(extent: float) -> float:
    """1, 2 or 5 × 10ⁿ, three to seven of which make up an extent."""
    if not extent > 0:
        return 0.01
    power = 10.0 ** math.floor(math.log10(extent / 3))
    return next(m * power for m in (1, 2, 5, 10) if extent / (m * power) <= 7)
