"""Mirror reflection by a sphere map (Heidrich, course notes §2.1; Heidrich and Seidel 1998, §2)."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, mirror
from evalsuite.gpu.techniques.base import SAMPLING, Float, Parameter, Prepared, Settings, Technique
from evalsuite.math import disc_map, phong, sphere_map
from evalsuite.math.sphere import latlong_lookup, latlong_spacing
from evalsuite.scene.model import Environment, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment


def _view(value: object) -> tuple[float, float, float]:
    parts = value.replace(",", " ").split() if isinstance(value, str) else value
    view = np.asarray([float(x) for x in parts])
    if view.shape != (3,) or not 0 < np.linalg.norm(view) < np.inf:
        raise ValueError(value)
    return tuple(float(x) for x in view / np.linalg.norm(view))


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """radius and view where they are not given."""
    from evalsuite.gpu import camera

    towards_viewer = -camera.viewing_axis(scene.camera)
    return {
        "radius": settings["radius"] or sphere_map.matched_radius(mirror.finest_face_size(scene)),
        "view": settings["view"] or _view(towards_viewer),
    }


def _size(radius: float) -> tuple[int, float]:
    """(width, border) of a map with a disc of this radius and at least a texel around it."""
    size = 2 * ceil(radius + 1.0)
    return size, 0.5 * size - radius


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The map for v₀ = view."""
    from evalsuite.gpu import disc_maps

    size, border = _size(settings["radius"])
    made = disc_maps.sphere(env, size, border, settings["view"])
    uniforms = {"world_to_map": sphere_map.frame(settings["view"]).T, "sphere_scale": settings["radius"] / size}
    note = (f"sphere map of {size}² texels, disc radius {settings['radius']:.2f}; resampling changed the map's energy by "
            f"{made.energy_residual:+.1e}")  # fmt: skip
    return Prepared(uniforms, {"sphere_map": made.textures[0]}, made.prepare_ms, (note,))


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) times the bilinear look-up at the xy of (v₀ + r)/‖v₀ + r‖. Only the texels that are looked up are resampled."""
    (size, border), frame = _size(settings["radius"]), sphere_map.frame(settings["view"])
    x, y = (0.5 * size + settings["radius"] * v for v in sphere_map.direction_to_disc(phong.reflect(to_view, normals) @ frame))
    texels = sphere_map.resample(
        lambda d: latlong_lookup(environment.radiance, d @ frame.T @ environment.to_world),
        size, border, sphere_map.subsamples(size, border, latlong_spacing(*environment.radiance.shape[:2])),
        disc_map.footprint(size, x, y),
    )  # fmt: skip
    return mirror.factor(normals, to_view, material) * disc_map.bilinear(texels, x, y)


TECHNIQUE = Technique(
    id="mirror-sphere",
    title="Mirror, sphere map",
    paper="Heidrich: Environment Maps and Their Applications (course notes), §2.1",
    equations="r = 2(n·v)n − v; L = F(n·v) · texture(map, xy of (v₀ + r)/‖v₀ + r‖)",
    parameters=(
        mirror.SPECULAR_REFLECTANCE,
        Parameter("view", None, "v₀, the direction to the viewer that the map is made for; default: against the camera's axis",
                  "technique", _view, "three numbers, not all 0"),
        Parameter("radius", None, "radius of the disc [texels]; default: so that it holds as many texels as mirror-cube's faces",
                  "technique", common.number(4.0, 4000.0), "a number from 4 to 4000"),
    ),
    assumptions=(
        mirror.DISTANT,
        "A bilinear look-up in the ball's picture resembles one in the map's own; towards r = −v₀, the rim, it cannot.",
    ),
    stands_for=mirror.STANDS_FOR,
    target_bsdf=mirror.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=prepare,
    twin=twin,
    twin_settings={"radius": 64.0},
    fill=fill,
    lifts=mirror.lifted(twin),
    left=SAMPLING,
)  # fmt: skip
