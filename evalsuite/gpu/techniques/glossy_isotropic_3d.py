"""Glossy reflection from a three-dimensional map of radially symmetric lobes (Kautz, McCool 2000)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts, rough_conductor
from evalsuite.gpu.techniques.base import Float, Lift, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import cube_tree, fresnel, isotropic_map, lobe_field, microfacet, octahedral, phong, radial_lobe
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def _lobes(settings: Settings) -> tuple[tuple[isotropic_map.RoundLobe, ...], ...]:
    return isotropic_map.fit(*(settings[name] for name in ("distribution", "alpha", "slices", "lobes", "cosine")))


def _energies(settings: Settings, eta: Float, k: Float) -> Float:
    """E of each lobe and slice with the mean Fresnel factor of the whole BRDF at the slice's n·r, (lobes, slices, 3)."""
    cosines = isotropic_map.slice_cosines(settings["slices"])
    lobe = (settings["distribution"], settings["alpha"], cosines)
    coloured = microfacet.albedo(*lobe, lambda c: fresnel.fresnel_conductor(c[..., None], eta, k))
    energy = np.array([[one.energy for one in row] for row in _lobes(settings)])
    return energy[..., None] * (coloured / microfacet.albedo(*lobe))


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """The lobes' energies in the material's colours. Raises EvalsuiteError for an α or distribution other than the maps'."""
    rough_conductor.require_same(TECHNIQUE.id, material, settings, ("alpha", "distribution"))
    own = common.conductor_uniforms(material, settings)
    energy = _energies(settings, np.asarray(own["eta"]), np.asarray(own["k"]))
    return {"specular_reflectance": own["specular_reflectance"], "lobe_energy": energy.reshape(-1, 3)}


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """All slices of all lobes in one volume."""
    from evalsuite.gpu.prefilter import maps, tree

    size, lobes = settings["face_size"], _lobes(settings)

    def make() -> maps.Prefiltered:
        nodes = tree.of(env, size)
        return maps.to_octahedral(settings["map_size"], [tree.TreeLobe(nodes, one.shape) for row in lobes for one in row])

    made = env.kept(("isotropic-3d", *(settings[p.name] for p in _SHAPING)), make)
    shifts = np.array([[one.shift for one in row] for row in lobes])
    values = {"map_size": float(settings["map_size"]), "lobe_shift": shifts.ravel()}
    return Prepared(values, {"round_lobes": made.texture}, env.cube(size).prepare_ms + made.prepare_ms)


@lru_cache(maxsize=16)
def _maps(environment: Environment, *shaping: object) -> list[list[Float]]:
    settings = dict(zip((p.name for p in _SHAPING), shaping, strict=True))
    tree = cube_tree.build(common.twin_cube(environment, settings["face_size"]).levels[0])
    axes = octahedral.texel_directions(settings["map_size"])
    return [[radial_lobe.filter_tree(tree, axes, one.shape) for one in row] for row in _lobes(settings)]


#: Lobe and slice, world directions (P, 3) → mean radiance (P, 3).
LookUp = Callable[[int, int, Float], Float]


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Σ over lobes of E(n·r) times the trilinear look-up about the lobe's axis, in float64."""
    volume = _maps(environment, *(settings[p.name] for p in _SHAPING))
    return _summed(lambda lobe, k, axis: octahedral.bilinear(volume[lobe][k], axis), normals, to_view, material, settings)


def _without_texels(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """The same from each lobe's integral over the lat-long map."""
    to_local, lobes = np.asarray(environment.to_world, np.float64), _lobes(settings)
    fields = common.radial_fields(environment, *(one.shape for row in lobes for one in row))

    def look_up(lobe: int, k: int, axis: Float) -> Float:
        return fields[lobe * settings["slices"] + k](axis @ to_local)

    return _summed(look_up, normals, to_view, material, settings)


def _summed(look_up: LookUp, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    specular, eta, k = rough_conductor.reflectance(material)
    energy, lobes = _energies(settings, eta, k), _lobes(settings)
    r, n_r = phong.reflect(to_view, normals), np.clip((normals * to_view).sum(-1), 0.0, 1.0)
    towards_n = normals - n_r[:, None] * r
    towards_n /= np.maximum(np.linalg.norm(towards_n, axis=-1, keepdims=True), 1e-6)
    position = np.sqrt(n_r) * (settings["slices"] - 1)
    below = np.minimum(position.astype(int), settings["slices"] - 2)
    total = np.zeros((len(normals), 3))
    for which, (row, row_energy) in enumerate(zip(lobes, energy, strict=True)):
        shift = np.interp(position, np.arange(len(row)), [one.shift for one in row])[:, None]
        axis = np.cos(shift) * r + np.sin(shift) * towards_n
        for i in range(len(row)):
            near = (below == i) | (below + 1 == i)
            if not near.any():
                continue
            weight = 1.0 - np.abs(position[near] - i)[:, None]
            e = np.stack([np.interp(position[near], np.arange(len(row)), row_energy[:, c]) for c in range(3)], -1)
            total[near] += weight * e * look_up(which, i, axis[near])
    return specular * total


def _lifts(settings: Settings) -> tuple[Lift, ...]:
    """No texels only from α = 0.1 on: the slices at grazing angles hold ridges whose spectra have no end."""
    formula, no_texels = lifts.of_tables(twin, _without_texels, tolerance=lobe_field.RADIAL_TOLERANCE)
    return (formula, replace(no_texels, smooth=True)) if settings["alpha"] >= 0.1 else (formula,)


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size from the map's width; map_size so that a lobe's half width, about 1.3 α, spans four texels or more."""
    filled = common.fill_face_size(scene, settings)
    if settings["map_size"] is None:
        filled["map_size"] = int(np.clip(1 << int(np.ceil(np.log2(12.0 / settings["alpha"]))), 32, 256))
    return filled


#: What the maps depend on.
_SHAPING = (
    rough_conductor.ALPHA,
    rough_conductor.DISTRIBUTION,
    Parameter("lobes", 1, "round lobes that are summed", "technique", common.integer(1, 2), "1 or 2"),
    Parameter("cosine", "inside", "inside: lobes of f n·l, which keep the energy; outside: the published form, lobes of f, "
              "n·r before the integral", "technique", common.choice("inside", "outside"), "inside or outside"),
    Parameter("slices", 8, "slices over n·r", "technique", common.integer(2, 64), "a whole number from 2 to 64"),
    Parameter("map_size", None, "width of an octahedral slice [texels]; default: the smallest power of two above 12/α, within "
              "32 … 256", "technique", common.integer(4, 1024), "a whole number from 4 to 1024"),
    common.FACE_SIZE,
)  # fmt: skip

TECHNIQUE = Technique(
    id="glossy-isotropic-3d",
    title="Glossy, 3D map of round lobes",
    paper="Kautz, McCool: Approximation of Glossy Reflection with Prefiltered Environment Maps, 2000; Heidrich: Environment Maps "
    "and Their Applications (course notes), §3.2.3",
    equations="Eq 18–19: L_o(r, n·r) = Σ E(n·r) ∫ p(n·r, r·l) L(l) dl; p(ψ) = mean of f (n·l)₊ over the ring at angle ψ about r",
    parameters=(*_SHAPING, rough_conductor.ETA, rough_conductor.K, rough_conductor.SPECULAR),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "A lobe is round about r: neither drawn out along the plane of incidence, nor bent towards n, nor cut by the horizon, as "
        "a microfacet BRDF's is at grazing angles (with two lobes the second stands off r).",
        "Normalisation: the lobes hold f n·l, so that every n·r reflects all that the BRDF does; the published form (cosine = "
        "outside) holds f alone and multiplies by n·r, 1.8 × too much light at α = 0.5, n·r = 0.95.",
        "Fresnel stands outside the integral: F(v·h) is averaged over the whole lobe for each n·r, per channel.",
        "Between two slices, radiance and energy are linear in √(n·r).",
    ),
    stands_for={"roughconductor": StandsFor("roughconductor as it is, GGX or Beckmann", uniforms)},
    target_bsdf=rough_conductor.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("octahedral.glsl",),
    prepare=prepare,
    twin=twin,
    twin_bound=4e-3,
    twin_bound_reason="float32 directions of the resampled map at the edge of the sun, 10⁵ × the sky (2·10⁻³ there, 4·10⁻⁴ in "
    "the cathedral, 2·10⁻⁵ elsewhere)",
    twin_settings={"face_size": 32, "map_size": 12, "slices": 3, "lobes": 2},
    lifts=_lifts,
    defines=lambda settings: {"LOBES": settings["lobes"], "SLICES": settings["slices"]},
    fill=fill,
)
