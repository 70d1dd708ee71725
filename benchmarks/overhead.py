"""The suite's wall time over what bare Mitsuba needs for the same references: scenes, integrators, sizes and samples per pixel.

A run of cells of the accuracy report into an empty store is timed as a command, with all that it does: starting, drawing, the
ledger, comparing, the page. Bare is the time inside `integrator.render` alone, with scenes loaded and nothing but the picture
kept, up to 1024 samples a pixel at a time. Dr.Jit's kernels are compiled before, by a run of the same cells at draft quality.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks import timing
from benchmarks.command import evalsuite
from benchmarks.figure import Figure, Limit, NotMeasured
from evalsuite import plan
from evalsuite.execute.local import Lane, Workers
from evalsuite.pipeline import Run, Settings, run_cells
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import Store

TITLE = "The suite over bare `mi.render`"
CHOICE = plan.Choice(scenes=("still-life", "organic"), techniques=("diffuse-sh9",), targets=("path",))
A_CALL = (1024, 256, 64, 16)  # samples per pixel of a call: as our longest passes have; none was quicker


def measure(quick: bool) -> list[Figure]:
    """Cells with shadows and interreflection, whose ledgers need two more references each: 256² at the standard 0.5 %, minutes of
    rendering; quick: 128² at 1 %, about one minute."""
    error, size, rounds = (0.01, (128, 128), 2) if quick else (plan.QUALITY["standard"][0], None, 3)
    words = ["run", "accuracy", *_options("--scene", CHOICE.scenes), *_options("-t", CHOICE.techniques)]
    words += [*_options("--target", CHOICE.targets), *(("--size", "128x128") if size else ())]
    ours, theirs = [], []
    with tempfile.TemporaryDirectory() as place:
        evalsuite([*words, "--quality", "draft", "--out", f"{place}/draft"], Path(place, "draft-store"))
        for number in range(rounds):
            store, out = Path(place, f"store-{number}"), Path(place, f"out-{number}")
            command = [*words, "--target-error", str(error), "--out", str(out)]
            ours.append(timing.seconds(lambda c=command, s=store: evalsuite(c, s)))
            asked = references(store, error, size)
            theirs.append(bare(asked))
            cells = json.loads((out / "results.json").read_text())["cells"]
    if not all(cell["status"] == "scored" for cell in cells):
        raise NotMeasured("a cell was not scored")
    value, ci95 = timing.ratio(ours, theirs)
    what = f"{len(cells)} cells, {len(asked)} references to {error:.1%}: the run over bare rendering"
    beside = f"{timing.typical(ours)}; bare {timing.typical(theirs)}, {sum(spp for *_, spp in asked)} samples a pixel in all"
    return [Figure(what, value, ci95, rounds, "×", Limit(1.15), beside)]


def _options(name: str, values: Sequence[str]) -> list[str]:
    return [word for value in values for word in (name, value)]


class _Noting(Run):
    """A run that notes each reference that its cells ask for: key → (scene, target, decomposition, samples per pixel)."""

    def reference(self, source, target, seed=0, decomposition=None):
        found = super().reference(source, target, seed, decomposition)
        if not found[2]:
            raise NotMeasured(f"the reference of {source.path.stem}, {target}, is not the run's")
        self.noted[found[3]] = (source, target, decomposition, found[1]["spp"])
        return found


def references(store: Path, error: float, size: tuple[int, int] | None) -> list[tuple]:
    """What a finished run has rendered, out of its store."""
    with Workers(jobs=1) as workers:
        run = _Noting(Store(store), workers, Settings(error, plan.usual_cap(error), size))
        run.noted = {}
        run_cells(run, plan.plan(plan.load_report("accuracy"), CHOICE))
        return list(run.noted.values())


def bare(asked: Sequence[tuple]) -> float:
    """Seconds of rendering them all in one fresh process, one after another."""
    lane = Lane("bare")
    try:
        return sum(lane.call("benchmarks.overhead:render", *one) for one in asked)
    finally:
        lane.close()


def render(source: SceneSource, target: str, decomposition: object, spp: int) -> float:
    """Seconds inside Mitsuba for one reference. In a worker process."""
    import numpy as np

    from evalsuite.reference import render as ours
    from evalsuite.reference.integrators import TARGETS, integrator

    loaded = ours.load_cached(source, TARGETS[target].within_room)
    chosen = integrator(target, loaded.scene.environment, decomposition)
    calls = []
    for a_call in A_CALL:
        calls += [a_call] * (spp // a_call)
        spp %= a_call
    return timing.seconds(lambda: [np.array(chosen.render(loaded.mitsuba, 0, seed=k, spp=n)) for k, n in enumerate(calls)])
