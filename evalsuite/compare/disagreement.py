"""The pixels behind a rank flip: how the squared errors of two pictures are spread, and who is nearer to the truth where."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from evalsuite.compare.statistics import DRAWS, Metric, extrapolated
from evalsuite.compare.unified import Z95

Float = NDArray[np.float64]

#: The worst part of the pixels whose share of the squared error is told, and the share whose pixels are counted.
WORST, MOST = 0.01, 0.8
#: Bright or dark is what differs from the mean of the object by this factor.
CONTRAST = 1.5


def nearer(a: Float, b: Float, reference: Float) -> Float:
    """(…) |a − R| − |b − R| of (…, 3) pictures, mean over the channels, radiance: negative where a is nearer to the truth."""
    return (np.abs(a - reference) - np.abs(b - reference)).mean(axis=-1)


def behind(a: Float, b: Float, reference: Float, sigma: Float) -> dict[str, object]:
    """Facts about two pictures (P, 3) against their reference, whose standard error is sigma, over the pixels scored.

    For each of `a`, `b`: worst_share, of the squared error in the worst 1 % of the pixels; most_pixels, the part of the pixels
    that holds 80 % of it; brightness, the mean reference in those over the mean of all. And a_nearer, the part of the pixels
    where a is nearer to the truth, and a_excess, the part of the pixels that holds 80 % of the squared error by which a is worse
    where it is worse. Values as measured, intervals as `statistics.percentile` makes them: the reference's noise drawn anew."""
    names = [f"{side}.{fact}" for side in "ab" for fact in ("worst_share", "most_pixels", "brightness")]

    def facts(truth: Float) -> Float:
        squares = [np.square(p - truth).mean(axis=-1) for p in (a, b)]
        return np.array([*_spread(squares[0], truth), *_spread(squares[1], truth), np.mean(nearer(a, b, truth) < 0),
                         _part(np.maximum(squares[0] - squares[1], 0.0))])  # fmt: skip

    # A part of so many pixels is known to half a pixel at best.
    grain = 0.5 / len(reference)
    found = [
        fact if name.endswith("brightness") else Metric(fact.value, (fact.ci95[0] - grain, fact.ci95[1] + grain)).within(0.0, 1.0)
        for name, fact in zip([*names, "a_nearer", "a_excess"], _with_intervals(facts, reference, sigma), strict=True)
    ]
    sides: dict[str, dict] = {"a": {}, "b": {}}
    for name, fact in zip(names, found, strict=False):
        sides[name[0]][name[2:]] = fact.to_json()
    return {**sides, "a_nearer": found[-2].to_json(), "a_excess": found[-1].to_json(), "pixels": len(reference)}


def _spread(squares: Float, truth: Float) -> tuple[float, float, float]:
    order = np.argsort(-squares)
    total = squares.sum()
    if total == 0:
        return 0.0, 0.0, 1.0
    worst = max(1, round(WORST * len(squares)))
    most = int(np.searchsorted(np.cumsum(squares[order]), MOST * total)) + 1
    mean = truth.mean()
    there = float(truth[order[:most]].mean() / mean) if mean > 0 else 1.0
    return float(squares[order[:worst]].sum() / total), most / len(squares), there


def _part(values: Float) -> float:
    total = values.sum()
    most = int(np.searchsorted(np.cumsum(-np.sort(-values)), MOST * total)) + 1
    return most / len(values) if total > 0 else 0.0


def _with_intervals(facts: Callable[[Float], Float], reference: Float, sigma: Float) -> list[Metric]:
    values = facts(reference)
    if not sigma.any():
        return [Metric(float(v), (float(v), float(v))) for v in values]
    generator = np.random.default_rng(0)
    noise = [sigma * generator.standard_normal(len(sigma))[:, None] for _ in range(DRAWS)]
    plus, minus = (np.array([facts(reference + sign * n) for n in noise]) for sign in (1, -1))
    spread = np.sqrt(np.square(plus - minus).mean(0)) / 2 * float(stdtrit(DRAWS, 0.975)) / Z95
    bend = ((plus + minus) / 2).std(0)
    found = []
    for k, value in enumerate(values):
        one = (np.array([v]) for v in (value, plus[:, k].mean(), minus[:, k].mean()))
        found.append(extrapolated(*one, 1.0, float(spread[k]), float(bend[k])).within(0.0))
    return found


def sentence(flip: dict) -> str:
    """A flip and the pixels behind it in words, A and B standing for its two pictures."""
    facts = flip["pixels"]

    def prefer(metrics: list[str], side: str) -> str:
        return f"{', '.join(metrics)} {'prefers' if len(metrics) == 1 else 'prefer'} {side} ({flip[f'{side.lower()}_name']})"

    def where(fact: dict) -> str:
        brightness = fact["brightness"]["value"]
        words = "highlights, " if brightness > CONTRAST else "dark parts, " if brightness < 1 / CONTRAST else ""
        return (
            f"80 % in {_percent(fact['most_pixels']['value'])} of the pixels ({words}{brightness:.2g} times as bright as the "
            f"object's mean) and {_percent(fact['worst_share']['value'])} in the worst 1 %"
        )

    return (
        f"{prefer(flip['prefer_a'], 'A')}; {prefer(flip['prefer_b'], 'B')}. Of A's squared error {where(facts['a'])}; of B's "
        f"{where(facts['b'])}. A is nearer to the truth in {_percent(facts['a_nearer']['value'])} of the pixels."
    )


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %" if value < 0.995 else "100 %"
