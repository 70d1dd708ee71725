"""An environment map taken apart into area lights, beside evaluating the filters directly.

Directly means as the paper does (2004, §3): in each round every filter is evaluated by itself, in its own field of view, at the
brightest 10 % of the texels. Kinder is to sort a centre's texels by distance once for all twenty filters; it is measured beside.
Both are in NumPy, as the search is, and look only at rows within reach. All of it would take hours, so that a random sample of
the centres is gone over, and its time multiplied by how many there are and by the rounds that the search took.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import zoom

from benchmarks import timing
from benchmarks.figure import Figure, Limit
from evalsuite.image import exr
from evalsuite.lights.decompose import LUMINANCE, PAPER, decompose, radii
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.scene import builtin

TITLE = "Decomposition into area lights"
MAPS = ("cathedral", "basilica")


class Direct:
    """Responses of the filter bank at a texel of a lat-long map (H, W, 3), by going over the texels within reach."""

    def __init__(self, radiance: np.ndarray) -> None:
        height, width = radiance.shape[:2]
        self.luminance = radiance.astype(np.float64) @ LUMINANCE
        self.energy = self.luminance * latlong_solid_angles(height, width)
        self.directions = latlong_directions(height, width)
        self.theta = np.arange(height) * np.pi / (height - 1)
        self.inner = radii(PAPER)
        self.outer = self.inner / PAPER.inner

    def candidates(self) -> np.ndarray:
        """Flat indices of the brightest texels."""
        count = int(PAPER.candidates * self.luminance.size)
        return np.argpartition(self.luminance.ravel(), -count)[-count:]

    def _near(self, index: int, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Texels within about `reach` [rad]: |d − c|² and energy."""
        row, column = divmod(int(index), self.luminance.shape[1])
        rows = slice(*np.searchsorted(self.theta, (self.theta[row] - reach, self.theta[row] + reach)))
        return 2.0 - 2.0 * (self.directions[rows] @ self.directions[row, column]), self.energy[rows]

    def each(self, index: int) -> np.ndarray:
        """Every filter by itself: response of each size, (sizes,)."""
        found = []
        for inner, outer in zip(self.inner, self.outer, strict=True):
            distance, energy = self._near(index, outer)
            within, centre = (energy[distance <= _chord(r)].sum() for r in (outer, inner))
            found.append((centre + PAPER.surround * (within - centre)) / (2.0 * outer))
        return np.array(found)

    def together(self, index: int) -> np.ndarray:
        """The same, from one pass over the texels."""
        rims = np.sort(_chord(np.concatenate([self.inner, self.outer])))
        distance, energy = self._near(index, self.outer[-1])
        some = distance <= rims[-1]
        sums = np.cumsum(np.bincount(np.searchsorted(rims, distance[some]), energy[some], minlength=len(rims)))
        centre, within = (sums[np.searchsorted(rims, _chord(r))] for r in (self.inner, self.outer))
        return (centre + PAPER.surround * (within - centre)) / (2.0 * self.outer)


def _chord(angle: np.ndarray | float) -> np.ndarray | float:
    return 4.0 * np.sin(0.5 * angle) ** 2


def measure(quick: bool) -> list[Figure]:
    """Ratios of times on maps of 1024 × 512 texels."""
    return [figure for name in MAPS[: 1 if quick else None] for figure in _of(name, quick)]


def _of(name: str, quick: bool) -> list[Figure]:
    radiance = exr.read(builtin.environment_path(name))
    radiance = np.maximum(zoom(radiance, (512 / radiance.shape[0], 1024 / radiance.shape[1], 1), order=1), 0.0)
    rounds, sample = (3, 50) if quick else (7, 200)
    direct, found = Direct(radiance), decompose(radiance)
    candidates = direct.candidates()
    times, figures = len(candidates) / sample * len(found.table), []
    ways = ((direct.each, "as in the paper", Limit(500.0, least=True)), (direct.together, "in one pass over the texels", None))
    for way, what, limit in ways:
        draws = iter(np.random.default_rng(0).choice(candidates, (rounds + 1, sample)))
        ours, sampled = timing.rounds_of(lambda: decompose(radiance), lambda w=way, d=draws: [w(k) for k in next(d)], rounds)
        theirs = [seconds * times for seconds in sampled]
        value, ci95 = timing.ratio(theirs, ours)
        beside = f"{timing.typical(ours)} for {len(found.lights)} lights; directly {np.median(theirs) / 60:.3g} min"
        figures.append(Figure(f"{name}: direct evaluation, {what}, over ours", value, ci95, rounds, "×", limit, beside))
    return figures
