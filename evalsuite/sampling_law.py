"""How many samples a reference takes for an error, and how long that takes, from references of earlier runs.

A pass of n samples a pixel has a relative standard error E(n). Passes are independent, so k of them have E(n)/√k. A pass's own
samples are stratified: E(4n) = E(n) 4^−q, where q is 1/2 for independent samples and nearly 1 in smooth lighting, and the nearer
to 1/2 the longer the passes are; the less noise a picture has the nearer to 1, since what is smooth is stratified well. The
renderer climbs to longer passes where that saves samples (`passes.rung`); how many it takes is found by following it there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Self

import numpy as np

from evalsuite.plan import NEAR_FIELD
from evalsuite.reference.passes import LOOK, MIN_PASSES, RUNGS, rung_for

#: How a reference is told apart, from most alike to any.
ALIKE = (("scene", "environment", "target", "bsdf"), ("scene", "environment", "target"), ("scene", "target"), ("target",), ())
#: q from the shortest passes to the next, taken for granted: GRANTED_Q − FALL ln E of these passes (a correlation of −0.57), and
#: its standard deviation about that; and what is left of q − 1/2 from rung to rung. Of 35 built-in references in 64².
GRANTED_Q, FALL, SPREAD_Q, LEFT = 0.43, 0.117, 0.12, 0.7
#: Seconds taken for granted as far as no reference says otherwise: of a rung's first pass (its kernel is compiled), of any pass,
#: of a sample; and how many times that where light is followed from surface to surface.
GRANTED_S = (0.25, 0.01, 0.08e-6)
BOUNCING = 5.0
#: Weight of what is granted beside one reference: short references hardly tell what of them a kernel, a pass and a sample took.
DRAWN = 2.0


@dataclass(frozen=True)
class Effort:
    """What a reference takes. spp: samples a pixel of its result; drawn: with those of the rungs below, given up; passes, rungs:
    of all."""

    spp: int
    drawn: int
    passes: int
    rungs: int


def effort(pass_errors: Mapping[int, float], q: float, error: float, cap: int, pixels: int) -> Effort:
    """What a reference of `pixels` takes for a relative standard error, at most `cap` samples a pixel. pass_errors: that of a
    pass by its samples a pixel, of one rung at least. q: of the first step."""
    errors = _on_all(pass_errors, q)
    drawn = passes = 0
    rungs, rung = 1, RUNGS[0]
    while (higher := rung_for(rung, needed := (errors[rung] / error) ** 2, pixels, cap)) > rung:
        rungs, drawn, passes, rung = rungs + 1, drawn + LOOK * rung, passes + LOOK, higher
    most = max(cap // rung, 2)
    count = max(min(2 * math.ceil(needed / 2), most), min(MIN_PASSES, most))
    return Effort(count * rung, drawn + count * rung, passes + count, rungs)


def _on_all(pass_errors: Mapping[int, float], q: float) -> dict[int, float]:
    """Errors of passes on all rungs: those known, the rest from their neighbours."""
    found = dict(pass_errors)
    ratios = [4 ** -(0.5 + (q - 0.5) * LEFT**step) for step in range(len(RUNGS) - 1)]
    for low, high, ratio in zip(RUNGS, RUNGS[1:], ratios, strict=False):
        if low in found:
            found.setdefault(high, found[low] * ratio)
    for low, high, ratio in reversed(list(zip(RUNGS, RUNGS[1:], ratios, strict=False))):
        found.setdefault(low, found[high] / ratio)
    return found


@dataclass(frozen=True)
class Law:
    """rows: references rendered, as `store.costs` keeps them. shift, spread: what exponents are beyond `granted_q`, and their
    standard deviation. start, step: seconds of a rung and of a pass; rates: of a sample, by `_kinds`."""

    rows: Sequence[Mapping]
    shift: float
    spread: float
    start: float
    step: float
    rates: Mapping[tuple, float]

    @classmethod
    def of(cls, rows: Sequence[Mapping]) -> Self:
        known = [errors_of(row) for row in rows]
        beyond = [slope - granted_q(errors) for errors in known if (slope := _slope(errors)) is not None]
        shift = sum(beyond) / (len(beyond) + 3)  # three references' worth of what is granted
        spread = max(SPREAD_Q, math.sqrt(sum((one - shift) ** 2 for one in beyond) / max(len(beyond), 1)))
        return cls(rows, shift, spread, *_seconds(rows))

    def reference(self, like: Mapping, pixels: int, error: float, cap: int, sigmas: float = 0.0) -> tuple[float, float]:
        """Samples a pixel, and seconds, of a reference. sigmas: that many standard deviations above what is expected."""
        rows = _alike(self.rows, like)
        known = [errors_of(row) for row in rows] or [{RUNGS[0]: 0.0}]
        if all(row.get(key) == like[key] for row in rows for key in ALIKE[0]):
            known = [errors for errors in known if len(errors) == max(map(len, known))]  # the same one: who climbed tells most
        found = [self.effort(errors, pixels, error, cap, sigmas) for errors in known]
        return median(one.spp for one in found), median(self.seconds(one, like, pixels) for one in found)

    def effort(self, errors: Mapping[int, float], pixels: int, error: float, cap: int, sigmas: float = 0.0) -> Effort:
        """As `effort`, with the exponent that these pass errors show, else the law's."""
        own = _slope(errors)
        q = granted_q(errors) + self.shift if own is None else own
        return effort(errors, q - sigmas * self.spread, error, cap, pixels)

    def seconds(self, one: Effort, like: Mapping, pixels: int) -> float:
        """Seconds of rendering."""
        rate = next(self.rates[kind] for kind in reversed(_kinds(like)) if kind in self.rates)
        return self.start * one.rungs + self.step * one.passes + rate * one.drawn * pixels


@dataclass(frozen=True)
class WorstPixel:
    """The same of references whose worst pixel decides (`reference.adaptive`). rows: of such references. worst_error: asked for.

    Each pixel takes samples in proportion to its variance, so that all of them go as 1/ε²; plans are by powers of four and know
    a variance to a quarter, hence a factor of 1.5 for a standard deviation."""

    rows: Sequence[Mapping]
    worst_error: float

    def reference(self, like: Mapping, pixels: int, error: float, cap: int, sigmas: float = 0.0) -> tuple[float, float]:
        """As `Law.reference`; error has no say."""
        rows = _alike(self.rows, like)
        times = [(row["worst_error"] / self.worst_error) ** 2 * 1.5**sigmas for row in rows]
        seconds = [row["seconds"] * time * pixels / row["pixels"] for row, time in zip(rows, times, strict=True)]
        return min(median(row["spp"] * time for row, time in zip(rows, times, strict=True)), cap), median(seconds)


def errors_of(row: Mapping) -> dict[int, float]:
    """Relative standard error of a pass by its samples a pixel, as far as a reference's facts tell: of each of its rungs, or, of
    one that does not say, of the rung that it must have been on."""
    found = row.get("pass_errors")
    if isinstance(found, dict) and found and all(str(n).isdigit() and int(n) in RUNGS and _real(e) for n, e in found.items()):
        return {int(n): float(error) for n, error in found.items()}
    rung = max((n for n in RUNGS if n * MIN_PASSES <= row["spp"]), default=RUNGS[0])
    return {rung: row["reached_error"] * math.sqrt(row["spp"] / rung)}


def granted_q(errors: Mapping[int, float]) -> float:
    """q of the first step, taken for granted of a reference with these errors of passes; between 1/2 and 1."""
    first = _on_all(errors, 0.7)[RUNGS[0]]
    return min(max(GRANTED_Q - FALL * math.log(first), 0.5), 1.0) if first > 0 else 1.0


def _real(value: object) -> bool:
    return isinstance(value, int | float) and 0 <= value < math.inf


def _slope(errors: Mapping[int, float]) -> float | None:
    """q of the first step, from the two longest rungs that are known; None without two."""
    known = [step for step, rung in enumerate(RUNGS) if errors.get(rung, 0.0) > 0]
    if len(known) < 2:
        return None
    low, high = known[-2:]
    q = min(max(math.log(errors[RUNGS[low]] / errors[RUNGS[high]], 4) / (high - low), 0.5), 1.0)  # of a step there, on average
    return min(0.5 + (q - 0.5) * (high - low) / sum(LEFT**step for step in range(low, high)), 1.0)


def _alike(known: Sequence[Mapping], like: Mapping) -> list[Mapping]:
    for keys in ALIKE:
        found = [row for row in known if all(row.get(key) == like[key] for key in keys)]
        if found:
            return found
    return []


def _drawn(row: Mapping) -> tuple[int, int, float]:
    """Rungs, passes and samples a pixel of a row, with those given up."""
    rungs = sorted(errors_of(row))
    below = rungs[:-1]
    return len(rungs), LOOK * len(below) + row["spp"] // rungs[-1], row["spp"] + LOOK * sum(below)


def _kinds(like: Mapping) -> list[tuple]:
    """What a sample's time depends on, from any to most alike."""
    target, scene = like.get("target"), like.get("scene")
    return [(), (target,), (target, scene)]


def _bounces(kind: tuple) -> float:
    """How many times as long as any sample one of this kind is granted."""
    return BOUNCING if kind and kind[0] in ("path", NEAR_FIELD) else 1.0


def _granted(rungs: int, passes: int, samples: float, like: Mapping) -> float:
    return GRANTED_S[0] * rungs + GRANTED_S[1] * passes + GRANTED_S[2] * samples * _bounces(_kinds(like)[1])


def _seconds(rows: Sequence[Mapping]) -> tuple[float, float, dict[tuple, float]]:
    """Seconds of a rung, of a pass, and of a sample by `_kinds`: least squares of relative errors. A rate is drawn to that of its
    kind, the rate of all and the rest to what is granted."""
    from scipy.optimize import nnls

    kinds = sorted({kind for row in rows for kind in _kinds(row)} | {()}, key=lambda kind: (len(kind), str(kind)))
    place = {kind: 2 + k for k, kind in enumerate(kinds)}
    # As fast as this machine was: a run's other work slows all of a reference alike.
    taken = [(row, *_drawn(row)) for row in rows if row["seconds"] > 0]
    slow = [row["seconds"] / _granted(rungs, passes, drawn * row["pixels"], row) for row, rungs, passes, drawn in taken]
    granted = np.array([*GRANTED_S[:2], *(GRANTED_S[2] * _bounces(kind) for kind in kinds)]) * (median(slow) if slow else 1.0)
    lines, aims = list(DRAWN * np.diag(1 / granted)), [DRAWN] * 3 + [0.0] * (len(kinds) - 1)
    for kind in kinds[1:]:
        lines[place[kind]][place[kind[:-1]]] = -DRAWN / granted[place[kind[:-1]]]
    for row, rungs, passes, drawn in taken:
        line = np.zeros(len(granted))
        line[:2], line[place[_kinds(row)[-1]]] = (rungs, passes), drawn * row["pixels"]
        lines.append(line / row["seconds"])
        aims.append(1.0)
    found = nnls(np.array(lines), np.array(aims))[0]
    return float(found[0]), float(found[1]), {kind: float(found[place[kind]]) for kind in kinds}
