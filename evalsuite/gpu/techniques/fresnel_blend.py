"""A clear coat over a Lambert base, blended by the Fresnel term (Heidrich, course notes, §3.1.1, bottom row of Fig 8)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.gpu.techniques import common, dielectric, lifts
from evalsuite.gpu.techniques.base import FRESNEL, Float, Lift, Parameter, Settings, StandsFor, Technique
from evalsuite.math import lobe_field
from evalsuite.scene.model import Environment, Material

#: Mitsuba takes the diffuse reflection inside plastic's coat from a fitted polynomial of η. One minus it is 4 % short at 2.5
#: and negative from 4 on, where plastic's albedo is negative too; quadrature of Eq 13 gives 0.875 and 0.960 for the two.
PLASTIC_ETA = 2.5


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) L_m(r) + (1 − F(n·v)) L_d(n); F L_m + L_d where the material adds."""
    return _blend(*dielectric.twin_parts(environment, normals, to_view, material, settings), material)


def _blend(weight: Float, mirror: Float, matte: Float, material: Settings) -> Float:
    return mirror + (matte if material.get("combine") == "add" else (1.0 - weight) * matte)


def _inside(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) L(r) + k_d ∫ (1 − F(n·l)) (n·l)₊/π L dl."""
    _, mirror, _ = dielectric.without_texels(environment, normals, to_view, material, settings)
    factor = "dielectric", common.rgb(material["eta"])
    matte = np.asarray(common.rgb(material.get("diffuse_reflectance", 0.0)))
    return mirror + matte * lifts.exact_entering(environment, normals, factor)


def _is_coat(material: Settings) -> bool:
    """`fresnelmirror` itself takes F outside, as the notes do."""
    return material["plugin"] == "plastic"


LIFTS = (*dielectric.lifted(_blend), Lift(FRESNEL, _inside, lobe_field.TOLERANCE, made_by=_is_coat))


def target_bsdf(settings: Settings) -> dict[str, object]:
    """The paper's own model, or Mitsuba's coated base with the same η and albedo."""
    if settings["bsdf"] == "plastic":
        return {"type": "plastic", "int_ior": settings["eta"], "ext_ior": 1.0,
                "diffuse_reflectance": settings["diffuse_reflectance"]}  # fmt: skip
    return dielectric.target("blend")(settings)


def _fit_fails(material: Material) -> str | None:
    eta = float(material.parameters["eta"])
    if eta > PLASTIC_ETA:
        return f"plastic with η = {eta:g}: beyond {PLASTIC_ETA:g} Mitsuba's fit of the reflection inside the coat fails"
    return None


TECHNIQUE = Technique(
    id="fresnel-blend",
    title="Clear coat: Fresnel blending between mirror and diffuse",
    paper=dielectric.PAPER,
    equations="L_o = F·L_m + (1 − F)·L_d, F of Eq 13, L_m = texture(env, r), L_d = (k_d/π) Σ Â_i L_i Y_i(n)",
    parameters=(
        Parameter("bsdf", "fresnelmirror", "the truth: the paper's own model, or Mitsuba's plastic with the same η and k_d",
                  "material", common.choice("fresnelmirror", "plastic"), "fresnelmirror or plastic"),
        dielectric.ETA,
        dielectric.DIFFUSE,
        dielectric.FACE_SIZE,
    ),
    assumptions=(
        dielectric.DISTANT,
        dielectric.LOOK_UP,
        dielectric.HARMONICS,
        "F(n·v) outside the integral stands for the light that enters the coat: exact for the mirror, not for the Lambert base, "
        "whose light enters by 1 − F(n·l).",
        "Light leaves the coat as it came in: no reflection back down from inside, no 1/η² (Mitsuba's plastic has both).",
    ),
    stands_for={
        "fresnelmirror": StandsFor("fresnelmirror as it is, F(n·v) of its η; its `combine` too", dielectric.uniforms),
        "plastic": StandsFor("plastic's η, k_d and specular_reflectance as they are; what happens inside the coat left out",
                             dielectric.uniforms, _fit_fails),
    },
    target_bsdf=target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    library=dielectric.LIBRARY,
    prepare=dielectric.prepare,
    twin=twin,
    twin_settings=dielectric.TWIN_SETTINGS,
    fill=dielectric.fill,
    lifts=lambda settings: LIFTS,
)  # fmt: skip
