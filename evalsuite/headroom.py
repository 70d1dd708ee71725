"""A cell's headroom: its free parameters searched with the same reference, each by itself, the others as the cell has them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.headroom_search import Range, next_value
from evalsuite.gpu.techniques.base import FreeParameter, Technique
from evalsuite.lights.model import DecompositionSettings
from evalsuite.plan import DISCS
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import digest, package_versions, source_digest

if TYPE_CHECKING:
    from evalsuite.steps import Steps

Entry = tuple[Path, str]


def free_parameters(technique: Technique, target: str) -> list[FreeParameter]:
    """Those that may be searched: what also takes the truth apart (targets discs*) moves the truth along and is left out."""
    decides_truth = vars(DecompositionSettings()) if target in DISCS else {}
    return [free for free in technique.free if free.name not in decides_truth]


def headroom(
    steps: Steps,
    free: FreeParameter,
    source: SceneSource,
    technique: Technique,
    parameters: Mapping,
    filled: Mapping,
    reference: Entry,
    coverage: NDArray[np.float32],
) -> dict:
    """One entry of `cells[].headroom`: see docs/headroom.md. parameters: the cell's; filled: as resolved when it was drawn.

    Candidates are entries of the store like any picture, so a killed search continues."""
    where = _range(technique, free, filled)
    place = dict(parameters)
    start = steps.image(source, technique, place | {free.name: _plain(where, where.published)})
    code = [source_digest("compare", "headroom.py"), package_versions("numpy")]
    key = digest([start[3], reference[1], vars(where), free.name, coverage, *code])

    def make() -> tuple[Path, dict]:
        folders: dict[float, str] = {}
        errors: dict[float, float] = {}
        while (value := next_value(where, errors)) is not None:
            steps.progress.step(f"headroom {source.path.stem}, {technique.id}: {free.name} = {value:.4g}")
            folder, *_ = steps.image(source, technique, place | {free.name: _plain(where, value)})
            folders[value] = str(folder)
            errors[value] = steps.workers.compare.call(
                "evalsuite.compare.headroom_cell:error_of", str(folder), str(reference[0]), coverage
            )
        found = steps.workers.compare.call(
            "evalsuite.compare.headroom_cell:headroom_of", where, folders, str(reference[0]), coverage
        )
        return steps.store.put("headroom", key, found)

    found = steps.once("headroom", key, make)[1]
    return {"parameter": free.name, "unit": free.unit, "choice": free.published, "whole": free.whole} | dict(found)


def _range(technique: Technique, free: FreeParameter, filled: Mapping) -> Range:
    default = technique.defaults()[free.name]
    if default is None:
        value = float(filled[free.name])
        return Range(value + free.low, value + free.high, free.step, value)
    return Range(free.low, free.high, free.step, float(default), free.whole)


def _plain(where: Range, value: float) -> float | int:
    return int(value) if where.whole else value
