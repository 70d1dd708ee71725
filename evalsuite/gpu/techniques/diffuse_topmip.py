"""Diffuse reflection from the coarsest MIP level (McGuire et al. 2013, Listing 1, first term)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import Float, Settings, StandsFor, Technique
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_L times the seamless look-up about n in the 1 × 1 level, or below_top levels below it."""
    cube = common.twin_cube(environment, settings["face_size"])
    return np.asarray(common.rgb(material["reflectance"])) * cube.lookup(normals, cube.max_level - settings.get("below_top", 0.0))


TECHNIQUE = Technique(
    id="diffuse-topmip",
    title="Diffuse, coarsest MIP level",
    paper="McGuire, Evangelakos, Wilcox, Donow, Mara: Plausible Blinn-Phong Reflection of Standard Cube MIP-Maps, 2013",
    equations="Listing 1: L_d(n) = k_L · textureLod(env, n, maxLevel)",
    parameters=(
        common.material_parameter("reflectance", (0.5, 0.5, 0.5), "albedo k_L"),
        common.BELOW_TOP,
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "Bilinear blending of six face means resembles a cosine-weighted hemisphere.",
        "Means over a face's texels, all counted alike, resemble means over its solid angle.",
    ),
    stands_for={"diffuse": StandsFor("reflectance as it is", common.diffuse_uniforms)},
    target_bsdf=lambda settings: {"type": "diffuse", "reflectance": settings["reflectance"]},
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=common.prepare_cube,
    twin=twin,
    twin_settings={"face_size": 32},
    fill=common.fill_face_size,
    lifts=lambda settings: lifts.of_box_mips(twin, lifts.exact_diffuse),
    represented=lifts.as_cube,
    free=(common.FREE_BELOW_TOP,),
)
