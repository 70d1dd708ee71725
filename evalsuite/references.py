"""A reference in rounds: render a few passes, look at the error, go on.

Which passes a round has does not depend on who renders them, and they are added in order: one worker and many find the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.execute.local import Pool
from evalsuite.reference import passes
from evalsuite.reference.passes import RenderState
from evalsuite.scene.model import SceneSource

#: Passes between two looks at the error, which is also how much work a killed run can lose: a few seconds.
PASSES_PER_ROUND = 16
#: Samples that a worker should at least be given at a time: a quarter of a second of a core, beside which sending is nothing.
CHUNK_SAMPLES = 2**22


def sampled(
    workers: Pool,
    source: SceneSource,
    size: tuple[int, int],
    plan: Mapping,
    mask: NDArray[np.bool_],
    partial: Path,
    tell: Callable[[RenderState, float], None],
) -> tuple[RenderState, float]:
    """A finished reference, and the relative standard error that it reached. size:
    (width, height). plan: target, target_error, cap [samples per pixel], seed, and decomposition where the target has one. mask:
    (H, W), where the error counts. partial: file of what a run before left half done, kept up to date here. tell: called after
    each round, with the error so far. Raises WorkerFailed and what `reference.render.passes` does."""
    goal = plan["target_error"], plan["cap"], mask
    state = passes.load_state(partial, plan["seed"]) or passes.blank(size, plan["seed"])
    while count := passes.plan(state, *goal):
        state = _rendered(workers, source, plan, state, min(count, PASSES_PER_ROUND))
        tell(state, passes.relative_error(state, mask))
        if passes.climbs(state, *goal):
            state = passes.blank(size, plan["seed"], 4 * state.pass_spp, state.seconds)
        passes.save_state(state, partial)
    return state, passes.relative_error(state, mask)


def _rendered(workers: Pool, source: SceneSource, plan: Mapping, state: RenderState, count: int) -> RenderState:
    """The state after `count` more passes, shared out among the workers."""
    height, width = state.even.shape[:2]
    least = -(-CHUNK_SAMPLES // (width * height * state.pass_spp))
    share = max(-(-count // workers.width), min(least, count))
    ends = range(state.passes, state.passes + count)
    tasks = []
    for first in ends[::share]:
        numbers = range(first, min(first + share, ends.stop))
        about = source, plan["target"], state.pass_spp, numbers, plan["seed"], plan.get("decomposition")
        tasks.append(workers.submit("evalsuite.reference.worker:passes", *about))
    for task in tasks:
        radiance, seconds = task.result()
        state = passes.added(state, radiance, seconds)
    return state
