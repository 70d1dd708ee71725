"""Glossy reflection from hardware's box-filtered MIPs at an explicit level: `glossy-boxmip` without the hardware's λ."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from evalsuite.gpu.techniques import common, glossy_boxmip, glossy_mcguire, lifts
from evalsuite.gpu.techniques.base import Settings, StandsFor, Technique
from evalsuite.math import phong
from evalsuite.scene.model import Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def fit(scene: Scene, env: GpuEnvironment, settings: Settings) -> dict[str, float] | None:
    """The Phong exponent that comes nearest to what the look-ups at level m + c returned."""
    sampler = env.cube(settings["face_size"]).sampler
    level = float(phong.exponent_to_lod(settings["exponent"], settings["face_size"])) + settings["lod_offset"]
    return glossy_boxmip.fit_look_up(scene, env, settings, lambda r, lod: sampler.lookup(r, level), TECHNIQUE)


TECHNIQUE = Technique(
    id="glossy-boxmip-lod",
    title="Glossy, box-filtered MIPs at an explicit level",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §4.2, with the level given outright",
    equations="L_p(r) = k_s · textureLod(env, r, m + c), m = log₂(w√3) − ½ log₂(N + 1), c = 0: a mean texel has the lobe's "
    "2π/(N + 1)",
    parameters=(
        common.material_parameter("exponent", 50.0, "Phong exponent N"),
        common.material_parameter("specular_reflectance", common.WHITE, "k_s, the lobe's integral"),
        common.LOD_OFFSET,
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "A box in texture space stands for a cosine-power lobe, the same box whatever the pixel's own footprint.",
        "Each face is filtered by itself, so that faces show at low exponents.",
        "The tangent plane cuts nothing off the lobe.",
    ),
    stands_for={"phong": StandsFor("N and k_s as they are", common.lobe_uniforms, common.no_diffuse_part)},
    target_bsdf=common.lobe_target("phong"),
    shader=Path(__file__).with_suffix(".glsl"),
    library=("mcguire.glsl",),
    prepare=common.prepare_cube,
    twin=glossy_mcguire.twin,  # McGuire et al. use the same level, for another BRDF
    twin_settings={"face_size": 32},
    fill=common.fill_face_size,
    fit=fit,
    lifts=glossy_mcguire.TECHNIQUE.lifts,
    represented=lifts.as_cube,
    free=(common.FREE_LOD_OFFSET,),
)
