"""What the camera sees, from OpenGL: the same sub-sample grid as the drawing's, for the scene-equivalence certificate."""

from __future__ import annotations

import numpy as np

from evalsuite.gpu import environment, programs
from evalsuite.gpu.passes import Draw, Stage, background_draw
from evalsuite.math.pixel import subsamples
from evalsuite.scene.model import GBuffer, Scene


def gbuffer(scene: Scene, supersample: int = 4) -> GBuffer:
    """Geometry and background of a scene, averaged over the s × s grid. Raises EvalsuiteError for what cannot be drawn."""
    scene.require_drawable()
    stage = Stage(scene)
    program = programs.program((programs.part("surface.vert"),), (programs.part("gbuffer.frag"),))
    draws = [[Draw(program, {"material": float(i), "two_sided": m.two_sided})] for i, m in enumerate(scene.materials)]
    env = environment.of(scene.environment)
    sky = background_draw(env.latlong, env.uniforms)

    width, height = scene.camera.size
    coverage, depth = np.zeros((height, width)), np.zeros((height, width))
    material = np.zeros((len(scene.materials), height, width))
    normal, position, background = (np.zeros((height, width, 3)) for _ in range(3))
    grid = subsamples(supersample)
    for subsample in grid:
        stage.run(subsample, draws)
        geometry, place = stage.read(0).astype(np.float64), stage.read(1).astype(np.float64)
        hit = place[..., 3] > 0
        coverage += hit
        for index in range(len(material)):
            material[index] += place[..., 3] == index + 1
        normal += np.where(hit[..., None], geometry[..., :3], 0)
        depth += np.where(hit, geometry[..., 3], 0)
        position += np.where(hit[..., None], place[..., :3], 0)
        stage.run_background(subsample, sky)
        background += stage.read(0)[..., :3]

    hits = np.maximum(coverage, 1)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return GBuffer(*(x.astype(np.float32) for x in (
        coverage / len(grid), material / len(grid), depth / hits, normal, position / hits[..., None], background / len(grid)
    )))  # fmt: skip
