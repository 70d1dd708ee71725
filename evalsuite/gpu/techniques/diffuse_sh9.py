"""Diffuse reflection from nine spherical-harmonic coefficients of the environment (Kautz, Daubert, Seidel §4.1)."""

from __future__ import annotations

import time
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import (
    ARITHMETIC,
    REPRESENTATION,
    Float,
    FreeParameter,
    Lift,
    Parameter,
    Prepared,
    Settings,
    StandsFor,
    Technique,
)
from evalsuite.math import cubemap, sh
from evalsuite.scene.model import Environment, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def _level(level0: Float, settings: Settings) -> Float:
    """The box-filtered level that sh_face_size names."""
    if settings["sh_face_size"] == "full":
        return level0
    return next(level for level in cubemap.box_mips(level0) if level.shape[1] <= settings["sh_face_size"])


def _coefficients(level0: Float, settings: Settings) -> Float:
    """(9, 3) L_i, zero above the highest band used."""
    found = sh.project_cube(_level(level0, settings))
    found[(settings["bands"] + 1) ** 2 :] = 0.0
    return found


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """L_i of the cubemap, on the CPU in float64."""
    cube = common.prepare_cube(env, settings, scene)
    start = time.perf_counter()
    coefficients = _coefficients(env.cube(settings["face_size"]).level0, settings)
    elapsed = 1e3 * (time.perf_counter() - start)
    return Prepared({"sh": coefficients}, {}, cube.prepare_ms + elapsed, cube.notes)


@lru_cache(maxsize=8)
def _twin_coefficients(environment: Environment, face_size: int, sh_face_size: object, bands: int) -> Float:
    level0 = common.twin_cube(environment, face_size).levels[0]
    return _coefficients(level0, {"sh_face_size": sh_face_size, "bands": bands})


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """(k_d/π) Σ Â_i L_i Y_i(n) in float64."""
    coefficients = _twin_coefficients(environment, *(settings[name] for name in ("face_size", "sh_face_size", "bands")))
    return np.asarray(common.rgb(material["reflectance"])) / np.pi * sh.irradiance(coefficients, normals)


def _lifts(settings: Settings) -> tuple[Lift, ...]:
    """Finer texels are those of the whole map: a level that sh_face_size names is texels too."""

    def whole(environment: Environment, normals: Float, to_view: Float, material: Settings, own: Settings) -> Float:
        return lifts.finer(twin)(environment, normals, to_view, material, {**own, "sh_face_size": "full"})

    between = "interpolation between vertices" if settings["per"] == "vertex" else ARITHMETIC
    first, _, last = lifts.of_box_mips(twin, lifts.exact_diffuse, between)
    return first, Lift(REPRESENTATION, whole), last


def _face_size(value: object) -> object:
    return "full" if value == "full" else cubemap.check_face_size(common.integer(1, 8192)(value))


TECHNIQUE = Technique(
    id="diffuse-sh9",
    title="Diffuse, nine spherical harmonics",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §4.1",
    equations="Eq 9–12: L_d(n) = (k_d/π) Σ Â_i L_i Y_i(n)",
    parameters=(
        common.material_parameter("reflectance", (0.5, 0.5, 0.5), "albedo k_d"),
        Parameter("per", "pixel", "where the sum is evaluated", "technique", common.choice("pixel", "vertex"), "pixel or vertex"),
        Parameter("sh_face_size", "full", "width of the cubemap level that is projected; 'full' is level 0", "technique",
                  _face_size, "full or a power of two"),
        Parameter("bands", 2, "highest degree of harmonics that is used", "technique", common.integer(0, 2), "0, 1 or 2"),
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "Harmonics above degree 2 do not matter to irradiance (they carry less than about 1 % of its energy under most maps).",
    ),
    stands_for={"diffuse": StandsFor("reflectance as it is", common.diffuse_uniforms)},
    target_bsdf=lambda settings: {"type": "diffuse", "reflectance": settings["reflectance"]},
    shader=Path(__file__).with_suffix(".glsl"),
    library=("sh.glsl",),
    prepare=prepare,
    twin=twin,
    twin_settings={"face_size": 32},
    vertex_stage=True,
    defines=lambda settings: {"PER_VERTEX": 1} if settings["per"] == "vertex" else {},
    fill=common.fill_face_size,
    free=(FreeParameter("bands", 0, 2, 1, "degree", "degree 2", whole=True),),
    lifts=_lifts,
    represented=lifts.as_cube,
)  # fmt: skip
