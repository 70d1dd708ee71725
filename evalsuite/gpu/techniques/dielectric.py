"""What the techniques with a Fresnel-weighted mirror share: its cubemap, and nine coefficients for the Lambert part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import ARITHMETIC, KERNEL, REPRESENTATION, Float, Lift, Parameter, Prepared, Settings, Twin
from evalsuite.gpu.techniques.mirror import FACE_SIZE
from evalsuite.gpu.techniques.mirror import fill_face_size as fill
from evalsuite.math import cubemap, fresnel, lobe_field, phong, sh
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

__all__ = ["ETA", "FACE_SIZE", "fill"]

#: As a `Twin`, but F (N, 1), F L_m (N, 3) and L_d (N, 3) apart.
Parts = Callable[[Environment, Float, Float, Settings, Settings], tuple[Float, Float, Float]]

PAPER = "Heidrich: Environment Maps and Their Applications (course notes), §3.1.1, Fig 8"
LIBRARY = ("dielectric.glsl", "sh.glsl")
ETA = Parameter("eta", 1.5, "relative index of refraction η", "material", common.number(0.01, 1e4), "a number from 0.01 to 10⁴")
DIFFUSE = common.material_parameter("diffuse_reflectance", (0.5, 0.5, 0.5), "albedo k_d of the Lambert part")
DISTANT = "The environment is distant and nothing occludes it."
LOOK_UP = "A bilinear look-up in cube texels resembles one in the map's own."
TWIN_SETTINGS = {"face_size": 32}  # resampling to the faces of a large map takes the float64 twin seconds
HARMONICS = "Harmonics above degree 2 do not matter to irradiance."


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The mirror's cubemap, and L_i."""
    cube = common.prepare_cube(env, settings, scene)
    uniforms, elapsed = common.sh9(env, _sh_face_size(settings, env.shape[1]))
    return replace(cube, uniforms={**cube.uniforms, **uniforms}, prepare_ms=cube.prepare_ms + elapsed)


def _sh_face_size(settings: Settings, map_width: int) -> int:
    """Of the cubemap that is projected: as fine as `diffuse-sh9`'s, no finer than the mirror's."""
    return min(settings["face_size"], cubemap.default_face_size(map_width))


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """`fresnelmirror` or `plastic` as it is. coat: whether what the surface reflects is lost to the Lambert part."""
    return {
        "eta": (float(material.parameters["eta"]),) * 3,
        "specular_reflectance": common.colour(material, "specular_reflectance"),
        "diffuse_reflectance": common.colour(material, "diffuse_reflectance", 0.0),
        "coat": float(_is_coat(material.parameters)),
    }


def _is_coat(parameters: Settings) -> bool:
    """`plastic` has no parameter `combine` and is a coat."""
    return parameters.get("combine", "blend") == "blend"


def twin_parts(
    environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings
) -> tuple[Float, Float, Float]:
    """F (N, 1), F L_m (N, 3) and L_d (N, 3) in float64."""
    cube = common.twin_cube(environment, settings["face_size"])
    cosine = np.clip((normals * to_view).sum(-1, keepdims=True), 0.0, 1.0)
    weight = fresnel.fresnel_dielectric(cosine, material["eta"])
    mirror = cube.bilinear(phong.reflect(to_view, normals), 0) * common.rgb(material.get("specular_reflectance", 1.0))
    coefficients = common.twin_sh9(environment, _sh_face_size(settings, environment.radiance.shape[1]))
    albedo = np.asarray(common.rgb(material.get("diffuse_reflectance", 0.0)))
    return weight, weight * mirror, albedo / np.pi * sh.irradiance(coefficients, normals)


def _without_texels(band_limited: bool) -> Parts:
    def parts(
        environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings
    ) -> tuple[Float, Float, Float]:
        cosine = np.clip((normals * to_view).sum(-1, keepdims=True), 0.0, 1.0)
        weight = fresnel.fresnel_dielectric(cosine, material["eta"])
        mirror = lifts.exact_mirror(environment, normals, to_view) * common.rgb(material.get("specular_reflectance", 1.0))
        if band_limited:
            face_size = _sh_face_size(settings, environment.radiance.shape[1])
            coefficients = lifts.spherical_harmonics(environment, {"face_size": face_size})
            albedo = np.asarray(common.rgb(material.get("diffuse_reflectance", 0.0)))
            matte = albedo / np.pi * sh.irradiance(coefficients, normals)
        else:
            matte = lifts.exact_diffuse(environment, normals, to_view, material, settings)
        return weight, weight * mirror, matte

    return parts


without_texels = _without_texels(False)


def lifted(put_together: Callable[[Float, Float, Float, Settings], Float], matte: bool = True) -> tuple[Lift, ...]:
    """Formula, then no texels, then no band limit of the Lambert part. put_together: (F, F L_m, L_d, material) → radiance."""

    def of(parts: Parts) -> Twin:
        return lambda environment, normals, to_view, material, settings: put_together(
            *parts(environment, normals, to_view, material, settings), material
        )

    rungs = Lift(ARITHMETIC, of(twin_parts)), Lift(REPRESENTATION, of(_without_texels(True)))
    return (*rungs, Lift(KERNEL, of(without_texels), lobe_field.TOLERANCE)) if matte else rungs


def target(combine: str) -> Callable[[Settings], dict[str, object]]:
    """Target BSDF `fresnelmirror`, its parts put together by `combine`."""
    return lambda settings: {
        "type": "fresnelmirror",
        "eta": settings["eta"],
        "combine": combine,
        "diffuse_reflectance": settings.get("diffuse_reflectance", 0.0),
    }
