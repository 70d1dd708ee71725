"""Glossy GGX reflection as a prefiltered map times a BRDF table (Karis 2013), as game engines draw it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, rough_conductor
from evalsuite.gpu.techniques.base import (
    ARITHMETIC,
    KERNEL,
    REPRESENTATION,
    ROUGHNESS,
    Float,
    Lift,
    Parameter,
    Prepared,
    Settings,
    StandsFor,
    Technique,
)
from evalsuite.math import cube_tree, cubemap, fresnel, lobe_field, phong, prefilter, radial_lobe
from evalsuite.math.sphere import latlong_lookup
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

#: Levels of the chain, roughness √α = k/5: a mirror, then α = 0.04, 0.16, 0.36, 0.64, 1.
LEVELS = 6


def _mirror(map_size: int) -> prefilter.SampleSet:
    """Level 0 copies the environment: one look-up, as large as one of the map's texels."""
    texel = np.array([phong.mean_texel_solid_angle(map_size, 0.0)])
    return prefilter.SampleSet(np.array([[0.0, 0.0, 1.0]]), np.ones(1), texel)


def _alphas() -> Float:
    return (np.arange(1, LEVELS) / (LEVELS - 1)) ** 2


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The chain, and the table that all materials and environments share."""
    from evalsuite.gpu.prefilter import brdf_table, maps, tree
    from evalsuite.gpu.prefilter.sampled import SampledLobe

    size, width, samples = (settings[name] for name in ("face_size", "map_size", "samples"))
    source = env.cube(size)

    def make() -> maps.Prefiltered:
        if settings["prefilter"] == "samples":
            rough = [SampledLobe(source, prefilter.ggx_at_normal_incidence(a, samples)) for a in _alphas()]
        else:
            rough = [tree.TreeLobe(tree.of(env, size), radial_lobe.ggx_at_normal_incidence(a)) for a in _alphas()]
        return maps.to_cube(width, [SampledLobe(source, _mirror(width)), *rough])

    made = env.kept(("split-sum", size, width, samples, settings["prefilter"]), make)
    textures = {"prefiltered": made.texture, "brdf_table": brdf_table.texture()}
    return Prepared({"prefiltered_levels": float(LEVELS)}, textures, source.prepare_ms + made.prepare_ms)


@lru_cache(maxsize=16)
def _chain(environment: Environment, face_size: int, map_size: int, samples: int, method: str) -> cubemap.SeamlessCube:
    source, axes = common.twin_cube(environment, face_size), [cubemap.texel_directions(map_size >> k) for k in range(LEVELS)]
    levels = [prefilter.filter_cube(source, axes[0], _mirror(map_size))]
    tree = None if method == "samples" else cube_tree.build(source.levels[0])
    for level_axes, alpha in zip(axes[1:], _alphas(), strict=True):
        if tree is None:
            levels.append(prefilter.filter_cube(source, level_axes, prefilter.ggx_at_normal_incidence(alpha, samples)))
        else:
            levels.append(radial_lobe.filter_tree(tree, level_axes, radial_lobe.ggx_at_normal_incidence(alpha)))
    return cubemap.SeamlessCube(levels)


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """P(r, α)(F₀ A + B) from the same sample sets and table nodes, in float64."""

    chain = _chain(environment, *(settings[name] for name in ("face_size", "map_size", "samples", "prefilter")))
    alpha = rough_conductor.alpha(material)
    return chain.lookup(phong.reflect(to_view, normals), np.sqrt(alpha) * (LEVELS - 1)) * _factor(normals, to_view, material)


def _factor(normals: Float, to_view: Float, material: Settings) -> Float:
    """F₀ A + B and the material's own factor."""
    from evalsuite.gpu.prefilter import brdf_table

    specular, eta, k = rough_conductor.reflectance(material)
    table = brdf_table.lookup((normals * to_view).sum(-1, keepdims=True), rough_conductor.alpha(material))
    a, b = np.moveaxis(table, -1, 0)
    return specular * (fresnel.fresnel_conductor(1.0, eta, k) * a + b)


@lru_cache(maxsize=8)
def _lobe(alpha: float) -> radial_lobe.RadialLobe:
    return radial_lobe.ggx_at_normal_incidence(alpha)


def _mean(environment: Environment, axis: Float, alpha: float) -> Float:
    """P(r, α) without texels. α = 0: the environment itself."""
    local = axis @ np.asarray(environment.to_world, np.float64)
    return (
        latlong_lookup(environment.radiance, local) if alpha == 0.0 else common.radial_fields(environment, _lobe(alpha))[0](local)
    )


def _without_texels(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """The two levels' lobes over the lat-long map, mixed as the chain mixes them."""
    r, level = phong.reflect(to_view, normals), np.sqrt(rough_conductor.alpha(material)) * (LEVELS - 1)
    below = min(int(level), LEVELS - 2)
    means = [_mean(environment, r, (k / (LEVELS - 1)) ** 2) for k in (below, below + 1)]
    return (means[0] + (level - below) * (means[1] - means[0])) * _factor(normals, to_view, material)


def _own_lobe(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """The lobe of the material's own α."""
    r = phong.reflect(to_view, normals)
    return _mean(environment, r, rough_conductor.alpha(material)) * _factor(normals, to_view, material)


def _lifts(settings: Settings) -> tuple[Lift, ...]:
    """Formula, the whole sum instead of samples in the same texels, no texels, the lobe of the roughness itself."""

    def summed(environment: Environment, normals: Float, to_view: Float, material: Settings, own: Settings) -> Float:
        return twin(environment, normals, to_view, material, {**own, "prefilter": "quadrature"})

    return (
        Lift(ARITHMETIC, twin),
        *([] if settings["prefilter"] == "quadrature" else [Lift(KERNEL, summed, 1e-3)]),
        Lift(REPRESENTATION, _without_texels, lobe_field.RADIAL_TOLERANCE),
        Lift(ROUGHNESS, _own_lobe, lobe_field.RADIAL_TOLERANCE),
    )


def _not_ggx(material: Material) -> str | None:
    if rough_conductor.distribution(material.parameters) != "ggx":
        return "roughconductor with a Beckmann distribution (the map and the table are GGX's)"
    return None


def _map_size(value: object) -> int:
    return cubemap.check_face_size(common.integer(1 << (LEVELS - 1), 1024)(value))


TECHNIQUE = Technique(
    id="split-sum",
    title="Glossy, split sum",
    paper="Karis: Real Shading in Unreal Engine 4, SIGGRAPH course notes, 2013; Křivánek, Colbert: Real-time Shading with "
    "Filtered Importance Sampling, 2008",
    equations="L_o ≈ P(r, α) (F₀ A(n·v, α) + B(n·v, α)); P = Σ L(l) (n·l)₊ / Σ (n·l)₊ with n = v = r, h drawn from GGX",
    parameters=(
        rough_conductor.ALPHA,
        rough_conductor.ETA,
        rough_conductor.K,
        rough_conductor.SPECULAR,
        Parameter("map_size", 128, "face width of the prefiltered map's finest level [texels]", "technique", _map_size,
                  "a power of two from 32 to 1024"),
        Parameter("samples", 128, "directions a texel of the prefiltered map", "technique", common.integer(1, 4096),
                  "a whole number from 1 to 4096"),
        Parameter("prefilter", "samples", "samples: importance samples in MIP levels of their size, as engines do; quadrature: "
                  "the whole sum over the texels' tree", "technique", common.choice("samples", "quadrature"),
                  "samples or quadrature"),
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "The lobe is that of normal incidence: round about r, however the surface is seen, and cut by no horizon but its own.",
        "The environment's radiance does not vary with F and G: one mean of each is multiplied.",
        "Fresnel is Schlick's, F = F₀ + (1 − F₀)(1 − v·h)⁵ with F₀ = F(η, k) at normal incidence, inside the table's integral; "
        "the conductor's own curve dips before it rises.",
        "Roughness between two levels of the chain is their linear mix.",
        "128 samples a texel stand for the map's integral: against quadrature over all texels they leave 2 to 6 % rms in "
        "the office, 9 to 13 % in the cathedral, 30 to 100 % under the sun (prefilter = quadrature: 1 to 3, 2 to 5, 1 to 4 %).",
    ),
    stands_for={
        "roughconductor": StandsFor("GGX α as it is, F₀ from η and k", rough_conductor.uniforms, _not_ggx),
    },
    target_bsdf=rough_conductor.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=prepare,
    twin=twin,
    twin_bound=4e-3,
    twin_bound_reason="float32 directions of samples and resampled map at the edge of the sun, 10⁵ × the sky (2·10⁻³ there, "
    "5·10⁻⁴ in the cathedral, 3·10⁻⁵ elsewhere)",
    twin_settings={"face_size": 32, "map_size": 32, "samples": 32},
    fill=common.fill_face_size,
    lifts=_lifts,
)  # fmt: skip
