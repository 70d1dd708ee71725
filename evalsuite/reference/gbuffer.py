"""What Mitsuba's camera sees, at the sub-pixel positions that the GPU side uses too: one half of the certificate."""

from __future__ import annotations

import numpy as np

from evalsuite.math.pixel import subsamples
from evalsuite.scene.load import LoadedScene
from evalsuite.scene.model import GBuffer

#: A ray that meets an edge between two triangles exactly can slip through between them, and symmetric scenes line edges up
#: with such positions (a cube's diagonals, a sphere seen along its pole). A thousandth of a pixel aside, none does.
ASIDE = (1.0e-3, 0.6e-3)


def trace_gbuffer(loaded: LoadedScene, supersample: int = 4) -> GBuffer:
    """GBuffer of a loaded scene from supersample² rays a pixel, through Mitsuba's own sensor, shapes and environment."""
    import drjit as dr
    import mitsuba as mi

    width, height = loaded.scene.camera.size
    count = width * height
    index = dr.arange(mi.UInt32, count)
    x, y = mi.Float(index % width), mi.Float(index // width)
    material_of = material_table(loaded)
    two_sided = np.array([m.two_sided for m in loaded.scene.materials] + [False])
    to_world = loaded.scene.camera.to_world
    eye, axis = to_world[:3, 3], to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])

    hits = np.zeros(count)
    per_material = np.zeros((len(loaded.scene.materials), count))
    depth = np.zeros(count)
    normal, position, background = (np.zeros((count, 3)) for _ in range(3))
    for place in subsamples(supersample):
        # Opaque offsets: one kernel serves all sub-samples.
        dx, dy = (dr.opaque(mi.Float, k + aside) for k, aside in zip(place, ASIDE, strict=True))
        film = mi.Point2f((x + dx) / width, (y + dy) / height)
        ray, _ = loaded.sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
        si = loaded.mitsuba.ray_intersect(ray)
        seen = dr.zeros(mi.SurfaceInteraction3f, count)
        seen.wi = -ray.d
        sky = loaded.environment.eval(seen) if loaded.environment is not None else mi.Color3f(0.0)
        shape = dr.reinterpret_array(mi.UInt32, si.shape)
        dr.eval(si.p, si.sh_frame.n, si.wi, shape, sky)

        hit = np.array(si.is_valid())
        point, facing = np.array(si.p, np.float64).T, np.array(si.wi.z)
        owner = material_of[np.array(shape)]
        n = np.array(si.sh_frame.n, np.float64).T
        n = np.where((two_sided[owner] & (facing < 0.0))[:, None], -n, n)
        hits += hit
        for material in range(len(per_material)):
            per_material[material] += hit & (owner == material)
        depth += np.where(hit, (point - eye) @ axis, 0.0)
        normal += np.where(hit[:, None], n, 0.0)
        position += np.where(hit[:, None], point, 0.0)
        background += np.broadcast_to(np.array(sky, np.float64).T, (count, 3))

    some = np.maximum(hits, 1.0)
    length = np.linalg.norm(normal, axis=1, keepdims=True)

    def picture(values: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(values.reshape(height, width, *values.shape[1:]), dtype=np.float32)

    samples = supersample**2
    return GBuffer(
        coverage=picture(hits / samples),
        material=(per_material / samples).reshape(-1, height, width).astype(np.float32),
        depth=picture(depth / some),
        normal=picture(normal / np.where(length > 0.0, length, 1.0)),
        position=picture(position / some[:, None]),
        background=picture(background / samples),
    )


def material_table(loaded: LoadedScene) -> np.ndarray:
    """Dr.Jit registry id of a shape → index of its material, −1 for none (a miss has id 0)."""
    import drjit as dr
    import mitsuba as mi

    ids = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]) for shape in loaded.mitsuba.shapes()]
    table = np.full(max(ids, default=0) + 1, -1)
    table[ids] = loaded.shape_materials
    return table
