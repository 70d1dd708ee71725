"""What the shadow techniques share: parameters, materials, the chain of truths that they are held against."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache

import numpy as np

from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import Float, FreeParameter, Parameter, Settings, StandsFor
from evalsuite.lights import decompose
from evalsuite.lights.model import Decomposition, DecompositionSettings
from evalsuite.math import lobe_grid, phong
from evalsuite.scene.model import Environment, Material

PAPER = "Environment maps decomposed into area lights, with penumbra wedges (Akenine-Möller and Assarsson 2002) for their shadows"

_DECOMPOSITION = {
    "sizes": ("filters in the bank", common.integer(1, 200), "a whole number from 1 to 200"),
    "smallest_deg": ("angular extent of the smallest filter [degrees]", common.number(0.1, 170.0), "0.1 to 170"),
    "largest_deg": ("angular extent of the largest filter [degrees]", common.number(0.1, 170.0), "0.1 to 170"),
    "spacing": ("of the sizes in between", common.choice("geometric", "linear"), "geometric or linear"),
    "inner": ("radius of a filter's centre over that of its surround", common.number(0.05, 0.99), "0.05 to 0.99"),
    "surround": ("weight of the surround, where the centre has 1", common.number(-1e6, -1e-6), "a negative number"),
    "candidates": ("part of the map's texels, the brightest, that filters are centred on", common.number(1e-6, 1.0), "up to 1"),
    "stop": ("a light below this part of the sum of those before it ends the search", common.number(0.0, 1.0), "0 to 1"),
    "least_response": ("a best response not above it ends the search", common.number(), "a number"),
    "max_lights": ("cap on the number of lights", common.integer(0, 256), "a whole number from 0 to 256"),
}  # fmt: skip

#: Parameters of the decomposition, those of `lights.model.DecompositionSettings`.
DECOMPOSITION = tuple(
    Parameter(f.name, f.default, _DECOMPOSITION[f.name][0], "technique", *_DECOMPOSITION[f.name][1:])
    for f in fields(DecompositionSettings)
)

#: How many lights: the published search ends by itself.
FREE_LIGHTS = FreeParameter("max_lights", 0, 64, 1, "lights", "all lights that the search finds", whole=True)

MATERIAL = common.bsdf_parameters("diffuse", ("diffuse", "phong"))


def _matte(material: Material, settings: Settings) -> dict[str, object]:
    return {**common.diffuse_uniforms(material, settings), "specular_reflectance": (0.0, 0.0, 0.0), "phong_lobe": False}


def _glossy(material: Material, settings: Settings) -> dict[str, object]:
    return {**common.lobe_uniforms(material, settings), "phong_lobe": True}


STANDS_FOR = {
    "diffuse": StandsFor("reflectance as it is", _matte),
    "phong": StandsFor("phong as it is, all lobes of a scene with one exponent", _glossy),
}

ASSUMPTIONS = (
    "Lights are flat discs at infinity; what lies between them and the map is lost.",
    "The rest of the map casts no shadow.",
    f"Phong exponents from {lobe_grid.LOWEST_EXPONENT:g} to {lobe_grid.HIGHEST_EXPONENT:g}.",
)

#: From full truth to what a technique that shades from the lights' centres measures visibility over; see `Technique.chain`.
TO_CENTRES = (
    ("direct", "decomposition"),
    ("discs-shadowed", "missing ambient shadow"),
    ("discs", "centre-direction shading"),
)


@lru_cache(maxsize=8)
def decomposed(environment: Environment, settings: DecompositionSettings) -> tuple[Decomposition, Environment]:
    """The environment's lights and, as an environment of its own, what is left."""
    found = decompose.of(environment, settings)
    return found, Environment(found.remainder, environment.to_world, f"remainder of {environment.source}")


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Ambient light of the remainder plus Σ V E f (n·D)₊ over the lights, (N, 3). settings["visibility"]: V, (N, L)."""
    found, rest = decomposed(environment, DecompositionSettings.of(settings))
    out = twin_ambient(rest, normals, to_view, material, settings)
    for light, visible in zip(found.lights, np.asarray(settings["visibility"], np.float64).T, strict=True):
        to_light = environment.to_world @ np.asarray(light.direction)
        out += visible[:, None] * np.asarray(light.irradiance) * twin_reflected(normals, to_view, to_light, material)
    return out


def twin_ambient(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Prefiltered light of an environment, unshadowed: diffuse about n and, of a phong material, the lobe about r, each from a
    cube map as `gpu.shadow.lighting` makes it."""
    from evalsuite.gpu.shadow.lighting import DIFFUSE_FACE_SIZE
    from evalsuite.gpu.techniques import diffuse_map, glossy_phong_map

    diffuse = {"reflectance": material.get("reflectance", material.get("diffuse_reflectance", 0.0))}
    out = diffuse_map.tabulated(environment, normals, to_view, diffuse, {"face_size": DIFFUSE_FACE_SIZE})
    if "exponent" in material:
        lobe = {"exponent": material["exponent"], "face_size": glossy_phong_map.default_face_size(material["exponent"])}
        out = out + glossy_phong_map.tabulated(environment, normals, to_view, material, lobe)
    return out


def exact_ambient(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """The same without texels."""
    diffuse = material.get("reflectance", material.get("diffuse_reflectance", 0.0))
    out = np.asarray(common.rgb(diffuse)) * common.exact_lobe(environment, 1.0, normals)
    if "exponent" in material:
        lobe = common.exact_lobe(environment, material["exponent"], phong.reflect(to_view, normals))
        out = out + np.asarray(common.rgb(material.get("specular_reflectance", 1.0))) * lobe
    return out


def twin_reflected(normals: Float, to_view: Float, to_light: Float, material: Settings) -> Float:
    """f(l, v) (n·l)₊, (N, 3)."""
    cosine = np.maximum(normals @ to_light, 0.0)[:, None]
    diffuse = material.get("reflectance", material.get("diffuse_reflectance", 0.0))
    out = np.asarray(common.rgb(diffuse)) * cosine / np.pi
    if "exponent" in material:
        lobe = phong.phong_lobe(material["exponent"], phong.reflect(to_view, normals) @ to_light)[:, None] * (cosine > 0)
        out = out + np.asarray(common.rgb(material.get("specular_reflectance", 1.0))) * lobe
    return out
