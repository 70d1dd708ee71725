"""Samples of uniform over samples of adaptive references at equal worst standard error, and the same of their times.

The worst error is not what the references say of themselves: it is measured from the scatter of references with different seeds,
as many for either side, each pixel's variance pooled over its neighbours alike. Adaptive samples include the looks that were
given up. Uniform ones have none, and the pass size, of two, that needs the fewest: their number follows from the scatter of
passes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import timing
from benchmarks.figure import Figure, Limit
from evalsuite import references
from evalsuite.execute.local import Workers
from evalsuite.gpu import registry
from evalsuite.reference import adaptive, passes
from evalsuite.reference.passes import RenderState
from evalsuite.scene import builtin
from evalsuite.scene.model import SUBJECT, SceneSource
from evalsuite.steps import Settings, Steps
from evalsuite.store.cache import Store

TITLE = "Uniform over adaptive samples at equal worst error"
#: Samples per pixel of uniform passes.
UNIFORM = (64, 256)


@dataclass(frozen=True)
class Case:
    """worst_error: asked for. exponent: of a Phong lobe as the subject's material; None: the scene's own. limit: where few pixels
    are far noisier than the others; where all are alike there is nothing to gain, and what is lost is shown."""

    scene: str
    environment: str
    target: str
    worst_error: float
    exponent: float | None = None
    limit: Limit | None = field(default=Limit(3.0, least=True))

    def source(self, size: tuple[int, int]) -> SceneSource:
        technique = registry.find("glossy-phong-map")
        material = technique.target_bsdf(technique.defaults() | {"exponent": self.exponent})
        bindings = {} if self.exponent is None else {SUBJECT: material}
        return SceneSource(builtin.scene_path(self.scene), builtin.environment_path(self.environment), size, bindings)

    def __str__(self) -> str:
        lobe = "" if self.exponent is None else f", Phong {self.exponent:g}"
        return f"{self.scene}, {self.environment}{lobe}, {self.target}"


CASES = (
    Case("sphere", "cathedral", "direct", 0.1, 50.0),
    Case("sphere", "sunsky", "direct", 0.05, 50.0),
    Case("torus", "office", "unoccluded", 0.05, 10.0, None),
    Case("organic", "cathedral", "path", 0.05, None, None),
    Case("still-life", "cathedral", "path", 0.05, None, None),
)


def measure(quick: bool) -> list[Figure]:
    """64², 4 rounds of 8 seeds; quick: 48², 2 rounds of 6."""
    size, rounds, seeds = ((48, 48), 2, 6) if quick else ((64, 64), 4, 8)
    figures = []
    with Workers(jobs=1) as workers, tempfile.TemporaryDirectory() as place:
        for case in CASES:
            figures += _figures(case, size, rounds, seeds, workers, Path(place))
    return figures


def _figures(case: Case, size: tuple[int, int], rounds: int, seeds: int, workers: Workers, place: Path) -> list[Figure]:
    source = case.source(size)
    mask = Steps(Store(place / "store"), workers, Settings()).object_mask(source)
    needs, takes, seconds, theirs, worst = ([] for _ in range(5))
    for number in range(rounds):
        first = number * seeds
        made = [_adaptive(case, source, size, mask, seed, workers, place) for seed in range(first, first + seeds)]
        worst.append(_scatter([state.mean for state, _ in made], mask))
        takes.append(float(np.mean([samples for _, samples in made])))
        seconds.append(float(np.mean([state.seconds for state, _ in made])))
        sides = [_uniform(case, source, size, mask, first, seeds, spp, worst[-1], workers) for spp in UNIFORM]
        best = min(sides)
        needs.append(best[0])
        theirs.append(best[1])
    beside = f"{np.mean(takes):.0f} samples a pixel, uniform {np.mean(needs):.0f}; asked for {case.worst_error:.0%}, scatter "
    beside += f"{np.mean(worst):.1%}"
    fewer, slower = timing.ratio(needs, takes), timing.ratio(theirs, seconds)
    return [
        Figure(f"{case}: samples", *fewer, rounds, "×", case.limit, beside),
        Figure(f"{case}: seconds", *slower, rounds, "×", None, f"{timing.typical(seconds)}, uniform {timing.typical(theirs)}"),
    ]


def _adaptive(
    case: Case, source: SceneSource, size: tuple[int, int], mask: NDArray, seed: int, workers: Workers, place: Path
) -> tuple[RenderState, int]:
    """A reference as a run makes it, and its samples per pixel with those that were given up. The mean error decides nothing."""
    plan: Mapping = {
        "target": case.target, "target_error": 0.5, "cap": 1 << 19, "seed": seed, "worst_error": case.worst_error,
    }  # fmt: skip
    looks: dict[int, int] = {}
    partial = place / "partial.npz"
    partial.unlink(missing_ok=True)

    def tell(state: RenderState, error: float) -> None:
        looks[state.look] = state.spp

    state, _ = references.sampled(workers.reference, source, size, plan, mask, partial, tell)
    return state, sum(looks.values())


def _uniform(
    case: Case, source: SceneSource, size: tuple[int, int], mask: NDArray, first: int, seeds: int, spp: int, worst: float,
    workers: Workers,
) -> tuple[float, float]:  # fmt: skip
    """Samples per pixel, and seconds, at which passes of `spp` samples have the worst error."""
    numbers = range(first, first + seeds)
    radiance, seconds = workers.reference.call("evalsuite.reference.worker:passes", source, case.target, spp, numbers, 1 << 20)
    needed = spp * (_scatter(list(radiance), mask) / worst) ** 2
    return needed, needed * seconds / (spp * seeds)


def _scatter(pictures: list[NDArray], mask: NDArray) -> float:
    """Worst standard error of one of these pictures, which differ in their seeds alone."""
    height, width = mask.shape
    together = passes.added(passes.blank((width, height)), pictures)
    return adaptive.worst_error(together, mask) * len(pictures) ** 0.5
