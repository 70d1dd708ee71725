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
from scipy.stats import t as student

from benchmarks.figure import Figure, Limit
from evalsuite import references
from evalsuite.execute.local import Workers
from evalsuite.gpu import registry
from evalsuite.reference import adaptive, passes
from evalsuite.reference.passes import RenderState
from evalsuite.scene import builtin
from evalsuite.scene.model import SUBJECT, SceneSource
from evalsuite.settings import Settings
from evalsuite.steps import Steps
from evalsuite.store.cache import Store

TITLE = "Uniform over adaptive samples at equal worst error"
#: Samples per pixel of uniform passes.
UNIFORM = (64, 256)
#: Of seeds, one of which is left out at a time.
GROUPS = 8


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
    Case("sphere", "cathedral", "direct", 0.2, 50.0),
    Case("sphere", "sunsky", "direct", 0.1, 50.0),
    Case("torus", "office", "unoccluded", 0.1, 10.0, None),
    Case("organic", "cathedral", "path", 0.05, None, None),
    Case("still-life", "cathedral", "path", 0.05, None, None),
)


def measure(quick: bool) -> list[Figure]:
    """64², 32 seeds; quick: 48², 16 seeds."""
    size, seeds = ((48, 48), 16) if quick else ((64, 64), 32)
    figures = []
    with Workers(jobs=1) as workers, tempfile.TemporaryDirectory() as place:
        for case in CASES:
            figures += _figures(case, size, seeds, workers, Path(place))
    return figures


def _figures(case: Case, size: tuple[int, int], seeds: int, workers: Workers, place: Path) -> list[Figure]:
    source = case.source(size)
    mask = Steps(Store(place / "store"), workers, Settings()).object_mask(source)
    made = [_adaptive(case, source, size, mask, seed, workers, place) for seed in range(seeds)]
    uniform = {spp: _uniform(case, source, spp, seeds, workers) for spp in UNIFORM}
    pictures = np.array([state.mean for state, _ in made])
    samples, seconds = np.mean([samples for _, samples in made]), np.mean([state.seconds for state, _ in made])

    def needed(spp: int, chosen: NDArray) -> float:
        """Samples per pixel at which uniform passes are as good as adaptive references, by some of the seeds."""
        return spp * (_scatter(uniform[spp][0][chosen], mask) / _scatter(pictures[chosen], mask)) ** 2

    every = np.arange(seeds)
    best = min(UNIFORM, key=lambda spp: needed(spp, every))
    needs = needed(best, every)
    # Without a group of seeds at a time: the worst pixel of too few seeds is the one whose scatter they overrate most.
    less = [needed(best, np.setdiff1d(every, group)) for group in np.array_split(every, GROUPS)]
    slower = uniform[best][1] / seconds
    beside = f"{samples:.0f} samples a pixel, uniform {needs:.0f} ({best} a pass); asked for {case.worst_error:.0%}, "
    beside += f"scatter {_scatter(pictures, mask):.1%}"
    times = f"{seconds:.3g} s, uniform {needs * uniform[best][1]:.3g} s"
    return [
        Figure(f"{case}: samples", *_jackknifed(needs / samples, np.array(less) / samples), seeds, "×", case.limit, beside),
        Figure(f"{case}: seconds", *_jackknifed(needs * slower, np.array(less) * slower), seeds, "×", None, times),
    ]


def _jackknifed(value: float, less: NDArray) -> tuple[float, tuple[float, float]]:
    """A value, and its 95 % interval from those without a group each: Student's t of their logarithms."""
    logs, count = np.log(less), len(less)
    half = student.ppf(0.975, count - 1) * np.sqrt((count - 1) * logs.var())
    return float(value), (float(value * np.exp(-half)), float(value * np.exp(half)))


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


def _uniform(case: Case, source: SceneSource, spp: int, seeds: int, workers: Workers) -> tuple[NDArray, float]:
    """Passes of `spp` samples, (K, H, W, 3), and seconds for a sample a pixel."""
    asked = (source, case.target, spp, range(seeds), 1 << 20)
    radiance, seconds, _ = workers.reference.call("evalsuite.reference.worker:passes", *asked)
    return radiance, seconds / (spp * seeds)


def _scatter(pictures: NDArray, mask: NDArray) -> float:
    """Worst standard error of one of these pictures, which differ in their seeds alone."""
    height, width = mask.shape
    together = passes.added(passes.blank((width, height)), pictures)
    return adaptive.worst_error(together, mask) * len(pictures) ** 0.5
