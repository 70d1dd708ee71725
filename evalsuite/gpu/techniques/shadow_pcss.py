"""Soft shadows from one shadow map a light: percentage-closer soft shadows (Fernando 2005)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, shadow
from evalsuite.gpu.techniques.base import Float, Frame, Parameter, PassInputs, Prepared, Settings, Technique
from evalsuite.gpu.techniques.shadow_sampled import MAP_SIZE
from evalsuite.scene.model import Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """Lights, prefiltered rest, and a map for each light."""
    from evalsuite.gpu.shadow.lighting import lighting
    from evalsuite.gpu.shadow.maps import ShadowMaps, padded

    lights = lighting(env, settings, scene)
    count, size = len(lights.directions), int(settings["map_size"])
    defines = {**lights.defines, "BATCH": count, "BLOCKER_TAPS": settings["blocker_taps"], "FILTER_TAPS": settings["filter_taps"]}
    if not count:
        return Prepared(lights.uniforms, lights.textures, lights.prepare_ms, lights.notes, defines=defines)
    maps = ShadowMaps(scene, size, count)
    while maps.batch < count:  # they have to be there all at once
        size //= 2
        maps = ShadowMaps(scene, size, count)
    fit = maps.fit(lights.directions)
    fixed = {**maps.uniforms(fit), "light_tan": padded(np.tan(lights.radii), count)}

    def before_pass(frame: Frame, clip: Float) -> PassInputs:
        turn = 2.0 * np.pi * frame.index / frame.subsamples
        return PassInputs({**fixed, "turn": turn}, {"map_depths": maps.depths}, maps.draw(fit))

    notes = (*lights.notes, f"one shadow map of {size}² a light, in each frame")
    return Prepared(lights.uniforms, lights.textures, lights.prepare_ms, notes, defines=defines, before_pass=before_pass)


TECHNIQUE = Technique(
    id="shadow-pcss",
    title="Area lights with percentage-closer soft shadows, prefiltered rest",
    paper="Fernando: Percentage-Closer Soft Shadows, 2005, for the lights of a decomposed environment map",
    equations="R = (z − z̄_blocker) tan α; V = part of the disc of radius R in the shadow map with nothing before the receiver",
    parameters=(
        *shadow.MATERIAL,
        Parameter("blocker_taps", 24, "looks for blockers, a light and pixel", "technique", common.integer(1, 256), "1 to 256"),
        Parameter("filter_taps", 32, "looks over the penumbra's disc, a light and pixel", "technique", common.integer(1, 256),
                  "1 to 256"),
        MAP_SIZE,
        *shadow.DECOMPOSITION,
    ),
    assumptions=(
        *shadow.ASSUMPTIONS[:2],
        "All of a light's radiance comes from its centre; its disc counts for visibility only.",
        "Blockers lie in one plane, at the mean depth of those that the light's centre sees before the receiver.",
        "What is narrower than a shadow map's texel, or falls between the taps, casts no shadow.",
        shadow.ASSUMPTIONS[2],
    ),
    stands_for=shadow.STANDS_FOR,
    target_bsdf=common.named_target,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("lighting.glsl", "shadow_maps.glsl"),
    prepare=prepare,
    twin=shadow.twin,
    target="direct",
    casts_shadows=True,
    free=(shadow.FREE_LIGHTS,),
    chain=lambda settings: (*shadow.TO_CENTRES, ("discs-centre", "percentage-closer filtering")),
)  # fmt: skip
