"""An environment map as disc-shaped area lights and what is left: the bright, compact regions, one after another.

A circular centre-surround filter finds them: weight 1 within r_i, `surround` between r_i and r_o = r_i/inner, divided by its
angular extent 2 r_o. In each round the largest response over all sizes and over the brightest texels becomes a light: the disc
of radius r_i with the energy of its texels, which turn black.

Energy is kept by construction: a light has Σ L ω of the texels that it takes, with the exact weights ω of `math.sphere`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.lights.filter_bank import Level, Pyramid
from evalsuite.lights.model import Decomposition, DecompositionSettings, Light
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.scene.model import Environment

Float = NDArray[np.float64]
PAPER = DecompositionSettings()
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Rec.709, linear
#: A filter wider than the bright region responds alike wherever it covers all of it. Centres whose response is within this part
#: of the largest, and within this part of r_i of its place, count as one, and their mean is the light's.
TIE, TIE_REACH = 5e-3, 0.35
# Texels a radius: where responses are bounded, where they are formed, and where a light is placed.
_BOUND, _SEARCH, _PLACE = 2.5, 5.0, 20.0
_FIRST = 100  # candidates of each size that are tried before the bounds are put to use


def radii(settings: DecompositionSettings) -> Float:
    """r_i of the bank's filters, ascending [rad]."""
    low, high = np.radians([settings.smallest_deg, settings.largest_deg]) / 2.0
    extents = (
        np.geomspace(low, high, settings.sizes) if settings.spacing == "geometric" else np.linspace(low, high, settings.sizes)
    )
    return settings.inner * extents


def check(settings: DecompositionSettings) -> DecompositionSettings:
    """The settings, or EvalsuiteError where they make no sense."""
    wrong = {
        "sizes": (settings.sizes, settings.sizes >= 1, "at least 1"),
        "smallest_deg": (settings.smallest_deg, 0 < settings.smallest_deg <= settings.largest_deg, "above 0, up to largest_deg"),
        "largest_deg": (settings.largest_deg, settings.largest_deg <= 170.0, "up to 170"),
        "spacing": (settings.spacing, settings.spacing in ("geometric", "linear"), "geometric or linear"),
        "inner": (settings.inner, 0 < settings.inner < 1, "between 0 and 1"),
        "surround": (settings.surround, settings.surround < 0, "a negative number"),
        "candidates": (settings.candidates, 0 < settings.candidates <= 1, "above 0, up to 1"),
        "stop": (settings.stop, 0 <= settings.stop < 1, "from 0, below 1"),
        "max_lights": (settings.max_lights, settings.max_lights >= 0, "0 or more"),
    }
    for name, (value, right, expected) in wrong.items():
        if not right:
            raise EvalsuiteError(f"decomposition, {name}", f"{value}", expected)
    return settings


@lru_cache(maxsize=8)
def of(environment: Environment, settings: DecompositionSettings) -> Decomposition:
    """The decomposition of a scene's environment; directions are in its local frame. Raises EvalsuiteError."""
    return decompose(environment.radiance, settings)


def decompose(radiance: ArrayLike, settings: DecompositionSettings = PAPER) -> Decomposition:
    """Lights and remainder of a lat-long map (H, W, 3) of radiance, in the layout of `math.sphere`.

    Raises EvalsuiteError for settings that make no sense.
    """
    check(settings)
    rest = np.array(radiance, np.float32)
    height, width = rest.shape[:2]
    if height < 3 or width < 4:
        return Decomposition((), rest)
    search = _Search(rest, settings)
    omega = latlong_solid_angles(height, width)
    directions = latlong_directions(height, width)
    lights: list[Light] = []
    table: list[dict] = []
    total = np.zeros(3)
    while len(lights) < settings.max_lights:
        found = search.best()
        if found is None:
            break
        response, radius, centre = found
        if response <= settings.least_response:
            table.append({"response": response, "angular_radius_deg": float(np.degrees(radius)), "kept": False,
                          "ended_by": "least_response"})  # fmt: skip
            break
        # |d − c|² = 2 (1 − cos): exact for small discs, where d·c is not.
        taken = ((directions - centre) ** 2).sum(-1) <= 4.0 * np.sin(0.5 * (radius + search.texel_reach)) ** 2
        irradiance = (rest[taken].astype(np.float64) * omega[taken][:, None]).sum(0)
        before = float(total @ LUMINANCE)
        ratio = float(irradiance @ LUMINANCE) / before if before > 0 else None
        row = {
            "response": response,
            "angular_radius_deg": float(np.degrees(radius)),
            "irradiance": [float(x) for x in irradiance],
            "ratio_to_sum_before": ratio,
            "kept": ratio is None or ratio >= settings.stop,
        }
        table.append(row)
        if not irradiance @ LUMINANCE > 0.0:
            row |= {"kept": False, "ended_by": "black"}
            break
        if not row["kept"]:
            row["ended_by"] = "stop"
            break
        lights.append(Light(tuple(float(x) for x in centre), float(radius), tuple(float(x) for x in irradiance)))
        total += irradiance
        rest[taken] = 0.0
        search.remove(np.flatnonzero(taken), centre, radius)
    search.close()
    return Decomposition(tuple(lights), rest, tuple(table))


def flat_discs(found: Decomposition, subsamples: int = 4) -> NDArray[np.float32]:
    """The lights as a lat-long map of the decomposed one's shape, (H, W, 3) radiance: each disc flat, texels on its edge in
    proportion to what it covers of them, and each light's energy Σ L ω exactly its irradiance."""
    height, width = found.shape
    omega, out = latlong_solid_angles(height, width), np.zeros((height, width, 3))
    offset = (np.arange(subsamples) + 0.5) / subsamples - 0.5
    for light in found.lights:
        centre, covered = np.asarray(light.direction), np.zeros((height, width))
        reach = light.angular_radius + 2.0 * np.pi / min(width, height)
        theta = np.arange(height) * np.pi / (height - 1)
        rows = np.flatnonzero(np.abs(theta - np.arccos(np.clip(centre[1], -1, 1))) <= reach)
        for dy in offset:
            t = np.clip(theta[rows] + dy * np.pi / (height - 1), 0.0, np.pi)
            for dx in offset:
                phi = 2.0 * np.pi * (np.arange(width) + 0.5 + dx) / width
                cosine = np.outer(np.sin(t), np.sin(phi) * centre[0] - np.cos(phi) * centre[2]) + np.cos(t)[:, None] * centre[1]
                covered[rows] += cosine >= np.cos(light.angular_radius)
        if not covered.any():  # it falls between the points: one texel holds it
            covered.flat[np.argmax(latlong_directions(height, width).reshape(-1, 3) @ centre)] = 1.0
        out += covered[..., None] * (np.asarray(light.irradiance) / float((covered * omega).sum()))
    return out.astype(np.float32)


class _Search:
    """Responses of the bank at the brightest texels, kept from light to light where nothing near has changed."""

    def __init__(self, radiance: NDArray[np.float32], settings: DecompositionSettings) -> None:
        self.settings, self.radii = settings, radii(settings)
        self._pool = ThreadPoolExecutor(os.cpu_count())  # NumPy's sums leave Python's lock alone
        height, width = radiance.shape[:2]
        self.luminance = np.maximum(radiance.astype(np.float64) @ LUMINANCE, 0.0).ravel()
        #: A disc's texels have their centres within its radius and this [rad], a quarter of a texel: less, and the half covered
        #: texels on a bright region's edge count as its surround; more, and discs smaller than the region would do.
        self.texel_reach = 0.25 * max(np.pi / (height - 1), 2.0 * np.pi / width)
        omega = latlong_solid_angles(height, width).ravel()
        self.pyramid = Pyramid((self.luminance * omega).reshape(height, width))
        self.coarse, self.level = ([self.pyramid.level(r / n) for r in self.radii] for n in (_BOUND, _SEARCH))
        self.bound, self.response = (
            [np.full(self.pyramid.levels[k].energy.size, np.nan) for k in levels] for levels in (self.coarse, self.level)
        )

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

    def _candidates(self) -> NDArray[np.int64]:
        """Flat indices of the brightest texels, none of them black."""
        count = max(1, int(self.settings.candidates * len(self.luminance)))
        threshold = np.partition(self.luminance, -count)[-count]
        above = np.flatnonzero(self.luminance > threshold)
        level = np.flatnonzero(self.luminance == threshold)  # equals fill up, spread over the map
        if threshold > 0.0 and len(above) < count:
            wanted = count - len(above)
            level = level[np.linspace(0, len(level) - 1, wanted).astype(np.int64)] if wanted < len(level) else level
            above = np.union1d(above, level)
        return above

    def _respond(self, size: int, level: int, index: NDArray[np.int64], subrows: int = 1) -> Float:
        inner = self.radii[size]
        outer = inner / self.settings.inner
        grid = self.pyramid.levels[level]
        centre = grid.disc_sums(index, inner, subrows)
        return (centre + self.settings.surround * (grid.disc_sums(index, outer, subrows) - centre)) / (2.0 * outer)

    def best(self) -> tuple[float, float, Float] | None:
        """(response, r_i, unit direction) of the filter that responds most; None for a map without light."""
        candidates = self._candidates()
        if len(candidates) == 0:
            return None
        # Branch and bound: what cannot exceed the best response found is not looked at.
        sizes = range(len(self.radii))
        bounded = list(self._pool.map(lambda size: self._bounded(size, candidates), sizes))
        best = list(self._pool.map(lambda size: self._best_of(size, bounded[size][0][:_FIRST]), sizes))
        highest = max(response for response, *_ in best)
        worth = [index[bound >= highest] for index, bound in bounded]
        best += self._pool.map(lambda size: self._best_of(size, worth[size]), sizes)
        best = sorted({found for found in best if found[2] >= 0}, reverse=True)
        # A coarse level errs by a few per cent: the best of the best few sizes are looked at closely.
        closely = [self._place(size, self._direction(size, index)) for _, size, index in best[:6]]
        response, radius, centre = max(closely, key=lambda found: found[0])
        return response, self._fit(radius, centre), centre

    def _fit(self, radius: float, centre: Float) -> float:
        """The size near one that responds most at a place, by whole texels: coarse rows, and texels counted by parts, smear a
        bright region's edge into the surround, where it weighs ten times as much."""
        about = int(np.searchsorted(self.radii, radius * (1.0 - 1e-9)))
        sizes = self.radii[max(about - 4, 0) : about + 2]
        finest = self.pyramid.levels[0]
        index = _within(finest, centre, sizes[-1] / self.settings.inner + self.texel_reach)
        distance = 2.0 * np.arcsin(0.5 * np.linalg.norm(finest.directions(index) - centre, axis=-1)) - self.texel_reach
        energy = finest.energy.ravel()[index]
        order = np.argsort(distance)
        within = np.concatenate([[0.0], np.cumsum(energy[order])])
        inner, outer = (within[np.searchsorted(distance[order], r, side="right")] for r in (sizes, sizes / self.settings.inner))
        return float(sizes[np.argmax((inner + self.settings.surround * (outer - inner)) / sizes)])

    def _direction(self, size: int, index: int) -> Float:
        return self.pyramid.levels[self.level[size]].directions(np.array([index]))[0]

    def _bounded(self, size: int, candidates: NDArray[np.int64]) -> tuple[NDArray[np.int64], Float]:
        """Centres of a size by falling bound, and the bounds."""
        index = self.pyramid.centres(candidates, self.level[size])
        coarse = self.pyramid.nearest(index, self.level[size], self.coarse[size])
        self._known(self.bound[size], size, self.coarse[size], np.unique(coarse), self._bound)
        bound = self.bound[size][coarse]
        order = np.argsort(-bound, kind="stable")
        return index[order], bound[order]

    def _best_of(self, size: int, index: NDArray[np.int64]) -> tuple[float, int, int]:
        """(response, size, flat index) of the best of some centres; index −1 for none."""
        if len(index) == 0:
            return -np.inf, size, -1
        values = self._known(self.response[size], size, self.level[size], index, self._respond)
        at = int(np.argmax(values))
        return float(values[at]), size, int(index[at])

    def _bound(self, size: int, level: int, index: NDArray[np.int64]) -> Float:
        """What no centre nearest to a coarse texel can exceed: all that its disc may hold, and what its surround must."""
        inner, grid = self.radii[size], self.pyramid.levels[level]
        outer = inner / self.settings.inner
        most = grid.disc_sums(index, inner + grid.spacing)
        least = np.zeros_like(most)
        if outer - grid.spacing > inner + grid.spacing:
            least = np.maximum(grid.disc_sums(index, outer - grid.spacing) - most, 0.0)
        return (most + self.settings.surround * least) / (2.0 * outer)

    def _known(self, kept: Float, size: int, level: int, index: NDArray[np.int64], form: Callable[..., Float]) -> Float:
        """Values at texels of a level, formed where they are not known."""
        unknown = index[np.isnan(kept[index])]
        if len(unknown):
            kept[unknown] = form(size, level, unknown)
        return kept[index]

    def _place(self, size: int, about: Float) -> tuple[float, float, Float]:
        """A size's best response near a direction, on a finer level, and where its light is."""
        radius = self.radii[size]
        level = self.pyramid.level(max(radius / _PLACE, self.pyramid.levels[0].spacing))
        grid = self.pyramid.levels[level]
        near = _within(grid, about, 2.0 * TIE_REACH * radius + self.pyramid.levels[self.level[size]].spacing)
        polar = np.hypot(about[0], about[2]) < np.sin(min(radius, 0.5 * np.pi))
        values = self._respond(size, level, near, 4 if polar else 1)
        top = int(np.argmax(values))
        peak, directions = float(values[top]), grid.directions(near)
        close = ((directions - directions[top]) ** 2).sum(-1) <= (TIE_REACH * radius) ** 2
        tied = close & (values >= peak - TIE * abs(peak))
        # By solid angle: rows near a pole are crowded.
        middle = _mean(directions[tied], np.sqrt(np.maximum(1.0 - directions[tied][:, 1] ** 2, 1e-12)))
        # Better still the centre of the light itself, where a filter there responds as well.
        of_light = middle
        for _ in range(3):
            inside = _within(grid, of_light, radius)
            energy = grid.energy.ravel()[inside]
            if not energy.sum() > 0.0:
                break
            of_light = _mean(grid.directions(inside), energy)
        there = int(np.argmax(directions @ of_light))
        return peak, float(radius), of_light if values[there] >= peak - TIE * abs(peak) else middle

    def remove(self, index: NDArray[np.int64], centre: Float, radius: float) -> None:
        """Black texels, by flat index; responses whose filters reach them are forgotten."""
        self.luminance[index] = 0.0
        self.pyramid.remove(index)
        for levels, kept in ((self.coarse, self.bound), (self.level, self.response)):
            for size, level in enumerate(levels):
                reach = radius + self.radii[size] / self.settings.inner + 3.0 * self.pyramid.levels[level].spacing
                kept[size][_within(self.pyramid.levels[level], centre, reach)] = np.nan


def _mean(directions: Float, weight: Float) -> Float:
    middle = (directions * weight[:, None]).sum(0)
    return middle / np.linalg.norm(middle)


def _within(grid: Level, centre: Float, radius: float) -> NDArray[np.int64]:
    """Flat indices of a level's texels within a radius [rad] of a direction."""
    theta = np.arccos(np.clip(centre[1], -1.0, 1.0))
    rows = np.flatnonzero(np.abs(grid.theta - theta) <= radius)
    index = (rows[:, None] * grid.width + np.arange(grid.width)).ravel()
    near = ((grid.directions(index) - centre) ** 2).sum(-1) <= 4.0 * np.sin(0.5 * min(radius, np.pi)) ** 2
    return index[near]
