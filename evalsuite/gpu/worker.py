"""What the GPU worker process does: plain functions of picklable arguments. OpenGL is touched only when one is called."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from evalsuite.gpu.drawing import Drawing
from evalsuite.gpu.registry import find
from evalsuite.scene.model import GBuffer, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.lifted import Lifted


def render(scene: Scene, technique_name: str, parameters: Mapping[str, object], supersample: int = 4, seed: int = 0) -> Drawing:
    """One GPU picture; see `gpu.draw.draw`."""
    from evalsuite.gpu.draw import draw

    return draw(scene, find(technique_name), parameters, supersample, seed)


def lifted(scene: Scene, technique_name: str, settings: Mapping[str, object], supersample: int = 4) -> Lifted:
    """A technique's picture with its assumptions lifted one by one; see `gpu.lifted.lifted`."""
    from evalsuite.gpu.lifted import lifted

    technique = find(technique_name)
    typed = {**settings, **technique.parse(settings)}  # what a store has kept has lists for colours
    return lifted(scene, technique, typed, supersample)


def gbuffer(scene: Scene, supersample: int = 4) -> GBuffer:
    """Coverage, depth, normals, positions and background; see `gpu.gbuffer.gbuffer`."""
    from evalsuite.gpu.gbuffer import gbuffer

    return gbuffer(scene, supersample)


def resolve(scene: Scene, technique_name: str, parameters: Mapping[str, object]) -> dict[str, object]:
    """All parameters of a technique, both kinds, filled in for a scene: what the reference's target is chosen by.

    What is not given comes from the scene's own subject where that is of the target's plugin, else from the defaults;
    `glossy-boxmip` fills bias from exponent or exponent from bias.
    """
    return find(technique_name).resolved(scene, parameters)


def probe() -> dict[str, object]:
    """What this machine's OpenGL is; raises MachineLacks."""
    from evalsuite.gpu import context

    return context.probe()
