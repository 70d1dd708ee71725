"""Prefiltered light of the whole map and no shadow at all: what the shadow techniques have to better."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from evalsuite.gpu.techniques import common, shadow
from evalsuite.gpu.techniques.base import ARITHMETIC, REPRESENTATION, Lift, Prepared, Settings, Technique
from evalsuite.math import lobe_field
from evalsuite.scene.model import Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The map convolved with the cosine and, where the scene has phong materials, with their lobe."""
    from evalsuite.gpu.shadow.lighting import ambient

    textures, milliseconds = ambient(env, scene)
    return Prepared({}, textures, milliseconds, defines={"LIGHTS": 0})


TECHNIQUE = Technique(
    id="shadow-none",
    title="Prefiltered ambient light, no shadows",
    paper=shadow.PAPER,
    equations="L_o = (k_d/π) E(n) + k_s ∫ lobe about r · L(l) dl, both tabulated",
    parameters=shadow.MATERIAL,
    assumptions=("The environment is distant and nothing occludes it.", shadow.ASSUMPTIONS[-1]),
    stands_for=shadow.STANDS_FOR,
    target_bsdf=common.named_target,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("lighting.glsl",),
    prepare=prepare,
    twin=shadow.twin_ambient,
    target="direct",
    twin_bound=3.5e-3,
    twin_bound_reason="six-point interpolation across a lone sun's horizon, where the clamped cosine has its kink, and the maps' "
    "bilinear look-ups",
    lifts=lambda settings: (
        Lift(ARITHMETIC, shadow.twin_ambient),
        Lift(REPRESENTATION, shadow.exact_ambient, lobe_field.TOLERANCE),
    ),
)
