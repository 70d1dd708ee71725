"""Diffuse reflection from a diffusely prefiltered cube map (Kautz, Daubert, Seidel §3.1; Heidrich §3.2.1)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, glossy_phong_map, lifts
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import cubemap
from evalsuite.math.sphere import latlong_directions, latlong_lookup, latlong_solid_angles
from evalsuite.scene.model import Environment, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """E/π by compute shader: the clamped cosine over π is the normalised Phong lobe of N = 1."""
    from evalsuite.gpu.prefilter.lobe_map import lobe_map

    made = lobe_map(env, 1.0, settings["face_size"])
    note = f"prefiltered cubemap of {made.face_size}² texels a face, summed at {made.rows} × {2 * made.rows} nodes"
    return Prepared({}, {"diffuse_map": made.texture}, made.prepare_ms, (note,))


@lru_cache(maxsize=4)
def twin_map(environment: Environment, face_size: int) -> cubemap.SeamlessCube:
    """E/π at the map's texels by quadrature: every texel of the lat-long map times its clamped cosine and its weight."""
    height, width = environment.radiance.shape[:2]
    finer = -(-200 // height)  # small maps by their bilinear interpolant
    height, width = finer * (height - 1) + 1 if height > 1 else finer, finer * width
    directions = latlong_directions(height, width)
    radiance = latlong_lookup(environment.radiance, directions)
    lit = directions.reshape(-1, 3)
    weighted = (radiance * latlong_solid_angles(height, width)[..., None]).reshape(-1, 3) / np.pi
    normals = cubemap.texel_directions(face_size).reshape(-1, 3) @ environment.to_world
    sums = [np.maximum(part @ lit.T, 0.0) @ weighted for part in np.array_split(normals, 1 + len(lit) * len(normals) // 2**22)]
    return cubemap.SeamlessCube([np.concatenate(sums).reshape(6, face_size, face_size, 3)])


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_d times the bilinear look-up of the map about n."""
    return np.asarray(common.rgb(material["reflectance"])) * twin_map(environment, settings["face_size"]).bilinear(normals, 0)


def tabulated(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """What `twin` is, its texels from `exact_lobe`: quicker for a whole picture."""
    lobe = {"specular_reflectance": material["reflectance"]}
    about_n = {"exponent": 1.0, "face_size": settings["face_size"]}
    return glossy_phong_map.tabulated(environment, normals, normals, lobe, about_n)


TECHNIQUE = Technique(
    id="diffuse-map",
    title="Diffuse, prefiltered cube map",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §3.1; Heidrich, course notes §3.2.1",
    equations="Eq 3–4, course notes Eq 15: L_d(n) = (k_d/π) ∫ L(l) max(0, n·l) dl, tabulated over n",
    parameters=(
        common.material_parameter("reflectance", (0.5, 0.5, 0.5), "albedo k_d"),
        Parameter("face_size", 64, "map face width [texels]", "technique", common.FACE_SIZE.parse, common.FACE_SIZE.expected),
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "Bilinear look-ups between texels (under 0.02 % of the peak at the default size).",
    ),
    stands_for={"diffuse": StandsFor("reflectance as it is", common.diffuse_uniforms)},
    target_bsdf=lambda settings: {"type": "diffuse", "reflectance": settings["reflectance"]},
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=prepare,
    twin=twin,
    twin_bound=2e-3,
    twin_bound_reason="six-point interpolation across a lone sun's horizon, where the clamped cosine has its kink",
    twin_settings={"face_size": 4},
    lifts=lambda settings: lifts.of_tables(tabulated, lifts.exact_diffuse),
)
