"""Reflected directions and hardware's level of detail for them, per pixel, for techniques that lean on the hardware's λ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import camera, programs
from evalsuite.gpu.passes import Draw, Stage
from evalsuite.scene.model import Scene


def reflection(
    scene: Scene, face_size: int, materials: frozenset[int], subsample: tuple[float, float] = camera.CENTRE
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """At a sub-sample of each pixel: r (H, W, 3) world, λ (H, W) for a cubemap with faces face_size² before any bias, and the
    (H, W) mask of pixels that show one of `materials` (indices into Scene.materials) from a lit side."""
    stage = Stage(scene)
    program = programs.program(
        (programs.part("surface.vert"),), (programs.part("library/face_lod.glsl"), programs.part("reflection.frag"))
    )
    draws = [
        [Draw(program, {"two_sided": m.two_sided, "scored": float(i in materials), "env_face_size": float(face_size)})]
        for i, m in enumerate(scene.materials)
    ]
    stage.run(subsample, draws)
    both = stage.read(0)
    return both[..., :3], both[..., 3], stage.read(1)[..., 0] > 0
