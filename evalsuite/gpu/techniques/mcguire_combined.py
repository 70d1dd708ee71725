"""Both terms of McGuire et al. 2013, Listing 1: the coarsest MIP level about n, and the exponent's level about r."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, diffuse_topmip, glossy_mcguire, lifts
from evalsuite.gpu.techniques.base import Float, Settings, StandsFor, Technique
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_L times the look-up in the 1 × 1 level about n, plus k_G times the trilinear one about r at level m(s) + c."""
    base = {"reflectance": material.get("diffuse_reflectance", 0.0)}
    matte = diffuse_topmip.twin(environment, normals, to_view, base, settings)
    return matte + glossy_mcguire.twin(environment, normals, to_view, material, settings)


def _exact(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_L E(n)/π plus k_G times the whole lobe cos^s about r."""
    matte = lifts.exact_diffuse(environment, normals, to_view, material, settings)
    return matte + lifts.exact_glossy(environment, normals, to_view, material, settings)


TECHNIQUE = Technique(
    id="mcguire-combined",
    title="Blinn-Phong from one MIP chain, diffuse and glossy",
    paper=glossy_mcguire.TECHNIQUE.paper,
    equations="Listing 1: L_o = k_L · textureLod(env, n, maxLevel) + k_G · textureLod(env, r, m), m = log₂(w√3) − ½ log₂(s + 1)",
    parameters=(
        common.material_parameter("exponent", 50.0, "Blinn-Phong exponent s"),
        common.material_parameter("specular_reflectance", (0.5, 0.5, 0.5), "glossy coefficient k_G"),
        common.material_parameter("diffuse_reflectance", (0.5, 0.5, 0.5), "Lambertian coefficient k_L"),
        common.LOD_OFFSET,
        common.BELOW_TOP,
        common.FACE_SIZE,
    ),
    assumptions=tuple(dict.fromkeys(diffuse_topmip.TECHNIQUE.assumptions + glossy_mcguire.TECHNIQUE.assumptions)),
    stands_for={
        "blinnphong": StandsFor("blinnphong's exponent s, k_G and k_L as they are", common.lobe_uniforms),
        "phong": StandsFor("phong's exponent N as s, its reflectances as they are", common.lobe_uniforms),
    },
    target_bsdf=lambda settings: {
        "type": "blinnphong",
        **{name: settings[name] for name in ("exponent", "specular_reflectance", "diffuse_reflectance")},
    },
    shader=Path(__file__).with_suffix(".glsl"),
    library=("mcguire.glsl",),
    prepare=common.prepare_cube,
    twin=twin,
    fill=common.fill_face_size,
    lifts=lambda settings: lifts.of_box_mips(twin, _exact),
    represented=lifts.as_cube,
    free=(common.FREE_LOD_OFFSET, common.FREE_BELOW_TOP),
)
