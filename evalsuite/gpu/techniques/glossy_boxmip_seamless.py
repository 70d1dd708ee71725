"""Glossy reflection from MIPs that are filtered across faces: the remedy that Kautz, Daubert and Seidel name at Fig 4.

The level is explicit: from the exponent, or λ + b with λ formed from screen derivatives in the shader, so that a bias means
the same on every driver.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, glossy_boxmip, lifts
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import cubemap, phong, seamless_mips
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The cubemap with its cross-face chain."""
    from evalsuite.gpu.prefilter.seamless_mips import seamless_cube

    cube = seamless_cube(env, settings["face_size"])
    max_level = cube.face_size.bit_length() - 1
    uniforms = {"env_face_size": float(cube.face_size), "env_max_level": float(max_level), "env_mean": cube.mean}
    uniforms["lod_offset"] = settings["lod_offset"]
    note = f"cubemap of {cube.face_size}² texels a face, {max_level} levels filtered across faces"
    return Prepared(uniforms, {"env_cube": cube.texture}, cube.prepare_ms, (note,))


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size; with a bias given also the exponent, where that is open, whose level is mean λ + b."""
    filled = common.fill_face_size(scene, settings)
    if settings["bias"] is not None and "exponent" not in settings["given"]:
        face_size = filled.get("face_size", settings["face_size"])
        _, lod, mask = glossy_boxmip.subject_reflection(scene, face_size, TECHNIQUE)
        mean = float(lod[mask].mean(dtype=np.float64)) if mask.any() else 0.0
        filled["exponent"] = float(seamless_mips.seamless_lod_to_exponent(mean + settings["bias"], face_size))
    return filled


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """The lobe's colour and exponent, and the level or the bias."""
    lobe = common.lobe_uniforms(material, settings)
    if settings["bias"] is not None:
        return {**lobe, "exponent": settings["exponent"], "bias": settings["bias"]}
    return {**lobe, "level": float(seamless_mips.exponent_to_seamless_lod(lobe["exponent"], settings["face_size"]))}


@lru_cache(maxsize=8)
def twin_cube(environment: Environment, face_size: int) -> cubemap.SeamlessCube:
    """The cubemap and its chain in float64."""
    return cubemap.SeamlessCube(seamless_mips.seamless_mips(common.twin_cube(environment, face_size).levels[0]))


def look_up(cube: cubemap.SeamlessCube, mean: Float, r: Float, lod: Float | float) -> Float:
    """Trilinear in the chain, and on to the mean of the sphere in one level more. r: (P, 3); lod: (P,) or one number."""
    beyond = np.clip(np.asarray(lod, np.float64) - cube.max_level, 0.0, 1.0)[..., None]
    return (1.0 - beyond) * cube.lookup(r, lod) + beyond * mean


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_s times the look-up about r at the exponent's level, or at settings["lambda"] (N,) + bias; c levels on."""
    cube = twin_cube(environment, settings["face_size"])
    if settings["bias"] is None:
        lod = seamless_mips.exponent_to_seamless_lod(material["exponent"], cube.width)
    else:
        lod = np.asarray(settings["lambda"]) + settings["bias"]
    lod = lod + settings.get("lod_offset", 0.0)
    radiance = look_up(cube, seamless_mips.mean_radiance(cube.levels[0]), phong.reflect(to_view, normals), lod)
    return np.asarray(common.rgb(material.get("specular_reflectance", 1.0))) * radiance


def fit(scene: Scene, env: GpuEnvironment, settings: Settings) -> dict[str, float] | None:
    """The Phong exponent that comes nearest to what the look-ups returned."""
    from evalsuite.gpu.prefilter.seamless_mips import seamless_cube

    made = seamless_cube(env, settings["face_size"])

    def returned(r: Float, lod: Float) -> Float:
        if settings["bias"] is None:
            level = float(seamless_mips.exponent_to_seamless_lod(settings["exponent"], made.face_size))
        else:
            level = lod + settings["bias"]
        return look_up(made.sampler, made.mean, r, level + settings["lod_offset"])

    return glossy_boxmip.fit_look_up(scene, env, settings, returned, TECHNIQUE)


TECHNIQUE = Technique(
    id="glossy-boxmip-seamless",
    title="Glossy, MIPs filtered across faces",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §6, Fig 4; Heidrich, course notes §2.4",
    equations="L_p(r) = k_s · textureLod(env, r, m); each level from 4 × 4 finer texels by (1, 3, 3, 1)² × solid angle, over "
    "the edges too; m = log₂(w√3) − ½ log₂(N + 1) − log₂(4/3) + c, or λ + b + c, c = 0",
    parameters=(
        common.material_parameter("exponent", 50.0, "Phong exponent N; with bias given: default from mean λ + b"),
        common.material_parameter("specular_reflectance", common.WHITE, "k_s, the lobe's integral"),
        Parameter("bias", None, "LOD bias b [levels] on λ from screen derivatives; default: none, the level is the exponent's",
                  "technique", common.number(-32, 32), "a number of MIP levels"),
        common.LOD_OFFSET,
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "A B-spline in texture space, three texels wide, stands for a cosine-power lobe.",
        "Past the last level the radiance goes over, in one level more, to the mean of the sphere.",
        "The tangent plane cuts nothing off the lobe.",
    ),
    stands_for={"phong": StandsFor("N and k_s as they are, or N matched to the bias", uniforms, common.no_diffuse_part)},
    target_bsdf=common.lobe_target("phong"),
    shader=Path(__file__).with_suffix(".glsl"),
    library=("face_lod.glsl",),
    prepare=prepare,
    twin=twin,
    twin_settings={"face_size": 32},
    resolves=True,
    defines=lambda settings: {} if settings["bias"] is None else {"AT_BIAS": 1},
    fill=fill,
    fit=fit,
    lifts=lambda settings: lifts.of_box_mips(twin, lifts.exact_glossy),
    represented=lifts.as_cube,
    free=(common.FREE_LOD_OFFSET,),
)  # fmt: skip
