"""What a run will take, from what earlier ones took: `run --dry-run`.

A reference needs about D/ε^p samples a pixel for a relative standard error ε. D is taken from the references of earlier runs
that are most alike: of the same scene, environment, target and material, else of fewer of these; among them from the nearest ε.
p, which is 2 for independent samples and less for stratified ones, from those that were made at several ε. A run takes what its
references take, and so much for each cell beside, weighed by least squares over the runs on this machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np

from evalsuite.gpu import registry
from evalsuite.gpu.plan import cannot_stand_for
from evalsuite.ledger import truths
from evalsuite.lights.model import DecompositionSettings
from evalsuite.pipeline import Run
from evalsuite.plan import NEAR_FIELD, Cell
from evalsuite.steps import about
from evalsuite.store import costs

#: Fewest samples a pixel that a reference takes: eight passes of sixteen.
LEAST_SPP = 128
#: How a reference is told apart, from most alike to any.
ALIKE = (("scene", "environment", "target", "bsdf"), ("scene", "environment", "target"), ("scene", "target"), ("target",), ())
#: Taken for granted as far as no run says otherwise: a run's start [s], a cell's share [s], that of a million of its pixels [s].
GRANTED = (6.0, 1.0, 8.0)


@dataclass(frozen=True)
class Forecast:
    """cells: planned; made: of them those with something left to make. references: to render; samples: in all, over all pixels.
    seconds, bytes: of the run and of what it adds to the store and its folder; each with the ends of the range that nine in ten
    should keep to."""

    cells: int
    made: int
    references: int
    samples: int
    seconds: tuple[float, float, float]
    bytes: tuple[float, float, float]

    def to_json(self) -> dict:
        return asdict(self)


def of_run(run: Run, made: Sequence[tuple[Cell, Mapping]], directory: Path, wall: float) -> dict:
    """The line that `costs.jsonl` has of a finished run. made: what became of its cells. wall: it took [s]."""
    fresh = [cell for cell, result in made if not result["cost"].get("cached", True)]
    sizes = [run.outline(run.source(cell)).camera.size for cell in fresh]
    folder = sum(file.stat().st_size for file in directory.rglob("*") if file.is_file())
    return {
        "kind": "run",
        "wall": wall,
        "reference_s": sum(row["seconds"] for row in run.costs),
        "fresh": len(fresh),
        "cells": len(made),
        "pixels": sum(width * height for width, height in sizes),
        "bytes": run.store.written + folder * len(fresh) / max(len(made), 1),
    }


def forecast(run: Run, cells: Sequence[Cell]) -> Forecast:
    """What making these cells will take. Raises EvalsuiteError for a scene that cannot be loaded or drawn."""
    rows = costs.read(run.store.root)
    known, runs = ([row for row in rows if _whole(row, kind)] for kind in KEYS)
    known = [row for row in known if row.get("worst_error") == run.settings.worst_error]
    wanted: dict[str, tuple[Mapping, int]] = {}
    made, pixels = 0, 0
    for cell in cells:
        steps = _steps(run, cell)
        if steps is None:
            continue
        picture, references, size = steps
        missing = {key: like for key, like in references.items() if not run.store.has("reference", key)}
        wanted |= {key: (like, size) for key, like in missing.items()}
        if missing or not run.store.has("image", picture):
            made, pixels = made + 1, pixels + size
    power = _power(known)
    taken = [_reference(known, like, size, run.settings.target_error, run.settings.cap, power) for like, size in wanted.values()]
    samples = sum(size * spp for (_, size), (spp, _) in zip(wanted.values(), taken, strict=True))
    shares = np.array([1.0, made, pixels / 1e6, sum(seconds for _, seconds in taken)])
    return Forecast(
        len(cells), made, len(wanted), round(samples),
        _ranged(float(shares @ _weights(runs)), _scatter(runs, _time)),
        _ranged(_per_pixel(runs) * pixels, _scatter(runs, lambda row, others: _per_pixel(others) * row["pixels"], "bytes")),
    )  # fmt: skip


#: What a line must have to be gone by.
KEYS = {
    "reference": ("pixels", "spp", "reached_error", "seconds"),
    "run": ("wall", "reference_s", "fresh", "cells", "pixels", "bytes"),
}


def _whole(row: Mapping, kind: str) -> bool:
    return row.get("kind") == kind and all(isinstance(row.get(key), int | float) and row[key] >= 0 for key in KEYS[kind])


def _steps(run: Run, cell: Cell) -> tuple[str, dict[str, Mapping], int] | None:
    """Keys of a cell's picture and of its references, what each of these is like, and pixels; None for one that is skipped."""
    technique = registry.find(cell.technique)
    plain = run.source(cell)
    outline = run.outline(plain)
    outline.require_drawable()
    if technique.reason_against_target(cell.target) or (cell.target == NEAR_FIELD and outline.room_file is None):
        return None
    source, parameters = run.bound_source(cell, technique, plain)
    if cannot_stand_for(technique, run.outline(source)):
        return None
    targets = [cell.target]
    if run.settings.ledger:
        targets += [name for name, _ in truths(technique, cell.target, {**technique.defaults(), **parameters}, True)]
    decomposition = DecompositionSettings.of(parameters)
    references = {
        run.reference_key(source, target, run.settings.seed, decomposition)[0]: about(source, target) for target in targets
    }
    width, height = outline.camera.size
    return run.image_key(source, technique, parameters), references, width * height


def _alike(known: Sequence[Mapping], like: Mapping) -> list[Mapping]:
    for keys in ALIKE:
        found = [row for row in known if all(row.get(key) == like[key] for key in keys)]
        if found:
            return found
    return []


def _power(known: Sequence[Mapping]) -> float:
    """p of spp ∝ ε^−p: median slope between references that differ in ε alone; 2 where none do."""
    groups: dict[tuple, list[Mapping]] = {}
    for row in known:
        if row["reached_error"] > 0:
            groups.setdefault(tuple(row.get(key) for key in (*ALIKE[0], "pixels")), []).append(row)
    slopes = []
    for rows in groups.values():
        first, last = (pick(rows, key=lambda row: row["reached_error"]) for pick in (max, min))
        if first["reached_error"] > 1.5 * last["reached_error"]:
            slopes.append(math.log(last["spp"] / first["spp"]) / math.log(first["reached_error"] / last["reached_error"]))
    return float(np.clip(median(slopes), 1.0, 2.0)) if slopes else 2.0


def _reference(known: Sequence[Mapping], like: Mapping, pixels: int, error: float, cap: int, power: float) -> tuple[float, float]:
    """Samples a pixel, and seconds, of a reference."""
    rows = [row for row in _alike(known, like) if row["reached_error"] > 0]
    if not rows:
        return float(LEAST_SPP), 0.0
    distance = [abs(math.log(row["reached_error"] / error)) for row in rows]
    near = [row for row, d in zip(rows, distance, strict=True) if d <= min(distance) + 0.1]
    spp = median(row["spp"] * _times(row, error) ** power for row in near)
    spp = min(max(spp, LEAST_SPP), cap)
    start = min(row["seconds"] for row in known)
    rate = median(max(row["seconds"] - start, 0.0) / (row["spp"] * row["pixels"]) for row in near)
    return spp, start + rate * spp * pixels


def _times(row: Mapping, error: float) -> float:
    """How much finer ε is than what a reference reached. One of the fewest samples would have done with fewer still: it says
    nothing of coarser ones."""
    times = row["reached_error"] / error
    return max(times, 1.0) if row["spp"] <= LEAST_SPP else times


def _weights(runs: Sequence[Mapping]) -> np.ndarray:
    """Of a run's start, a cell made, a million of its pixels, and a second of a reference: least squares of relative errors."""
    from scipy.optimize import nnls

    granted = np.array([*GRANTED, 1.0])
    rows = [
        np.array([1.0, row["fresh"], row["pixels"] / 1e6, row["reference_s"]]) / row["wall"] for row in runs if row["wall"] > 0
    ]
    prior = 0.3 * np.diag(1 / granted)
    return nnls(np.array([*rows, *prior]), np.array([1.0] * len(rows) + [0.3] * 4))[0]


def _time(row: Mapping, others: Sequence[Mapping]) -> float:
    return float(np.array([1.0, row["fresh"], row["pixels"] / 1e6, row["reference_s"]]) @ _weights(others))


def _per_pixel(runs: Sequence[Mapping]) -> float:
    """Bytes that a pixel of a made cell adds."""
    found = [row["bytes"] / row["pixels"] for row in runs if row["pixels"]]
    return median(found) if found else 0.0


def _scatter(runs: Sequence[Mapping], predicted: Callable[[Mapping, Sequence[Mapping]], float], key: str = "wall") -> float:
    """Standard deviation of log(true / predicted) over the last runs, each predicted from the others; 0.3 at least, which is what
    a reference's own samples leave open."""
    logs = []
    for k, row in list(enumerate(runs))[-20:]:
        guess = predicted(row, [*runs[:k], *runs[k + 1 :]])
        if guess > 0 and row[key] > 0:
            logs.append(math.log(row[key] / guess))
    return max(0.3, float(np.sqrt(np.mean(np.square(logs))))) if logs else 0.7


def _ranged(value: float, scatter: float) -> tuple[float, float, float]:
    factor = math.exp(1.645 * scatter)
    return value, value / factor, value * factor


def in_words(found: Mapping) -> str:
    """A forecast, as `Forecast.to_json` has it, in a sentence: what is to be made, and how long and how much it takes, each with
    nine in ten between the brackets."""
    if not found["made"]:
        return "all is in the store: seconds"
    (time, *times), (size, *sizes) = found["seconds"], found["bytes"]
    return (f"{found['made']} of {found['cells']} cells to make, {found['references']} references of "
            f"{_samples(found['samples'])} samples in all: {_duration(time)} [{' … '.join(map(_duration, times))}], "
            f"{_megabytes(size)} [{' … '.join(map(_megabytes, sizes))}]")  # fmt: skip


def _duration(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s" if whole < 3600 else f"{whole / 3600:.1f} h"


def _samples(count: float) -> str:
    return f"{count / 1e9:.3g} billion" if count >= 1e9 else f"{count / 1e6:.3g} million"


def _megabytes(size: float) -> str:
    return f"{size / 1e6:.3g} MB"
