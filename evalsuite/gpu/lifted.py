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
    (H, W, 3) float64, one a cause; 0 where a pixel shows anything but scored surfaces. tolerances: of each, relative.
    swapped: with the filter made exact on the technique's own texels, so that `environment representation` is lifted after
    `filter kernel`; None where a technique does not say how. note: why there are none, or empty."""

    causes: tuple[str, ...]
    images: tuple[NDArray[np.float64], ...]
    tolerances: tuple[float, ...]
    swapped: NDArray[np.float64] | None = None
    note: str = ""


def lifted(scene: Scene, technique: Technique, settings: Mapping[str, object], supersample: int) -> Lifted:
    """The rungs of a technique's picture of a scene. settings: all of its parameters, resolved."""
    rungs = technique.lifted(settings)
    scored = technique.scored_materials(scene)
    if not rungs:
        return Lifted((), (), ())
    for index in scored:
        if scene.materials[index].normal_map is not None or scene.materials[index].textures:
            note = f"{scene.materials[index].id} has a bitmap, for which formulas have no float64 twin: the technique is one rung"
            return Lifted((), (), (), note=note)
    env = environment.of(scene.environment).environment  # the one that earlier calls derived their maps from
    coarse = _swapped(technique, rungs, env, settings)
    images = [np.zeros((*scene.camera.size[::-1], 3)) for _ in rungs]
    swapped = None if coarse is None else np.zeros_like(images[0])
    hits, count = np.zeros(images[0].shape[:2], int), 0
    for seen in surfaces(scene, supersample, settings["face_size"] if "bias" in settings else None):
        count += 1
        for index in scored:
            here = seen.material == index
            hits += here
            for image, rung in zip(images, rungs, strict=True):
                image[here] += _radiance(rung, env, seen, here, scene.materials[index], settings)
            if coarse is not None:
                swapped[here] += _radiance(rungs[-1], coarse, seen, here, scene.materials[index], settings)
    whole = (hits == count)[..., None]
    return Lifted(
        tuple(rung.cause for rung in rungs),
        tuple(np.where(whole, image / count, 0.0) for image in images),
        tuple(rung.tolerance for rung in rungs),
        None if swapped is None else np.where(whole, swapped / count, 0.0),
    )


def _swapped(technique: Technique, rungs: tuple[Lift, ...], env: Environment, settings: Mapping) -> Environment | None:
    """The environment as the technique's texels hold it, where representation and kernel are its last two rungs."""
    last = tuple(rung.cause for rung in rungs[-2:])
    if technique.represented is None or last != (REPRESENTATION, KERNEL):
        return None
    return technique.represented(env, settings)


def _radiance(
    rung: Lift, env: Environment, seen: Surfaces, here: NDArray[np.bool_], material: Material, settings: Mapping[str, object]
) -> NDArray[np.float64]:
    own = dict(settings) if seen.lod is None else {**settings, "lambda": seen.lod[here]}
    parameters = {**material.parameters, "plugin": material.plugin}
    return rung.radiance(env, seen.normal[here], seen.to_view[here], parameters, own)
