"""The surface that each sub-sample of a picture sees, for formulas that are evaluated in float64 instead of drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import camera, programs
from evalsuite.gpu.passes import Draw, Stage
from evalsuite.gpu.reflection import reflection
from evalsuite.math.pixel import subsamples
from evalsuite.scene.model import Scene

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surfaces:
    """One sub-sample of every pixel. normal, to_view: (H, W, 3) unit, world. material: (H, W) index into Scene.materials, −1
    where nothing is hit. lod: (H, W) hardware's λ for a cubemap before any bias, or None where none was asked for."""

    normal: Float
    to_view: Float
    material: NDArray[np.int64]
    lod: Float | None


def surfaces(scene: Scene, supersample: int, lod_face_size: int | None = None) -> Iterator[Surfaces]:
    """What the GPU shades in each of the supersample² passes of a picture. lod_face_size: of the cubemap that λ is for."""
    stage = Stage(scene)
    program = programs.program((programs.part("surface.vert"),), (programs.part("gbuffer.frag"),))
    draws = [[Draw(program, {"material": float(i), "two_sided": m.two_sided})] for i, m in enumerate(scene.materials)]
    eye, everything = camera.position(scene.camera), frozenset(range(len(scene.materials)))
    for place in subsamples(supersample):
        stage.run(place, draws)
        geometry, position = stage.read(0).astype(np.float64), stage.read(1).astype(np.float64)
        normal, to_view = geometry[..., :3], eye - position[..., :3]
        normal = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-30)
        to_view = to_view / np.maximum(np.linalg.norm(to_view, axis=-1, keepdims=True), 1e-30)
        lod = None if lod_face_size is None else reflection(scene, lod_face_size, everything, place)[1].astype(np.float64)
        yield Surfaces(normal, to_view, position[..., 3].astype(np.int64) - 1, lod)
