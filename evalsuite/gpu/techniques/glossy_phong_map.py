"""Glossy reflection from a Phong-prefiltered cube map (Kautz, Daubert, Seidel §3.2; Heidrich §3.2.2)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import cubemap, lobe_grid, phong, zonal
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The normalised map, by compute shader."""
    from evalsuite.gpu.prefilter.lobe_map import lobe_map

    made = lobe_map(env, settings["exponent"], settings["face_size"])
    note = f"prefiltered cubemap of {made.face_size}² texels a face, summed at {made.rows} × {2 * made.rows} nodes"
    return Prepared({}, {"phong_map": made.texture}, made.prepare_ms, (note,))


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """k_s, and the exponent that the one map holds."""
    common.require_exponent(TECHNIQUE.id, material, settings["exponent"])
    return common.lobe_uniforms(material, settings)


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size from the lobe's width: bilinear look-ups lower a lobe's peak by about 4(N + 1)/6w²."""
    return {} if settings["face_size"] is not None else {"face_size": default_face_size(settings["exponent"])}


def default_face_size(exponent: float) -> int:
    """Smallest power of two w ≥ 22 √(N + 1), where that is 0.14 %, within 64 … 1024."""
    return int(np.clip(1 << int(np.ceil(np.log2(22.0 * np.sqrt(exponent + 1.0)))), 64, 1024))


@lru_cache(maxsize=4)
def twin_map(environment: Environment, exponent: float, face_size: int) -> cubemap.SeamlessCube:
    """The map's texels from spherical harmonics: another way to the same integral."""
    bands = zonal.phong_bands(exponent, zonal.phong_degree(exponent))
    local = cubemap.texel_directions(face_size).reshape(-1, 3) @ environment.to_world
    return cubemap.SeamlessCube([zonal.convolve(environment.radiance, bands, local).reshape(6, face_size, face_size, 3)])


@lru_cache(maxsize=4)
def _table(environment: Environment, exponent: float, face_size: int) -> cubemap.SeamlessCube:
    directions = cubemap.texel_directions(face_size).reshape(-1, 3)
    return cubemap.SeamlessCube([common.exact_lobe(environment, exponent, directions).reshape(6, face_size, face_size, 3)])


def tabulated(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """What `twin` is, its texels from `exact_lobe`: quicker for a whole picture."""
    cube = _table(environment, float(settings["exponent"]), settings["face_size"])
    weight = np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
    return weight * cube.bilinear(phong.reflect(to_view, normals), 0)


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_s times the bilinear look-up of the map about r."""
    cube = twin_map(environment, settings["exponent"], settings["face_size"])
    weight = np.asarray(common.rgb(material.get("specular_reflectance", 1.0)))
    return weight * cube.bilinear(phong.reflect(to_view, normals), 0)


TECHNIQUE = Technique(
    id="glossy-phong-map",
    title="Glossy, Phong-prefiltered cube map",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §3.2; Heidrich, course notes §3.2.2",
    equations="Eq 5–7: L_p(r) = k_s ∫ (r·l)₊^N L(l) dl, stored times (N + 1)/2π, which makes k_s the lobe's integral",
    parameters=(
        common.material_parameter("exponent", 50.0, "Phong exponent N, from 1 to 10⁴"),
        common.material_parameter("specular_reflectance", common.WHITE, "k_s, the lobe's integral"),
        Parameter("face_size", None, "map face width [texels]; default: the smallest power of two above 22 √(N + 1), within "
                  "64 … 1024", "technique", common.FACE_SIZE.parse, common.FACE_SIZE.expected),
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "The tangent plane cuts nothing off the lobe: the map knows r and no n.",
        "Bilinear look-ups between texels (0.14 % off a lone lamp's peak at the default size).",
        f"N from {lobe_grid.LOWEST_EXPONENT:g} to {lobe_grid.HIGHEST_EXPONENT:g}.",
    ),
    stands_for={"phong": StandsFor("k_s as it is, N the subject's", uniforms, common.no_diffuse_part)},
    target_bsdf=common.lobe_target("phong"),
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=prepare,
    twin=twin,
    twin_bound=6e-4,
    twin_bound_reason="six-point interpolation on the grid: 10⁻⁴ of a lone lamp's peak, more beside what is dark around it",
    twin_settings={"face_size": 32},
    fill=fill,
    lifts=lambda settings: lifts.of_tables(tabulated, lifts.exact_glossy),
)  # fmt: skip
