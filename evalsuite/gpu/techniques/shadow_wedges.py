"""Soft shadows of the environment's lights by penumbra wedges; the rest of the map is unshadowed ambient light."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from evalsuite.gpu.techniques import common, shadow
from evalsuite.gpu.techniques.base import Parameter, Prepared, Settings, Technique
from evalsuite.scene.model import Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """Lights and prefiltered rest; the wedges themselves are drawn before each pass."""
    from evalsuite.gpu.shadow.lighting import lighting
    from evalsuite.gpu.shadow.wedges import Wedges

    lights = lighting(env, settings, scene)
    before = None
    notes = lights.notes
    if len(lights.directions):
        wedges = Wedges(scene, lights.directions, lights.radii, settings["silhouettes"] == "centre")
        before = wedges.before_pass
        notes += (f"wedges of {wedges.edges} edges of {wedges.faces} triangles, found anew in each frame",)
    return Prepared(lights.uniforms, lights.textures, lights.prepare_ms, notes, defines=lights.defines, before_pass=before)


TECHNIQUE = Technique(
    id="shadow-wedges",
    title="Area lights with penumbra wedges, prefiltered rest",
    paper=shadow.PAPER,
    equations="L_o = ambient(remainder) + Σ V_i E_i f (n·D_i)₊; V = 1 − clamp(W₀ − Σ (θ − q₀×q₁)/2π)",
    parameters=(
        *shadow.MATERIAL,
        Parameter("silhouettes", "receiver", "whose silhouette edges bound the penumbra: those that each pixel sees, or, as "
                  "published, those seen from the light's centre", "technique",
                  common.choice("receiver", "centre"), "receiver or centre"),
        *shadow.DECOMPOSITION,
    ),
    assumptions=(
        *shadow.ASSUMPTIONS[:2],
        "All of a light's radiance comes from its centre; its disc counts for visibility only.",
        "Where occluders overlap before a light, what they cover adds up.",
        "Of an open mesh, the larger of what faces the light and what turns away from it casts.",
        shadow.ASSUMPTIONS[2],
    ),
    stands_for=shadow.STANDS_FOR,
    target_bsdf=common.named_target,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("lighting.glsl",),
    prepare=prepare,
    twin=shadow.twin,
    target="direct",
    casts_shadows=True,
    free=(shadow.FREE_LIGHTS,),
    chain=lambda settings: (*shadow.TO_CENTRES, ("discs-centre", "wedge algorithm")),
)  # fmt: skip
