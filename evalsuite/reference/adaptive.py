"""How many samples each pixel takes, so that no pixel's standard error is above a limit.

Uniform sampling goes on until its noisiest pixel suffices, and all others with it. Here a few first passes, a look, tell how
noisy each pixel is, and are given up; fresh passes then have as many samples in a pixel as it needs, one number for all of them.
What is reported is not what decided how much to sample: it has no bias, and its passes stay independent and alike, so standard
error, skew and halves are formed as ever. Adding the look's samples with their weights, or sampling on where a noisy pixel is
seen, would find too little light where few samples find much (docs/adaptive.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evalsuite.reference import passes
from evalsuite.reference.passes import MIN_PASSES, RenderState, standard_error

#: Samples of a pixel in a pass: squares, as multi-jittering likes them, about a factor of two apart.
COUNTS = np.array([2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64]) ** 2
#: The fewest that a pixel of the mask has: what a look finds without noise may have escaped it.
LEAST = 9
#: Passes that a plan may have, for the cheapest of them to be taken, as counts are rounded up. Few, as samples of one pass are
#: stratified against each other; with fewer, chance makes a pixel of thousands seem twice as noisy as it is.
PASSES = range(2 * MIN_PASSES, 3 * MIN_PASSES + 1, 2)
#: Part of the planned samples that another look has, and how many looks there are at most.
LOOK, LOOKS = 8, 3
#: What is aimed at, of the worst error asked for: noise that few samples find looks smaller to few samples, and the worst of many
#: estimates is one of those too large.
AIM = 0.7
#: A part of the pixels may be noisier than asked for, so that no single sample that found a lamp decides.
ABOVE = 1e-3


@dataclass(frozen=True, eq=False)
class Goal:
    """worst_error: relative standard error of the worst pixel. target_error, cap: as for uniform sampling, the cap in samples
    per pixel on average. mask: (H, W), where errors count."""

    worst_error: float
    target_error: float
    cap: int
    mask: NDArray[np.bool_]


def worst_error(state: RenderState, mask: NDArray[np.bool_]) -> float:
    """Standard error, over the mean radiance in `mask`, that one pixel in a thousand there exceeds (of fewer than a thousand the
    largest), each with its noisiest channel; pooled (`passes.standard_error`). 0 for a black picture or an empty mask."""
    mean = state.mean[mask].astype(np.float64)
    if mean.size == 0 or mean.mean() == 0.0:
        return 0.0
    return float(_worst(standard_error(state, mask)[mask].max(axis=1)) / abs(mean.mean()))


def samples(state: RenderState) -> NDArray[np.float32]:
    """Samples of each pixel so far, (H, W)."""
    return np.broadcast_to(state.passes * np.float32(state.pass_spp), state.even.shape[:2]).copy()


def facts(state: RenderState, mask: NDArray[np.bool_], asked: float | None) -> dict[str, float]:
    """Of a finished reference: spp_max, the most samples that a pixel has, and reached_worst_error; nothing where none was asked
    for."""
    if asked is None:
        return {}
    return {"spp_max": int(samples(state).max()), "reached_worst_error": worst_error(state, mask)}


def more(state: RenderState, goal: Goal) -> int:
    """How many passes to render next; 0 when done. The passes that were planned, then on until the mean standard error
    suffices: no single pixel decides that."""
    if not state.planned:
        return MIN_PASSES - state.passes
    left = state.planned - state.passes
    return left if left > 0 else passes.plan(state, goal.target_error, goal.cap, goal.mask)


def onward(state: RenderState, goal: Goal) -> RenderState:
    """What follows a finished look: a state without passes, another look or the reference itself. Else the state as it is."""
    if state.planned or state.passes < MIN_PASSES:
        return state
    wanted = needed(state, goal)
    counts, planned = shared(wanted, PASSES, goal)
    if state.look + 1 < LOOKS and planned * counts.sum() > 2 * LOOK * state.passes * state.pass_samples:
        counts, _ = shared(wanted / LOOK, (MIN_PASSES,), goal)
        return passes.instead(state, counts, state.look + 1)
    return passes.instead(state, counts, state.look + 1, planned)


def needed(state: RenderState, goal: Goal) -> NDArray[np.float64]:
    """Samples (H, W) of each pixel for both errors of the goal, 0 outside the mask. As if samples were independent, which asks
    for too many where stratification helps: another look, at nearly the final counts, knows better."""
    mask = goal.mask
    level = abs(state.mean[mask].astype(np.float64).mean()) if mask.any() else 0.0
    if level == 0.0:
        return np.zeros(mask.shape)
    samples = np.broadcast_to(state.pass_spp, mask.shape) * float(state.passes)
    error = standard_error(state, mask).astype(np.float64) * np.sqrt(samples)[..., None] / level
    error[~mask] = 0.0
    # The noisiest of the neighbours: what one of them saw, the others may only have missed.
    worst = ndimage.maximum_filter(error.max(axis=2), 3)
    for_worst = (np.minimum(worst, _worst(worst[mask])) / (AIM * goal.worst_error)) ** 2
    # The mean error of a number of samples is the least with a share of error^(2/3) for each pixel. Half of what independent
    # samples need: stratified ones may do, and else `more` makes up for it.
    share = error.mean(axis=2) ** (2 / 3)
    for_mean = 0.5 * share * (share[mask].mean() / goal.target_error) ** 2
    return np.where(mask, np.maximum(for_worst, for_mean), 0.0)


def shared(wanted: NDArray[np.float64], numbers: range | tuple[int, ...], goal: Goal) -> tuple[NDArray[np.int32], int]:
    """Samples (H, W) of each pixel in a pass, and how many passes: as few samples in all as `numbers` of passes allow, and no
    more than the cap, for which all pixels give up the same part."""
    least = np.where(goal.mask, LEAST if LEAST * numbers[0] <= goal.cap else COUNTS[0], COUNTS[0])

    def counts(number: int) -> NDArray[np.int32]:
        rung = np.searchsorted(COUNTS, wanted / number * (1.0 - 1e-12))
        return np.maximum(COUNTS[np.minimum(rung, len(COUNTS) - 1)], least).astype(np.int32)

    while True:
        passes_ = min(numbers, key=lambda number: number * counts(number).sum(dtype=np.int64))
        found = counts(passes_)
        # Beyond the highest count only passes help.
        passes_ = max(passes_, 2 * int(np.ceil((wanted / found).max() / 2)))
        over = passes_ * found.sum(dtype=np.int64) / (goal.cap * float(wanted.size))
        if over <= 1.0:
            return found, passes_
        if (found <= least).all():
            return found, max(2 * int(passes_ / over / 2), MIN_PASSES)
        wanted = wanted * min(0.95, 1.0 / over)


def _worst(values: NDArray[np.float64]) -> float:
    return float(np.quantile(values, 1.0 - ABOVE, method="higher"))
