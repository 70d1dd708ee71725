"""To whom a budget's time is given: of references sampled to one of several errors, those that gain most together.

A pair of techniques decided counts 1, an interval narrowed by all of its value `NARROWER`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from evalsuite.rounds import OF_TWO

NARROWER = 0.05
#: Part of the time left that one batch of references is begun for.
BATCH = 0.6
#: Standard deviations within which a difference at the confidence `OF_TWO` is undecided.
SIGMAS = float(norm.ppf(0.5 + OF_TWO / 2))


@dataclass(frozen=True)
class Offer:
    """A relative standard error that a group could be sampled to. cap: samples a pixel at most. seconds: foretold."""

    error: float
    cap: int
    seconds: float


@dataclass(frozen=True)
class Group:
    """Cells, by index, that share a reference, as a pilot saw them. error: relative standard error of that reference. pairs: of
    those undecided, difference and standard deviation. widths: of each cell, half of the interval of `rel_rmse` over its value, 1
    at most. offers: what could be made of it."""

    name: str
    cells: tuple[int, ...]
    error: float
    pairs: tuple[tuple[float, float], ...] = ()
    widths: tuple[float, ...] = ()
    offers: tuple[Offer, ...] = ()

    def decided(self, error: float) -> float:
        """How many of the undecided pairs a fresh reference of that error is expected to decide.

        The true difference is about the pilot's, d ± σ, and the fresh one about the true one, ± σ′; it decides where it exceeds
        `SIGMAS` σ′."""
        if not self.pairs:
            return 0.0
        difference, sigma = np.array(self.pairs).T
        fresh = sigma * error / self.error
        both = np.hypot(sigma, fresh)
        return float(sum(norm.cdf((side * difference - SIGMAS * fresh) / both).sum() for side in (1, -1)))

    def gain(self, error: float) -> float:
        return self.decided(error) + NARROWER * sum(self.widths) * max(1 - error / self.error, 0.0)

    def why(self, error: float) -> str:
        expected = self.decided(error)
        if expected >= NARROWER:
            return f"expected to decide {expected:.1f} of {len(self.pairs)} undecided"
        return f"intervals of ±{max(self.widths, default=0.0):.0%} of the value"


def allot(offers: Sequence[Sequence[tuple[float, float]]], seconds: float, steps: int = 2000) -> list[int | None]:
    """Which of each group's offers (seconds, gain) to take, one at most, so that their gains add up to the most that fits into
    `seconds`: the knapsack with a choice of each, exact but for seconds rounded up to a `steps`th of all."""
    best, taken = np.zeros(steps + 1), []
    for group in offers:
        above, choice = best.copy(), np.full(steps + 1, -1)
        for k, (cost, gain) in enumerate(group):
            needed = math.ceil(cost / seconds * steps - 1e-9) if seconds > 0 else steps + 1
            if needed <= steps:
                found = best[: steps + 1 - needed] + gain
                better = found > above[needed:]
                above[needed:][better], choice[needed:][better] = found[better], k
        best = above
        taken.append(choice)
    left, chosen = steps, []
    for group, choice in zip(reversed(offers), reversed(taken), strict=True):
        k = int(choice[left])
        chosen.append(None if k < 0 else k)
        left -= 0 if k < 0 else math.ceil(group[k][0] / seconds * steps - 1e-9)
    return chosen[::-1]


def best(groups: Sequence[Group], seconds: float) -> list[tuple[Group, Offer]]:
    """The next batch of what to make within `seconds`: of the best allotment those that gain most a second."""
    offers = [[(offer.seconds, group.gain(offer.error)) for offer in group.offers] for group in groups]
    chosen = allot(offers, seconds)
    jobs = [(group, group.offers[k]) for group, k in zip(groups, chosen, strict=True) if k is not None]
    jobs.sort(key=lambda job: job[0].gain(job[1].error) / job[1].seconds, reverse=True)
    sums = np.cumsum([offer.seconds for _, offer in jobs])
    return jobs[: max(1, int(np.searchsorted(sums, BATCH * seconds, "right")))]
