"""Kautz, Daubert and Seidel's whole method (Eq 8, §5.2): SH9 below, box-filtered MIPs above, Schlick's F between, in one pass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import common, glossy_boxmip, lifts
from evalsuite.gpu.techniques.base import Float, Lift, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import fresnel, fresnel_lobe, phong, sh
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

_OWN = ("fresnel_normal", "diffuse_reflectance", "exponent")


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The cubemap with the hardware's MIPs and L_i of its level 0."""
    cube = common.prepare_cube(env, settings, scene)
    uniforms, elapsed = common.sh9(env, settings["face_size"])
    return replace(cube, uniforms={**cube.uniforms, **uniforms}, prepare_ms=cube.prepare_ms + elapsed)


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size, and bias from exponent or exponent from bias as in `glossy-boxmip`; a roughplastic's α says the exponent."""
    first = [scene.materials[i].parameters for i in sorted(TECHNIQUE.scored_materials(scene))[:1]]
    alphas = [p["alpha"] for p in first if "alpha" in p and not settings["given"] & {"exponent", "bias"}]
    filled = {"exponent": _exponent(alphas[0])} if alphas else {}
    return filled | glossy_boxmip.fill(scene, {**settings, **filled}, TECHNIQUE)


def _exponent(alpha: object) -> float:
    """Phong exponent about r of a microfacet α."""
    return float(phong.half_vector_to_phong_exponent(phong.alpha_to_exponent(float(alpha))))


def _uniforms(material: Material, settings: Settings) -> dict[str, object]:
    return {
        "fresnel_normal": common.rgb(_normal_reflectance(material.parameters)),
        "specular_reflectance": common.colour(material, "specular_reflectance"),
        "diffuse_reflectance": common.colour(material, "diffuse_reflectance", 0.0),
        "bias": settings["bias"],
    }


def _normal_reflectance(parameters: Settings) -> object:
    """f_λ as stated, or that of a roughplastic's η."""
    return parameters["fresnel_normal"] if "eta" not in parameters else fresnel.eta_to_normal_reflectance(parameters["eta"])


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """(1 − F) L_d(n) + F k_s L_p(r), L_p as `glossy-boxmip`'s at the λ of each pixel."""
    cosine = np.clip((normals * to_view).sum(-1, keepdims=True), 0.0, 1.0)
    weight = fresnel.fresnel_schlick(cosine, common.rgb(_normal_reflectance(material)))
    irradiance = sh.irradiance(common.twin_sh9(environment, settings["face_size"]), normals)
    matte = np.asarray(common.rgb(material.get("diffuse_reflectance", 0.0))) / np.pi * irradiance
    return (1.0 - weight) * matte + weight * glossy_boxmip.twin(environment, normals, to_view, material, settings)


def _exact(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """(1 − F) k_d E(n)/π + F k_s times the whole lobe about r."""
    cosine = np.clip((normals * to_view).sum(-1, keepdims=True), 0.0, 1.0)
    weight = fresnel.fresnel_schlick(cosine, common.rgb(_normal_reflectance(material)))
    lobe = {"exponent": settings["exponent"], "specular_reflectance": material.get("specular_reflectance", 1.0)}
    matte = lifts.exact_diffuse(environment, normals, to_view, material, settings)
    return (1.0 - weight) * matte + weight * lifts.exact_glossy(environment, normals, to_view, lobe, settings)


def _inside(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_d ∫ (1 − F(n·l)) (n·l)₊/π L dl + k_s times the whole lobe about r with F(v·h) in its integral."""
    f, exponent = common.rgb(_normal_reflectance(material)), float(settings["exponent"])
    cosine = np.clip((normals * to_view).sum(-1, keepdims=True), 0.0, 1.0)
    lobe = {"exponent": exponent, "specular_reflectance": material.get("specular_reflectance", 1.0)}
    glossy = fresnel.fresnel_schlick(cosine, f) * lifts.exact_glossy(environment, normals, to_view, lobe, settings)
    specular = np.asarray(common.rgb(lobe["specular_reflectance"]))
    glossy += specular * lifts.within_lobe(environment, normals, to_view, exponent, ("schlick", f))
    matte = np.asarray(common.rgb(material.get("diffuse_reflectance", 0.0)))
    return matte * lifts.exact_entering(environment, normals, ("schlick", f)) + glossy


def _lifts(settings: Settings) -> tuple[Lift, ...]:
    rungs = lifts.of_box_mips(twin, _exact)
    wide = settings["exponent"] is not None and settings["exponent"] < fresnel_lobe.LOWEST_EXPONENT
    return rungs if wide else (*rungs, lifts.fresnel_inside(_inside, _is_coat))


def _is_coat(material: Settings) -> bool:
    """`kautz` itself takes F outside, as the paper does."""
    return material["plugin"] == "roughplastic"


def _unit(value: object) -> tuple[float, float, float]:
    colour = common.rgb(value)
    if max(colour) > 1:
        raise ValueError(value)
    return colour


def target_bsdf(settings: Settings) -> dict[str, object]:
    """The paper's own model, or Mitsuba's rough coated base with f_λ and N as η and α. Raises EvalsuiteError where there is no
    such η."""
    if settings["bsdf"] == "kautz":
        return {"type": "kautz", **{name: settings[name] for name in _OWN}}
    red, *others = common.rgb(settings["fresnel_normal"])
    if any(other != red for other in others) or not 0.0 < red < 0.9:
        raise EvalsuiteError("kautz-combined, parameter fresnel_normal", str(settings["fresnel_normal"]),
                             "one number above 0 and below 0.9 for bsdf=roughplastic, which has one real η")  # fmt: skip
    return {
        "type": "roughplastic",
        "int_ior": float(fresnel.normal_reflectance_to_eta(red)),
        "ext_ior": 1.0,
        "alpha": float(phong.exponent_to_alpha(phong.phong_to_half_vector_exponent(settings["exponent"]))),
        "distribution": "beckmann",
        "diffuse_reflectance": settings["diffuse_reflectance"],
    }


TECHNIQUE = Technique(
    id="kautz-combined",
    title="Diffuse SH9 and box-filtered MIPs under Schlick's Fresnel term, one pass",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, Eq 8 and §5.2",
    equations="Eq 8: L_o = (1 − F) L_d(n) + F L_p(r), F = f_λ + (1 − f_λ)(1 − r·n)⁵, L_p = texture(env, r, bias b)",
    parameters=(
        Parameter("bsdf", "kautz", "the truth: the paper's own model, or Mitsuba's roughplastic with f_λ and N as η and α",
                  "material", common.choice("kautz", "roughplastic"), "kautz or roughplastic"),
        Parameter("fresnel_normal", (0.1, 0.1, 0.1), "f_λ, reflectance at normal incidence", "material", _unit,
                  "a colour between 0 and 1"),
        common.material_parameter("diffuse_reflectance", (0.5, 0.5, 0.5), "albedo k_d"),
        *(p for p in glossy_boxmip.TECHNIQUE.parameters if p.name in ("exponent", "bias", "face_size")),
    ),
    assumptions=(
        "F(n·v) outside the integral stands for F at each half vector: exact for a narrow lobe alone. For f_λ = 0.03 at "
        "n·v = 0.15 the lobe's mean of F(h·v) is 27 % less at N = 20, 0.3 % less at N = 500; kautz takes F outside as the paper "
        "does, roughplastic inside.",
        "Harmonics above degree 2 do not matter to irradiance.",
        *glossy_boxmip.TECHNIQUE.assumptions,
    ),
    stands_for={
        "kautz": StandsFor("f_λ and k_d as they are; N and b matched by solid angle over the picture", _uniforms),
        "roughplastic": StandsFor(
            "f_λ = ((η − 1)/(η + 1))²; N = s/4, s = 2/α² − 2, and b matched by solid angle over the picture; k_d and k_s as they "
            "are. What happens inside the coat is left out: Mitsuba's model loses the more there the larger α and η", _uniforms,
        ),
    },
    target_bsdf=target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("dielectric.glsl", "sh.glsl"),
    prepare=prepare,
    twin=twin,
    resolves=True,
    fill=fill,
    fit=lambda scene, env, settings: glossy_boxmip.fit(scene, env, settings, TECHNIQUE),
    free=(common.FREE_BIAS,),
    twin_settings=glossy_boxmip.TECHNIQUE.twin_settings,
    twin_bound=glossy_boxmip.TECHNIQUE.twin_bound,
    twin_bound_reason=glossy_boxmip.TECHNIQUE.twin_bound_reason,
    lifts=_lifts,
    represented=lifts.as_cube,
)  # fmt: skip
