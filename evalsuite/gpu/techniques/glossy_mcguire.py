"""Glossy reflection from the MIP level that the exponent names (McGuire et al. 2013, second term of Listing 1)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import Float, Settings, StandsFor, Technique
from evalsuite.math import fresnel, phong
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_G (times F(n·v) for conductors) times the trilinear look-up about r at level m(s) + c, clamped to the chain."""
    cube = common.twin_cube(environment, settings["face_size"])
    exponent = material["exponent"] if "exponent" in material else phong.alpha_to_exponent(material["alpha"])
    level = phong.exponent_to_lod(exponent, cube.width) + settings.get("lod_offset", 0.0)
    radiance = cube.lookup(phong.reflect(to_view, normals), level)
    weight = np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
    if "eta" in material:
        cosine = (normals * to_view).sum(-1, keepdims=True)
        weight = weight * fresnel.fresnel_conductor(cosine, common.rgb(material["eta"]), common.rgb(material["k"]))
    return weight * radiance


TECHNIQUE = Technique(
    id="glossy-mcguire",
    title="Glossy, MIP level from the exponent",
    paper="McGuire, Evangelakos, Wilcox, Donow, Mara: Plausible Blinn-Phong Reflection of Standard Cube MIP-Maps, 2013",
    equations="Eq 1–12: m = log₂(w√3) − ½ log₂(s + 1); L_g = k_G · textureLod(env, r, m + c), c = 0",
    parameters=(
        common.material_parameter("exponent", 50.0, "Blinn-Phong exponent s"),
        common.material_parameter("specular_reflectance", common.WHITE, "glossy coefficient k_G"),
        common.LOD_OFFSET,
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "A trilinear look-up whose mean texel has the solid angle of cos^s about r stands for the lobe.",
        "cos^s about the half vector is as wide as cos^s about r (it is about that of exponent s/4).",
        "The tangent plane cuts nothing off the lobe.",
        "The normalisation (s + 8)/8 cancels against the cosine-weighted integral, so that the weight is k_G alone.",
        "Each face is filtered by itself.",
    ),
    stands_for={
        "blinnphong": StandsFor("blinnphong's exponent s as it is", common.lobe_uniforms, common.no_diffuse_part),
        "phong": StandsFor("phong's exponent N as s", common.lobe_uniforms, common.no_diffuse_part),
        "roughconductor": StandsFor(
            "roughconductor's α as s = 2/α² − 2 (equal peak of the normal distribution), Fresnel F(n·v) outside the integral",
            common.rough_conductor_uniforms,
        ),
    },
    target_bsdf=common.lobe_target("blinnphong"),
    shader=Path(__file__).with_suffix(".glsl"),
    library=("mcguire.glsl",),
    prepare=common.prepare_cube,
    twin=twin,
    twin_settings={"face_size": 32},
    fill=common.fill_face_size,
    lifts=lambda settings: (
        *lifts.of_box_mips(twin, lifts.exact_glossy),
        lifts.fresnel_inside(lifts.glossy_fresnel, lifts.has_fresnel),
    ),
    represented=lifts.as_cube,
    free=(common.FREE_LOD_OFFSET,),
)
