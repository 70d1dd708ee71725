"""What a run will take, from what earlier ones took: `run --dry-run`.

What references take is told from earlier ones (`sampling_law`). A run takes what its references take, and so much for each cell
beside, weighed by least squares over the runs on this machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median

import numpy as np

from evalsuite.gpu import registry
from evalsuite.ledger import truths
from evalsuite.lights.model import DecompositionSettings
from evalsuite.pipeline import Run
from evalsuite.plan import Cell
from evalsuite.sampling_law import Law, WorstPixel
from evalsuite.steps import about
from evalsuite.store import costs

#: Taken for granted as far as no run says otherwise [s]: of a run's start and end, a cell, a picture that is drawn, a million
#: pixels of such pictures, a second of a reference.
GRANTED = (6.0, 0.3, 0.7, 8.0, 1.0)
#: Weight of each beside one run: a reference's second is a second, what a cell takes depends on the machine.
SURE = (0.3, 0.3, 0.3, 0.3, 2.0)


@dataclass(frozen=True)
class Forecast:
    """cells: planned; made: of them those with something left to make. references: to render. samples: of all of them, over all
    pixels; seconds, bytes: of the run and of what it adds to the store and its folder; each with the ends of the range that nine
    in ten should keep to."""

    cells: int
    made: int
    references: int
    samples: tuple[float, float, float]
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
        "processor": sum(row["processor"] for row in run.costs),
        "cores": run.workers.passes.cores,
        "drawn": len(run.drawn),
        "drawn_pixels": sum(run.drawn),
        "fresh": len(fresh),
        "cells": len(made),
        "pixels": sum(width * height for width, height in sizes),
        "bytes": run.store.written + folder * len(fresh) / max(len(made), 1),
    }


def forecast(run: Run, cells: Sequence[Cell]) -> Forecast | None:
    """What making these cells will take; None where no earlier run tells. Raises EvalsuiteError for a scene that cannot be loaded
    or drawn."""
    (references_known, runs), worst = known(run), run.settings.worst_error
    if worst is not None and not references_known:
        return None
    wanted: dict[str, tuple[Mapping, int]] = {}
    made = pixels = drawn = drawn_pixels = 0
    for cell in cells:
        steps = steps_of(run, cell)
        if steps is None:
            continue
        picture, references, size = steps
        missing = {key: like for key, like in references.items() if not run.store.has("reference", key)}
        wanted |= {key: (like, size) for key, like in missing.items()}
        drawing = not run.store.has("image", picture)
        if missing or drawing:
            made, pixels = made + 1, pixels + size
            drawn, drawn_pixels = drawn + drawing, drawn_pixels + drawing * size
    law = Law.of(references_known) if worst is None else WorstPixel(references_known, worst)
    settings = run.settings

    def references(sigmas: float) -> tuple[float, float]:
        taken = [law.reference(like, size, settings.target_error, settings.cap, sigmas) for like, size in wanted.values()]
        return sum(size * spp for (_, size), (spp, _) in zip(wanted.values(), taken, strict=True)), sum(s for _, s in taken)

    # How far apart the exponents of references lie widens what is told of errors finer than theirs.
    (samples, seconds), (most, longest) = references(0.0), references(1.0)
    weights = weights_of(runs)

    def time(reference_s: float) -> float:
        return float(np.array([1.0, made, drawn, drawn_pixels / 1e6, reference_s]) @ weights)

    return Forecast(
        len(cells), made, len(wanted),
        _ranged(samples, _both(LEAST_SCATTER, most, samples)),
        _ranged(time(seconds), _both(_scatter(runs, _time), time(longest), time(seconds))),
        _ranged(_per_pixel(runs) * pixels, _scatter(runs, lambda row, others: _per_pixel(others) * row["pixels"], "bytes")),
    )  # fmt: skip


def _both(scatter: float, most: float, value: float) -> float:
    """Standard deviation of a logarithm that scatters, and of which one deviation more makes `most` of `value`."""
    return math.hypot(scatter, math.log(most / value)) if most > value > 0 else scatter


#: Standard deviation of log(true / predicted) that is always granted: a reference's own samples leave it open.
LEAST_SCATTER = 0.3
#: Quantile of references by the processor time of their second, at which nothing else took any.
ALONE = 0.9
#: What a line must have to be gone by.
KEYS = {
    "reference": ("pixels", "spp", "reached_error", "seconds"),
    "run": ("wall", "reference_s", "fresh", "cells", "pixels", "bytes"),
}


def _whole(row: Mapping, kind: str) -> bool:
    return row.get("kind") == kind and all(isinstance(row.get(key), int | float) and row[key] >= 0 for key in KEYS[kind])


def known(run: Run) -> tuple[list[dict], list[dict]]:
    """References, made as this run's are, and runs that can be gone by: those of earlier runs, and what this one has rendered.
    References, and those of runs, with the seconds that they would take on as many cores as this run has and alone: rendered
    beside other work they took longer, but no more processor time."""
    rows = [*costs.read(run.store.root), *run.costs]
    references, runs = ([row for row in rows if _whole(row, kind)] for kind in KEYS)
    references = [row for row in references if (row.get("worst_error") is None) == (run.settings.worst_error is None)]
    return alone(references, runs, run.workers.passes.cores)


def alone(references: Sequence[Mapping], runs: Sequence[Mapping], cores: int) -> tuple[list[dict], list[dict]]:
    """Rows as `known` gives them. Who has no processor time keeps the seconds of its clock."""
    used = [spent / (row["seconds"] * row.get("cores", cores)) for row in references if (spent := _spent(row)) and row["seconds"]]
    share = min(float(np.quantile(used, ALONE)), 1.0) if used else 1.0  # of the cores, that a reference keeps busy

    def seconds(row: Mapping, key: str) -> float:
        """On the cores of who rendered it."""
        return spent / (share * row.get("cores", cores)) if (spent := _spent(row)) else row[key]

    return (
        [row | {"seconds": seconds(row, "seconds") * row.get("cores", cores) / cores} for row in references],
        [row | {"reference_s": seconds(row, "reference_s")} for row in runs],
    )


def _spent(row: Mapping) -> float:
    """Processor time [s]; 0 where there is none to go by."""
    spent = row.get("processor")
    return float(spent) if isinstance(spent, int | float) and 0 < spent < math.inf else 0.0


def at_hand(run: Run, cells: Sequence[Cell]) -> bool:
    """Whether there are earlier references to go by, and `forecast` would load no scene."""
    if not known(run)[0]:
        return False
    for cell in cells:
        technique, plain = registry.find(cell.technique), run.source(cell)
        if not run.has_outline(plain):
            return False
        parameters = technique.defaults() | technique.parse(cell.parameters)
        bound = replace(plain, bindings=run.bind(cell, technique, run.outline(plain), parameters))
        if not run.has_outline(bound):
            return False
    return True


def steps_of(run: Run, cell: Cell) -> tuple[str, dict[str, Mapping], int] | None:
    """Keys of a cell's picture and of its references, what each of these is like, and pixels; None for one that is skipped."""
    reason, source, parameters = run.prepared(cell)
    if reason:
        return None
    technique = registry.find(cell.technique)
    targets = [cell.target]
    if run.settings.ledger:
        targets += [name for name, _ in truths(technique, cell.target, {**technique.defaults(), **parameters}, True)]
    decomposition = DecompositionSettings.of(parameters)
    references = {
        run.reference_key(source, target, run.settings.seed, decomposition)[0]: about(source, target) for target in targets
    }
    width, height = run.outline(source).camera.size
    return run.image_key(source, technique, parameters), references, width * height


def _work(row: Mapping) -> np.ndarray:
    """What `GRANTED` weighs. Who does not say what was drawn drew all."""
    drawn = row.get("drawn", row["fresh"]), row.get("drawn_pixels", row["pixels"]) / 1e6
    return np.array([1.0, row["fresh"], *drawn, row["reference_s"]])


def weights_of(runs: Sequence[Mapping]) -> np.ndarray:
    """Seconds of what `GRANTED` names: least squares of relative errors."""
    from scipy.optimize import nnls

    rows = [_work(row) / row["wall"] for row in runs if row["wall"] > 0]
    return nnls(np.array([*rows, *np.diag(np.array(SURE) / GRANTED)]), np.array([1.0] * len(rows) + [*SURE]))[0]


def _time(row: Mapping, others: Sequence[Mapping]) -> float:
    return float(_work(row) @ weights_of(others))


def _per_pixel(runs: Sequence[Mapping]) -> float:
    """Bytes that a pixel of a made cell adds."""
    found = [row["bytes"] / row["pixels"] for row in runs if row["pixels"]]
    return median(found) if found else 0.0


def _scatter(runs: Sequence[Mapping], predicted: Callable[[Mapping, Sequence[Mapping]], float], key: str = "wall") -> float:
    """Standard deviation of log(true / predicted) over the last runs, each predicted from the others."""
    logs = []
    for k, row in list(enumerate(runs))[-20:]:
        guess = predicted(row, [*runs[:k], *runs[k + 1 :]])
        if guess > 0 and row[key] > 0:
            logs.append(math.log(row[key] / guess))
    return max(LEAST_SCATTER, float(np.sqrt(np.mean(np.square(logs))))) if logs else 0.7


def _ranged(value: float, scatter: float) -> tuple[float, float, float]:
    factor = math.exp(1.645 * scatter)
    return value, value / factor, value * factor


def in_words(found: Mapping) -> str:
    """A forecast, as `Forecast.to_json` has it, in a sentence: what is to be made, and how long and how much it takes, each with
    nine in ten between the brackets."""
    if not found["made"]:
        return "all is in the store: seconds"
    (time, *times), (size, *sizes), (count, *counts) = found["seconds"], found["bytes"], found["samples"]
    return (f"{found['made']} of {found['cells']} cells to make, {found['references']} references of "
            f"{_samples(count)} [{' … '.join(map(_samples, counts))}] samples in all: "
            f"{in_minutes(time)} [{' … '.join(map(in_minutes, times))}], "
            f"{_megabytes(size)} [{' … '.join(map(_megabytes, sizes))}]")  # fmt: skip


def in_minutes(seconds: float) -> str:
    """As a person says it: 50 s, 2 min 05 s, 1.2 h."""
    whole = round(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s" if whole < 3600 else f"{whole / 3600:.1f} h"


def _samples(count: float) -> str:
    return f"{count / 1e9:.3g} billion" if count >= 1e9 else f"{count / 1e6:.3g} million"


def _megabytes(size: float) -> str:
    return f"{size / 1e6:.3g} MB"
