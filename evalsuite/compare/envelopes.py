"""For which inputs a technique is good: the planes that a run swept, from its finished cells.

A plane is two numeric axes of one scene and target with the relative error of each contender (a technique at one value of all
else that was swept) on its grid. The environments `band-ℓ` make `frequency` an axis. Pure: reads what stands in results.json.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from evalsuite.scene.builtin import band_degree

Float = NDArray[np.float64]

#: The quantity that is compared: relative to the mean reference, so that cells of unlike brightness can be.
METRIC = "rel_rmse"
#: Axes in the order in which they become x and y; others follow by name.
PREFERRED = ("exponent", "alpha", "frequency", "face_size")


@dataclass(frozen=True, eq=False)
class Contender:
    """A technique over a plane. at: values of the other swept axes. others: what else was stated and is no number. value, low,
    high: (Y, X) rel_rmse and its 95 % interval, NaN where there is no score. gpu_ms, prepare_ms: (Y, X) [ms]. truth: ids of the
    references, row by row, None where there is no score."""

    technique: str
    at: Mapping[str, float]
    others: Mapping[str, str]
    value: Float
    low: Float
    high: Float
    gpu_ms: Float
    prepare_ms: Float
    truth: tuple[str | None, ...]

    @property
    def drawn(self) -> Float:
        """The values as logarithms take them: at least a tenth of the interval's upper end, as one that noise cannot tell from 0
        could have any below that."""
        return np.where(np.isfinite(self.high), np.maximum(self.value, 0.1 * self.high), self.value)

    @property
    def label(self) -> str:
        """Technique and what tells it from others of that technique."""
        words = [f"{name} {value:g}" for name, value in self.at.items()] + [f"{k} {v}" for k, v in self.others.items()]
        return ", ".join([self.technique, *words])


@dataclass(frozen=True, eq=False)
class Plane:
    """x, y: names of the axes; xs, ys: their values, ascending. slices: the values of the other swept axes at which contenders
    can be set side by side. environment: its name, None where it is an axis."""

    scene: str
    target: str
    environment: str | None
    x: str
    y: str
    xs: Float
    ys: Float
    contenders: tuple[Contender, ...]
    slices: tuple[Mapping[str, float], ...] = field(default=({},))

    @property
    def id(self) -> str:
        """Unlike for each plane of a run, as long as no two differ in their truth alone (then the techniques tell)."""
        return "/".join(filter(None, (self.scene, self.environment, self.target, f"{self.x}×{self.y}")))

    def at(self, values: Mapping[str, float]) -> list[Contender]:
        """The contenders of one slice: those at these values, and those that do not have such a parameter."""
        return [c for c in self.contenders if all(values.get(name) == value for name, value in c.at.items())]


def coordinates(cell: Mapping) -> dict[str, float]:
    """The numbers that a cell was stated at: its numeric parameters, and the degree of its environment as `frequency`."""
    stated = cell.get("parameters") or {}
    numbers = {k: float(v) for k, v in stated.items() if isinstance(v, int | float) and not isinstance(v, bool)}
    degree = band_degree(cell.get("environment") or "")
    return numbers if degree is None else numbers | {"frequency": float(degree)}


def planes(cells: Iterable[Mapping]) -> list[Plane]:
    """The planes of a run, in the order of its cells; none where fewer than two numeric axes were swept.

    Techniques share a plane where they sweep the same parameter of the material (each is then held against its own truth), or
    where they have the very same references."""
    runs: dict[tuple, list[Mapping]] = {}
    for cell in cells:
        if (cell.get("metrics") or {}).get(METRIC, {}).get("value") is not None:
            others = tuple((k, str(v)) for k, v in (cell.get("parameters") or {}).items() if not _is_axis(cell, k))
            # What states other numbers is another sweep: it has no place on this one's axes.
            stated = frozenset(coordinates(cell))
            runs.setdefault((cell["scene"], cell["target"], cell["technique"], others, stated), []).append(cell)
    shared: dict[tuple, list[tuple[tuple, list[Mapping], list[str]]]] = {}
    for (scene, target, technique, others, _), members in runs.items():
        swept = _swept(members)
        if len(swept) >= 2:
            x, y, *rest = swept
            kinds = {p["name"]: p["kind"] for p in (members[0].get("technique_info") or {}).get("parameters", [])}
            material = tuple(name for name in (x, y) if kinds.get(name) == "material")
            truths = material or tuple(sorted({c.get("reference_id") or technique for c in members}))
            environment = next((v for k, v in others if k == "env"), None)
            shared.setdefault((scene, target, environment, x, y, truths), []).append(((technique, others), members, rest))
    return [_plane(key, entries) for key, entries in shared.items()]


def _is_axis(cell: Mapping, name: str) -> bool:
    return name in coordinates(cell) or (name == "env" and band_degree(cell.get("environment") or "") is not None)


def _swept(cells: Sequence[Mapping]) -> list[str]:
    values: dict[str, set[float]] = {}
    for cell in cells:
        for name, value in coordinates(cell).items():
            values.setdefault(name, set()).add(value)
    order = {name: k for k, name in enumerate(PREFERRED)}
    return sorted((n for n, v in values.items() if len(v) > 1), key=lambda n: (order.get(n, len(order)), n))


def _plane(key: tuple, entries: Sequence[tuple[tuple, list[Mapping], list[str]]]) -> Plane:
    scene, target, environment, x, y, _ = key
    points = [coordinates(cell) for _, members, _ in entries for cell in members]
    xs, ys = (np.array(sorted({p[name] for p in points if name in p})) for name in (x, y))
    contenders, slices = [], []
    for (technique, others), members, rest in entries:
        # A parameter that the technique sweeps and another axis holds fixed is told apart by the slices.
        groups: dict[tuple, list[Mapping]] = {}
        for cell in members:
            groups.setdefault(tuple((name, coordinates(cell).get(name)) for name in rest), []).append(cell)
        for at, group in groups.items():
            known = {k: v for k, v in at if v is not None}
            contenders.append(_contender(technique, known, {k: v for k, v in others if k != "env"}, group, (x, xs), (y, ys)))
            if known and known not in slices:
                slices.append(known)
    return Plane(scene, target, environment, x, y, xs, ys, tuple(contenders), tuple(slices) or ({},))


def _contender(
    technique: str, at: dict, others: dict, cells: Sequence[Mapping], x: tuple[str, Float], y: tuple[str, Float]
) -> Contender:
    shape = len(y[1]), len(x[1])
    grids = {name: np.full(shape, np.nan) for name in ("value", "low", "high", "gpu_ms", "prepare_ms")}
    truth: list[str | None] = [None] * (shape[0] * shape[1])
    for cell in cells:
        place = coordinates(cell)
        j, i = int(np.searchsorted(y[1], place[y[0]])), int(np.searchsorted(x[1], place[x[0]]))
        metric, cost = cell["metrics"][METRIC], cell.get("cost") or {}
        low, high = metric["ci95"]
        entries = (metric["value"], 0.0 if low is None else low, np.inf if high is None else high)
        for name, value in zip(grids, (*entries, cost.get("gpu_ms"), cost.get("prepare_ms")), strict=True):
            grids[name][j, i] = np.nan if value is None else value
        truth[j * shape[1] + i] = cell.get("reference_id")
    return Contender(technique, at, others, **grids, truth=tuple(truth))


def logarithmic(values: Float) -> bool:
    """Whether an axis is drawn and interpolated in its logarithm: all its values are positive."""
    return bool((np.asarray(values) > 0).all())


def pairs(plane: Plane) -> Iterator[tuple[Mapping[str, float], Contender, Contender]]:
    """Two contenders and the values of the slice that they meet in, each pair once."""
    seen: set[tuple[int, int]] = set()
    for values in plane.slices:
        for a, b in combinations(plane.at(values), 2):
            if (id(a), id(b)) not in seen:
                seen.add((id(a), id(b)))
                yield {**a.at, **b.at}, a, b
