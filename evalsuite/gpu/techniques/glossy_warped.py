"""Glossy reflection from view-dependent sphere maps of a few fixed views, warped to the view at hand (Cabral et al. 1999)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, rough_conductor
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import cube_tree, phong, view_maps
from evalsuite.math.sphere_map import frame
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """The factor alone. Raises EvalsuiteError for a lobe or a Fresnel curve other than the maps'."""
    rough_conductor.require_same(TECHNIQUE.id, material, settings, ("alpha", "distribution", "eta", "k"))
    return {"specular_reflectance": common.colour(material, "specular_reflectance")}


def _lobe(settings: Settings) -> tuple[str, float, tuple[float, ...], tuple[float, ...]]:
    return tuple(settings[name] for name in ("distribution", "alpha", "eta", "k"))


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """One sphere map a view."""
    from evalsuite.gpu.prefilter import tree
    from evalsuite.gpu.prefilter import view_maps as gpu_maps

    size, width, count = settings["face_size"], settings["map_size"], settings["views"]
    views, faces = view_maps.views(count)

    def make() -> object:
        return gpu_maps.make(tree.of(env, size), width, views, _lobe(settings))

    made = env.kept(("warped", *(settings[p.name] for p in _SHAPING)), make)
    frames = np.stack([frame(v).T for v in views])  # GLSL's matrices are column by column
    inverses = np.swapaxes(view_maps.inverses(count), 1, 2)
    values = {"view_frames": frames, "triangles": faces, "to_shares": inverses, "map_size": float(width)}
    return Prepared(values, {"view_maps": made.texture}, env.cube(size).prepare_ms + made.prepare_ms)


@lru_cache(maxsize=16)
def _maps(environment: Environment, *shaping: object) -> list[Float]:
    settings = dict(zip((p.name for p in _SHAPING), shaping, strict=True))
    tree = cube_tree.build(common.twin_cube(environment, settings["face_size"]).levels[0])
    normals, shape = view_maps.texel_normals(settings["map_size"]).reshape(-1, 3), (settings["map_size"],) * 2 + (3,)
    fixed, _ = view_maps.views(settings["views"])
    world = np.concatenate([normals @ frame(v).T for v in fixed])
    radiance = view_maps.radiance(tree, np.repeat(fixed, len(normals), 0), world, _lobe(settings))
    return list(radiance.reshape(len(fixed), *shape))


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Σ λ_i M_i(n_i) of the three views round v, in float64."""
    maps, (fixed, _) = _maps(environment, *(settings[p.name] for p in _SHAPING)), view_maps.views(settings["views"])
    r = phong.reflect(to_view, normals)
    share, total = view_maps.blend(settings["views"], to_view, r), np.zeros((len(r), 3))
    for texels, view, weight in zip(maps, fixed, share.T, strict=True):
        used = weight > 0
        total[used] += weight[used, None] * view_maps.lookup(texels, view, r[used])
    return rough_conductor.reflectance(material)[0] * total


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size from the map's width; map_size so that a lobe spans a few texels."""
    filled = common.fill_face_size(scene, settings)
    if settings["map_size"] is None:
        filled["map_size"] = int(np.clip(1 << int(np.ceil(np.log2(12.0 / settings["alpha"]))), 32, 128))
    return filled


#: What the maps depend on.
_SHAPING = (
    rough_conductor.ALPHA,
    rough_conductor.DISTRIBUTION,
    rough_conductor.ETA,
    rough_conductor.K,
    Parameter("views", 12, "fixed views: the corners of an icosahedron, or with the middles of its edges 42", "technique",
              lambda value: int(common.choice("12", "42")(value)), "12 or 42"),
    Parameter("map_size", None, "width of a view's sphere map [texels]; default: the smallest power of two above 12/α, within "
              "32 … 128", "technique", common.integer(8, 1024), "a whole number from 8 to 1024"),
    common.FACE_SIZE,
)  # fmt: skip

TECHNIQUE = Technique(
    id="glossy-warped",
    title="Glossy, warped sphere maps of fixed views",
    paper="Cabral, Olano, Nemec: Reflection Space Image Based Rendering, 1999; Heidrich: Environment Maps and Their Applications "
    "(course notes), §3.2.4",
    equations="Eq 20: M_i(n) = L_o(v_i, n); n_i = (r + v_i)/|r + v_i|; L_o(v, n) ≈ Σ λ_i M_i(n_i), [v_a v_b v_c] λ = v, Σλ := 1",
    parameters=(*_SHAPING, rough_conductor.SPECULAR),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "Radiance belongs to r: the fixed views' lobes about the same r have the right angle of incidence and the right plane of "
        "it (12 views lie up to 37° off, 42 up to 21°).",
        "Fresnel is exact and inside the integral, per light direction, but at the fixed views' angles of incidence.",
        "The maps are those of one material: α, η and k are in them.",
        "The view at hand is each pixel's own (the paper's maps are for an orthographic one).",
    ),
    stands_for={"roughconductor": StandsFor("roughconductor as it is, GGX or Beckmann", uniforms)},
    target_bsdf=rough_conductor.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=prepare,
    twin=twin,
    twin_bound=4e-3,
    twin_bound_reason="float32 directions of the resampled map at the edge of the sun, 10⁵ × the sky (1.3·10⁻³ there, 3·10⁻⁴ in "
    "the cathedral, 3·10⁻⁵ elsewhere)",
    twin_settings={"face_size": 32, "map_size": 12},
    defines=lambda settings: {
        "VIEWS": settings["views"],
        "TRIANGLES": 2 * settings["views"] - 4,  # Euler
        "SINGULAR": view_maps.SINGULAR,
    },
    fill=fill,
)
