"""A dielectric's mirror reflection plus a Lambert part (Heidrich, course notes, §3.1.1, centre row of Fig 8)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, dielectric
from evalsuite.gpu.techniques.base import Float, Settings, StandsFor, Technique
from evalsuite.scene.model import Environment, Material


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) L_m(r) + L_d(n)."""
    _, mirror, matte = dielectric.twin_parts(environment, normals, to_view, material, settings)
    return mirror + matte


LIFTS = dielectric.lifted(lambda weight, mirror, matte, material: mirror + matte)


def _is_a_coat(material: Material) -> str | None:
    if material.parameters.get("combine") == "blend" and common.no_diffuse_part(material):
        return "fresnelmirror with combine = blend"
    return None


TECHNIQUE = Technique(
    id="fresnel-add",
    title="Fresnel-weighted mirror plus diffuse",
    paper=dielectric.PAPER,
    equations="L_o = F·L_m + L_d, F of Eq 13, L_m = texture(env, r), L_d = (k_d/π) Σ Â_i L_i Y_i(n)",
    parameters=(dielectric.ETA, dielectric.DIFFUSE, dielectric.FACE_SIZE),
    assumptions=(
        dielectric.DISTANT,
        dielectric.LOOK_UP,
        dielectric.HARMONICS,
        "Light that the surface reflects reaches the Lambert part as well: energy is not conserved once F + k_d > 1.",
    ),
    stands_for={"fresnelmirror": StandsFor("fresnelmirror as it is, F(n·v) of its η", dielectric.uniforms, _is_a_coat)},
    target_bsdf=dielectric.target("add"),
    shader=Path(__file__).with_suffix(".glsl"),
    library=dielectric.LIBRARY,
    prepare=dielectric.prepare,
    twin=twin,
    twin_settings=dielectric.TWIN_SETTINGS,
    fill=dielectric.fill,
    lifts=lambda settings: LIFTS,
)  # fmt: skip
