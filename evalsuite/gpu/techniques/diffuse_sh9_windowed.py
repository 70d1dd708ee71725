"""Diffuse reflection from nine spherical-harmonic coefficients, windowed against ringing (Sloan 2008, 2017)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import sh, sh_window
from evalsuite.scene.model import Environment, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def _window(coefficients: Float, settings: Settings) -> tuple[Float, float]:
    """h_l of the nine coefficients, and the window's size."""
    if settings["size"] == "auto":
        return sh_window.largest_without_ringing(settings["window"], coefficients)
    return sh_window.factors(settings["window"], settings["size"]), settings["size"]


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """h_l L_i of the cubemap, on the CPU in float64, and what the window did."""
    cube = common.prepare_cube(env, settings, scene)
    start = time.perf_counter()
    plain = sh.project_cube(env.cube(settings["face_size"]).level0)
    h, size = _window(plain, settings)
    elapsed = 1e3 * (time.perf_counter() - start)
    symbol = "λ" if settings["window"] == "laplacian" else "w"
    note = (
        f"{settings['window']} window, {symbol} = {size:.4g}: bands 1 and 2 times {h[1]:.3f} and {h[4]:.3f}; least irradiance "
        f"{sh_window.minimum(plain).min():.4g} without it, {sh_window.minimum(h[:, None] * plain).min():.4g} with it"
    )
    return Prepared({"sh": h[:, None] * plain}, {}, cube.prepare_ms + elapsed, (*cube.notes, note))


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """(k_d/π) Σ Â_i h_i L_i Y_i(n) in float64."""
    plain = common.twin_sh9(environment, settings["face_size"])
    windowed = _window(plain, settings)[0][:, None] * plain
    return np.asarray(common.rgb(material["reflectance"])) / np.pi * sh.irradiance(windowed, normals)


def _size(value: object) -> object:
    return "auto" if value == "auto" else common.number(1e-9, 1e9)(value)


TECHNIQUE = Technique(
    id="diffuse-sh9-windowed",
    title="Diffuse, nine spherical harmonics, windowed",
    paper="Sloan: Stupid Spherical Harmonics Tricks, 2008; Sloan: Deringing Spherical Harmonics, 2017",
    equations="L_d(n) = (k_d/π) Σ Â_i h_l(i) L_i Y_i(n); h_l = ½(1 + cos(πl/w)), sin(πl/w)/(πl/w) or 1/(1 + λ l²(l + 1)²)",
    parameters=(
        common.material_parameter("reflectance", (0.5, 0.5, 0.5), "albedo k_d"),
        Parameter("window", "hann", "shape of h_l", "technique", common.choice(*sh_window.WINDOWS),
                  f"one of {', '.join(sh_window.WINDOWS)}"),
        Parameter("size", "auto", "w of hann and lanczos, λ of laplacian; auto: the mildest under which no channel's irradiance "
                  "is negative anywhere, none where nothing is", "technique", _size, "auto or a number above 0"),
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "Harmonics above degree 2 do not matter to irradiance (they carry less than about 1 % of its energy under most maps).",
        "Irradiance that is blurred is better than irradiance that is negative; three channels share the window of the worst.",
    ),
    stands_for={"diffuse": StandsFor("reflectance as it is", common.diffuse_uniforms)},
    target_bsdf=lambda settings: {"type": "diffuse", "reflectance": settings["reflectance"]},
    shader=Path(__file__).with_suffix(".glsl"),
    library=("sh.glsl",),
    prepare=prepare,
    twin=twin,
    twin_settings={"face_size": 32},
    fill=common.fill_face_size,
    lifts=lambda settings: lifts.of_box_mips(twin, lifts.exact_diffuse),
    represented=lifts.as_cube,
)  # fmt: skip
