"""What several techniques give up alike when their assumptions are lifted one by one; see `base.Lift`.

Each function is a `Twin`: float64 radiance of surface points, from the lat-long map itself where nothing else is said.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import ARITHMETIC, FRESNEL, KERNEL, REPRESENTATION, Float, Lift, Settings, Twin
from evalsuite.math import fresnel, fresnel_lobe, lobe_field, phong, zonal
from evalsuite.math.sphere import latlong_directions, latlong_lookup
from evalsuite.scene.model import Environment

#: A cubemap so much wider holds the environment itself, as far as a filter of the technique's width can tell.
FINER, WIDEST = 4, 512


def finer_face_size(face_size: int) -> int:
    """Face width that stands for a map without texels."""
    return max(face_size, min(FINER * face_size, WIDEST))


def finer(twin: Twin) -> Twin:
    """The technique's own formula on a cubemap four times as wide (up to 512): the same footprints, other texels."""

    def radiance(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
        wide = finer_face_size(settings["face_size"])
        changed = {**settings, "face_size": wide}
        if "lambda" in settings:
            changed["lambda"] = np.asarray(settings["lambda"]) + np.log2(wide / settings["face_size"])
        return twin(environment, normals, to_view, material, changed)

    return radiance


def exact_mirror(environment: Environment, normals: Float, to_view: Float) -> Float:
    """L(r), as Mitsuba's own envmap is looked up."""
    r = phong.reflect(to_view, normals)
    return latlong_lookup(environment.radiance, r @ np.asarray(environment.to_world, np.float64))


def exact_diffuse(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_d E(n)/π."""
    albedo = material.get("reflectance", material.get("diffuse_reflectance", 0.0))
    return np.asarray(common.rgb(albedo)) * common.exact_lobe(environment, 1.0, normals)


def exact_glossy(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_s (times F(n·v) for conductors) times the normalised lobe cos^N about r, whole: no tangent plane cuts it."""
    exponent = lobe_exponent(material)
    weight = np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
    if "eta" in material:
        cosine = (normals * to_view).sum(-1, keepdims=True)
        weight = weight * fresnel.fresnel_conductor(cosine, common.rgb(material["eta"]), common.rgb(material["k"]))
    return weight * common.exact_lobe(environment, exponent, phong.reflect(to_view, normals))


def lobe_exponent(material: Settings) -> float:
    """N of the lobe about r: the material's own, or that of its α (McGuire et al.)."""
    return float(material["exponent"] if "exponent" in material else phong.alpha_to_exponent(material["alpha"]))


#: A Fresnel factor by kind and its constants: ("conductor", η, k), ("dielectric", η) or ("schlick", f_λ), each a colour.
Factor = tuple
_FACTORS = {
    "conductor": fresnel.fresnel_conductor,
    "dielectric": fresnel.fresnel_dielectric,
    "schlick": fresnel.fresnel_schlick,
}


def _evaluated(factor: Factor, cosine: Float) -> Float:
    kind, *colours = factor
    return _FACTORS[kind](cosine[..., None], *(np.asarray(colour) for colour in colours))


@lru_cache(maxsize=16)
def _fresnel_lobe(exponent: float, factor: Factor) -> tuple[fresnel_lobe.FresnelLobe, float]:
    return fresnel_lobe.phong(exponent, lambda cosine: _evaluated(factor, cosine))


@lru_cache(maxsize=12)
def _entering_field(environment: Environment, factor: Factor) -> tuple[lobe_field.LobeField, ...]:
    def kernels(cosine: Float) -> Float:
        return cosine[:, None] / np.pi * (1.0 - _evaluated(factor, cosine))

    bands, radiance = zonal.kernel_bands(kernels, 96).T, environment.radiance  # (1 − F) c leaves no kink at the horizon
    if np.ptp(bands, axis=0).max() == 0.0:
        return (lobe_field.field(radiance, bands[0], 129),)
    return tuple(lobe_field.field(radiance[..., c : c + 1], one, 129) for c, one in enumerate(bands))


def exact_entering(environment: Environment, normals: Float, factor: Factor) -> Float:
    """∫ (1 − F(n·l)) (n·l)₊/π L(l) dl: what a coat lets through to a Lambert base."""
    local = normals @ np.asarray(environment.to_world, np.float64)
    return np.concatenate([one(local) for one in _entering_field(environment, factor)], axis=-1)


def within_lobe(environment: Environment, normals: Float, to_view: Float, exponent: float, factor: Factor) -> Float:
    """∫ (N + 1)/2π (r·l)₊^N (F(v·h) − F(n·v)) L(l) dl."""
    lobe, narrow = _fresnel_lobe(exponent, factor)
    return lobe(lambda directions: common.nearly_exact_lobe(environment, narrow, directions), normals, to_view)


def glossy_fresnel(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """`exact_glossy` with the conductor's Fresnel factor inside the lobe's integral."""
    out = exact_glossy(environment, normals, to_view, material, settings)
    if has_fresnel(material):
        factor = "conductor", common.rgb(material["eta"]), common.rgb(material["k"])
        weight = np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
        out = out + weight * within_lobe(environment, normals, to_view, lobe_exponent(material), factor)
    return out


def has_fresnel(material: Settings) -> bool:
    """Whether a conductor's reflectance depends on the angle (Mitsuba's material "none" reflects all), over a lobe that
    `math.fresnel_lobe` can take apart."""
    if "eta" not in material or not any(common.rgb(material["eta"])):
        return False
    return lobe_exponent(material) >= fresnel_lobe.LOWEST_EXPONENT


@lru_cache(maxsize=8)
def _as_cube(environment: Environment, face_size: int) -> Environment:
    cube = common.twin_cube(environment, face_size)
    height, width = (max(n, m) for n, m in zip(environment.radiance.shape[:2], (2 * face_size + 1, 4 * face_size), strict=True))
    world = latlong_directions(height, width) @ np.asarray(environment.to_world, np.float64).T
    radiance = cube.bilinear(world.reshape(-1, 3), 0).reshape(height, width, 3)
    return Environment(radiance.astype(np.float32), environment.to_world, f"{environment.source} in {face_size}² faces")


def as_cube(environment: Environment, settings: Settings) -> Environment:
    """The environment that a bilinear look-up in the cubemap's finest level sees, as a lat-long map no coarser than either."""
    return _as_cube(environment, settings["face_size"])


def of_box_mips(twin: Twin, exact: Twin, cause: str = ARITHMETIC) -> tuple[Lift, ...]:
    """Of techniques that filter a cubemap: formula, finer texels, then the very lobe that the filter stands for."""
    return (
        Lift(cause, twin),
        Lift(REPRESENTATION, finer(twin)),
        Lift(KERNEL, exact, lobe_field.TOLERANCE),
    )


def fresnel_inside(exact: Twin, made_by: Callable[[Settings], bool]) -> Lift:
    """After `of_box_mips`: the very lobe with the Fresnel factor within its integral."""
    return Lift(FRESNEL, exact, lobe_field.TOLERANCE, fresnel_lobe.TOLERANCE, made_by, smooth=True)


def of_tables(twin: Twin, exact: Twin, cause: str = ARITHMETIC, tolerance: float = lobe_field.TOLERANCE) -> tuple[Lift, ...]:
    """Of techniques whose map holds the lobe's integral itself: formula, then no texels."""
    return Lift(cause, twin), Lift(REPRESENTATION, exact, tolerance)


def spherical_harmonics(environment: Environment, settings: Settings) -> Float:
    """(9, 3) L_i of the finer cubemap."""
    return common.twin_sh9(environment, finer_face_size(settings["face_size"]))
