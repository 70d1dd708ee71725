"""Mirror reflection by one cubemap look-up (Heidrich, course notes §2.2)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import Float, Parameter, Settings, StandsFor, Technique
from evalsuite.math import fresnel, phong
from evalsuite.scene.model import Environment, Scene


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) times the bilinear look-up in level 0 about r."""
    cube = common.twin_cube(environment, settings["face_size"])
    cosine = (normals * to_view).sum(-1, keepdims=True)
    weight = fresnel.fresnel_conductor(cosine, common.rgb(material.get("eta", 0.0)), common.rgb(material.get("k", 1.0)))
    weight = weight * np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
    return weight * cube.bilinear(phong.reflect(to_view, normals), 0)


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size as wide as the map, so that a look-up blurs it little."""
    if settings["face_size"] is not None:
        return {}
    width = 1 if scene.environment is None else scene.environment.radiance.shape[1]
    return {"face_size": int(np.clip(1 << (width - 1).bit_length(), 16, 1024))}


FACE_SIZE = Parameter(
    "face_size", None, "cubemap face width [texels]; default: the smallest power of two as wide as the map, within 16 … 1024",
    "technique", common.FACE_SIZE.parse, common.FACE_SIZE.expected,
)  # fmt: skip

TECHNIQUE = Technique(
    id="mirror-cube",
    title="Mirror, cube map",
    paper="Heidrich: Environment Maps and Their Applications (course notes), §2.2",
    equations="r = 2(n·v)n − v; L = F(n·v) · texture(env, r)",
    parameters=(
        common.material_parameter("specular_reflectance", common.WHITE, "factor on the reflected radiance"),
        Parameter("filter", "finest", "finest: bilinear in level 0; hardware: trilinear at the hardware's own λ", "technique",
                  common.choice("finest", "hardware"), "finest or hardware"),
        FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "A bilinear look-up in cube texels resembles one in the map's own.",
    ),
    stands_for={"conductor": StandsFor("conductor as it is, Fresnel F(n·v)", common.conductor_uniforms)},
    target_bsdf=lambda settings: {
        "type": "conductor",
        "material": "none",
        "specular_reflectance": settings["specular_reflectance"],
    },
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=common.prepare_cube,
    twin=twin,
    twin_settings={"face_size": 64},
    defines=lambda settings: {"HARDWARE_LOD": 1} if settings["filter"] == "hardware" else {},
    fill=fill,
)  # fmt: skip
