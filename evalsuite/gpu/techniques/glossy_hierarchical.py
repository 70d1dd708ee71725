"""Glossy reflection from dual paraboloid maps that two 7 × 7 kernels prefilter (Heidrich §3.2.5; Kautz et al. 2000)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import (
    ARITHMETIC,
    KERNEL,
    REPRESENTATION,
    Float,
    Lift,
    Parameter,
    Prepared,
    Settings,
    StandsFor,
    Technique,
)
from evalsuite.gpu.techniques.dual_paraboloid import MAP_SIZE
from evalsuite.math import hierarchical, lobe_field, paraboloid, phong
from evalsuite.math.sphere import latlong_lookup, latlong_spacing
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """The border: an eighth of the map, as in the notes."""
    return {} if settings["border"] is not None else {"border": settings["map_size"] / 8.0}


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """Both prefiltered maps and their texture matrices."""
    from evalsuite.gpu.prefilter.hierarchical import hierarchical_maps

    size, border = settings["map_size"], settings["border"]
    maps = hierarchical_maps(env, settings["exponent"], settings["cutoff"], settings["taps"], size, border)
    front, back = (paraboloid.texture_matrix(half, size, border) for half in (paraboloid.FRONT, paraboloid.BACK))
    note = ("S and L filtered with {} and {} texels across at 1/{} and 1/{} of the map's size".format(
        *maps.widths, *(2**level for level in maps.levels)))  # fmt: skip
    textures = {"front_map": maps.textures[0], "back_map": maps.textures[1]}
    return Prepared({"front_matrix": front, "back_matrix": back}, textures, maps.prepare_ms, (note,))


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """k_s, and the exponent that the one pair of maps holds."""
    common.require_exponent(TECHNIQUE.id, material, settings["exponent"])
    return common.lobe_uniforms(material, settings)


@lru_cache(maxsize=4)
def twin_levels(environment: Environment, size: int, border: float) -> list[Float]:
    """The unfiltered maps and their solid-angle-weighted chain in float64."""
    k = paraboloid.subsamples_per_texel(size, border, latlong_spacing(*environment.radiance.shape[:2]))
    level0 = paraboloid.resample(lambda d: latlong_lookup(environment.radiance, d @ environment.to_world), size, border, k)
    return paraboloid.weighted_mips(level0, border)


@lru_cache(maxsize=4)
def _maps(environment: Environment, size: int, border: float, exponent: float, cutoff: float, taps: int) -> Float:
    return hierarchical.prefilter(twin_levels(environment, size, border), border, exponent, cutoff, taps)


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_s times the bilinear look-up of the prefiltered maps about r."""
    border = settings["border"]
    maps = _maps(environment, *(settings[name] for name in ("map_size", "border", "exponent", "cutoff", "taps")))
    weight = np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
    return weight * hierarchical.look_up(maps, border, phong.reflect(to_view, normals))


def _finer(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Maps of twice the width, the kernel's size the same part of them: 7 × 7 taps of a level twice as fine become 13 × 13."""
    factor = min(2, max(1, 1024 // settings["map_size"]))
    changed = {
        "map_size": factor * settings["map_size"],
        "border": factor * settings["border"],
        "taps": factor * settings["taps"],
    }
    return twin(environment, normals, to_view, material, {**settings, **changed})


def _lifts(settings: Settings) -> tuple[Lift, ...]:
    return (
        Lift(ARITHMETIC, twin),
        Lift(REPRESENTATION, _finer),
        Lift(KERNEL, lifts.exact_glossy, lobe_field.TOLERANCE),
    )


def _exponent(value: object) -> float:
    """Below 1 the kernel would be a hemisphere, wider than any border."""
    return common.number(1.0, 1e7)(value)


TECHNIQUE = Technique(
    id="glossy-hierarchical",
    title="Glossy, dual paraboloid maps prefiltered with small kernels",
    paper="Heidrich, course notes §3.2.5; Kautz, Vázquez, Heidrich, Seidel: A Unified Approach to Prefiltered "
    "Environment Maps, 2000",
    equations="(1 − d²)·S + d²·L; r_S = tan(θ_c/2), r_L = 1 − tan(π/4 − θ_c/2), θ_c = acos(0.1^(1/N)); at the MIP level where "
    "the filter's 2⌈R r⌉ texels fit 7",
    parameters=(
        Parameter("exponent", 50.0, "Phong exponent N", "material", _exponent, "a number ≥ 1"),
        common.material_parameter("specular_reflectance", common.WHITE, "k_s, the lobe's integral"),
        Parameter("cutoff", 0.1, "value of cos^N below which the kernel is cut; 0.0001 is as good as none", "technique",
                  common.number(1e-4, 0.9), "a number from 0.0001 to 0.9"),
        Parameter("taps", 7, "largest filter [texels]; as many as map_size lifts the limit", "technique",
                  common.integer(3, 8192), "a whole number from 3"),
        Parameter("map_size", 512, "width of each map, border included [texels]", "technique", MAP_SIZE.parse,
                  MAP_SIZE.expected),
        Parameter("border", None, "border around the circle [texels]; default: an eighth of map_size", "technique",
                  common.number(1.0, 2048.0), "a number of texels from 1 to a quarter of map_size"),
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "One kernel shape serves the whole map, its size between the centre's and the rim's by d².",
        "What lies below a tenth of the lobe's peak (a tenth of its energy) does not matter.",
        "7 × 7 texels of a MIP level resolve the lobe, bilinear magnification restores the map.",
        "Beyond the border the map's last texels go on.",
        "The tangent plane cuts nothing off the lobe.",
    ),
    stands_for={"phong": StandsFor("k_s as it is, N the subject's", uniforms, common.no_diffuse_part)},
    target_bsdf=common.lobe_target("phong"),
    shader=Path(__file__).with_suffix(".glsl"),
    library=("paraboloid.glsl",),
    prepare=prepare,
    twin=twin,
    twin_settings={"map_size": 64},
    fill=fill,
    lifts=_lifts,
)  # fmt: skip
