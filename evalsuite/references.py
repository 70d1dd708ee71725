"""A reference in rounds: render a few passes, look at the error, go on.

Which passes a round has does not depend on who renders them, and they are added in order: one worker and many find the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.execute.local import Pool
from evalsuite.reference import adaptive, passes
from evalsuite.reference.passes import RenderState
from evalsuite.scene.model import SceneSource

#: Passes between two looks at the error, which is also how much work a killed run can lose: a few seconds.
PASSES_PER_ROUND = 16
#: Samples that a worker should at least be given at a time: a tenth of a second of a core, fifty times what sending takes.
CHUNK_SAMPLES = 2**20
#: Chunks of a round for each of several workers: one that is done takes from what another has not begun.
PARTS = 2


def sampled(
    workers: Pool,
    source: SceneSource,
    size: tuple[int, int],
    plan: Mapping,
    mask: NDArray[np.bool_],
    partial: Path,
    tell: Callable[[RenderState, float], None],
) -> tuple[RenderState, float]:
    """A finished reference, and the relative standard error that it reached.

    size: (width, height). plan: target, target_error, cap [samples per pixel], seed, decomposition where the target has one, and
    worst_error where the pixels are to differ in their samples (`reference.adaptive`). mask: (H, W), where the error counts.
    partial: file of what a run before left half done, kept up to date here. tell: called after each round, with the error so far.
    Raises WorkerFailed and what `reference.render.passes` does."""
    more, onward = _steering(plan, mask)
    state = passes.load_state(partial, plan["seed"]) or passes.blank(size, plan["seed"])
    while count := more(state):
        state = _rendered(workers, source, plan, state, min(count, PASSES_PER_ROUND))
        tell(state, passes.relative_error(state, mask))
        state = onward(state)
        passes.save_state(state, partial)
    return state, passes.relative_error(state, mask)


def _steering(
    plan: Mapping, mask: NDArray[np.bool_]
) -> tuple[Callable[[RenderState], int], Callable[[RenderState], RenderState]]:
    """How many passes to render next, and whether to go on with another state than the one they made."""
    if "worst_error" in plan:
        goal = adaptive.Goal(plan["worst_error"], plan["target_error"], plan["cap"], mask)
        return lambda state: adaptive.more(state, goal), lambda state: adaptive.onward(state, goal)
    uniform = plan["target_error"], plan["cap"], mask

    def climbed(state: RenderState) -> RenderState:
        rung = passes.rung(state, *uniform)
        return state if rung == state.pass_spp else passes.instead(state, rung)

    return lambda state: passes.plan(state, *uniform), climbed


def _rendered(workers: Pool, source: SceneSource, plan: Mapping, state: RenderState, count: int) -> RenderState:
    """The state after `count` more passes, shared out among the workers."""
    least = -(-CHUNK_SAMPLES // state.pass_samples)
    parts = 1 if workers.width == 1 else PARTS * workers.width
    share = max(-(-count // parts), min(least, count))
    ends = range(state.passes, state.passes + count)
    tasks = []
    for first in ends[::share]:
        numbers = range(first, min(first + share, ends.stop))
        about = source, plan["target"], state.pass_spp, numbers, plan["seed"], plan.get("decomposition"), state.look
        tasks.append(workers.submit("evalsuite.reference.worker:passes", *about))
    for task in tasks:
        state = passes.added(state, *task.result())
    return state
