"""What the perfect mirrors share: the material, its factor on the reflected radiance, and how fine a map is made."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import ARITHMETIC, KERNEL, Float, Lift, Parameter, Settings, StandsFor, Twin
from evalsuite.math import fresnel
from evalsuite.scene.model import Environment, Scene

SPECULAR_REFLECTANCE = common.material_parameter("specular_reflectance", common.WHITE, "factor on the reflected radiance")
STANDS_FOR = {"conductor": StandsFor("conductor as it is, Fresnel F(n·v)", common.conductor_uniforms)}
FACE_SIZE = Parameter(
    "face_size", None, "cubemap face width [texels]; default: the smallest power of two as wide as the map, within 16 … 1024",
    "technique", common.FACE_SIZE.parse, common.FACE_SIZE.expected,
)  # fmt: skip
DISTANT = "The environment is distant and nothing occludes it."


def target_bsdf(settings: Settings) -> dict[str, object]:
    """The perfect mirror."""
    return {"type": "conductor", "material": "none", "specular_reflectance": settings["specular_reflectance"]}


def factor(normals: Float, to_view: Float, material: Settings) -> Float:
    """Twin of F(n·v) times the specular reflectance, (N, 3)."""
    cosine = (normals * to_view).sum(-1, keepdims=True)
    f = fresnel.fresnel_conductor(cosine, common.rgb(material.get("eta", 0.0)), common.rgb(material.get("k", 1.0)))
    return f * np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))


def exact(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) L(r)."""
    return factor(normals, to_view, material) * lifts.exact_mirror(environment, normals, to_view)


def lifted(twin: Twin) -> Callable[[Settings], tuple[Lift, ...]]:
    """A bilinear look-up in the finest level in float64, then no texels. What hardware's MIPs change comes before both."""

    def of(settings: Settings) -> tuple[Lift, ...]:
        finest = settings.get("filter", "finest") == "finest"
        return lifts.of_tables(twin, exact, ARITHMETIC if finest else KERNEL, 1e-6)

    return of


def finest_face_size(scene: Scene) -> int:
    """Cube face width as wide as the scene's map, a power of two within 16 … 1024: a look-up then blurs it little."""
    width = 1 if scene.environment is None else scene.environment.radiance.shape[1]
    return int(np.clip(1 << (width - 1).bit_length(), 16, 1024))


def fill_face_size(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size where it is not given."""
    return {} if settings["face_size"] is not None else {"face_size": finest_face_size(scene)}
