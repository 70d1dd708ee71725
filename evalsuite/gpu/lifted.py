"""A technique's picture with its assumptions given up one after another, in float64: the middle rungs of an error ledger.

Each rung is a formula of the surface alone (`techniques.base.Lift`), evaluated at the very sub-samples that the technique's own
picture is drawn at, and averaged as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import environment
from evalsuite.gpu.surfaces import Surfaces, surfaces
from evalsuite.gpu.techniques.base import KERNEL, REPRESENTATION, Lift, Technique
from evalsuite.scene.model import Environment, Material, Scene


@dataclass(frozen=True, eq=False)
class Lifted:
    """causes: what each picture lifts beyond the one before it, from the technique's own towards the BRDF's integral. images:
    (H, W, 3) float64, one a cause; 0 where a pixel shows anything but scored surfaces. tolerances: of each, relative to
    itself and to what it changes.
    swapped: with the filter made exact on the technique's own texels, so that `environment representation` is lifted after
    `filter kernel`, whose place in causes is `kernel`; None where a technique does not say how. note: why there are none, or
    empty."""

    causes: tuple[str, ...]
    images: tuple[NDArray[np.float64], ...]
    tolerances: tuple[tuple[float, float], ...]
    swapped: NDArray[np.float64] | None = None
    kernel: int = -1
    note: str = ""


def lifted(scene: Scene, technique: Technique, settings: Mapping[str, object], supersample: int) -> Lifted:
    """The rungs of a technique's picture of a scene. settings: all of its parameters, resolved."""
    scored = technique.scored_materials(scene)
    rungs = technique.lifted(settings)
    rungs = tuple(rung for rung in rungs if any(rung.made_by(_parameters(scene.materials[i])) for i in scored))
    if not rungs:
        return Lifted((), (), ())
    for index in scored:
        if scene.materials[index].normal_map is not None or scene.materials[index].textures:
            note = f"{scene.materials[index].id} has a bitmap, for which formulas have no float64 twin: the technique is one rung"
            return Lifted((), (), (), note=note)
    env = environment.of(scene.environment).environment  # the one that earlier calls derived their maps from
    coarse, kernel = _swapped(technique, rungs, env, settings)
    sums = [np.zeros((*scene.camera.size[::-1], 3)) for _ in rungs]
    swapped = None if coarse is None else np.zeros_like(sums[0])
    hits, count, few = np.zeros(sums[0].shape[:2], int), 0, 0
    for seen in surfaces(scene, supersample, settings["face_size"] if "bias" in settings else None):
        on_diagonal = count % (supersample + 1) == 0
        count, few = count + 1, few + on_diagonal
        for index in scored:
            here = seen.material == index
            hits += here
            before = None
            for total, rung in zip(sums, rungs, strict=True):
                if rung.smooth and not on_diagonal:
                    continue
                value = _radiance(rung, env, seen, here, scene.materials[index], settings)
                total[here] += value - before if rung.smooth else value
                before = value
            if coarse is not None:
                swapped[here] += _radiance(rungs[kernel], coarse, seen, here, scene.materials[index], settings)
    whole = (hits == count)[..., None]
    images: list[NDArray[np.float64]] = []
    for total, rung in zip(sums, rungs, strict=True):
        images.append(images[-1] + np.where(whole, total / few, 0.0) if rung.smooth else np.where(whole, total / count, 0.0))
    return Lifted(
        tuple(rung.cause for rung in rungs),
        tuple(images),
        tuple((rung.tolerance, rung.of_change) for rung in rungs),
        None if swapped is None else np.where(whole, swapped / count, 0.0),
        kernel,
    )


def _swapped(
    technique: Technique, rungs: tuple[Lift, ...], env: Environment, settings: Mapping
) -> tuple[Environment | None, int]:
    """The environment as the technique's texels hold it, where the filter is lifted right after them, and the filter's place."""
    causes = [rung.cause for rung in rungs]
    kernel = causes.index(KERNEL) if KERNEL in causes else -1
    if technique.represented is None or kernel < 1 or causes[kernel - 1] != REPRESENTATION:
        return None, -1
    return technique.represented(env, settings), kernel


def _parameters(material: Material) -> dict[str, object]:
    return {**material.parameters, "plugin": material.plugin}


def _radiance(
    rung: Lift, env: Environment, seen: Surfaces, here: NDArray[np.bool_], material: Material, settings: Mapping[str, object]
) -> NDArray[np.float64]:
    own = dict(settings) if seen.lod is None else {**settings, "lambda": seen.lod[here]}
    return rung.radiance(env, seen.normal[here], seen.to_view[here], _parameters(material), own)
