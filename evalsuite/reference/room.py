"""Mitsuba in a scene's real room: the objects within it, its light baked onto its triangles, and its radiance at a point."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.math import cubemap, mesh_colors
from evalsuite.reference.gbuffer import trace_gbuffer
from evalsuite.scene.load import LoadedScene
from evalsuite.scene.model import Room, SceneSource
from evalsuite.scene.room import load_room, room_triangles, within_room

#: Longest edge of the lattice that light is baked on, over the room's extent: 12 cm in a room of 4 m.
SPACING = 1.0 / 32.0
#: Triangles beyond which a bake would take minutes.
MAX_TRIANGLES = 100_000
#: Baking stops when the samples' standard error, on average, is this part of the radiance they reflect, or at MAX_SPP paths.
BAKE_ERROR, MAX_SPP = 0.03, 1024
#: Paths of one batch, on STRATA × STRATA cells; batches are independent, and their scatter is the standard error.
STRATA, MIN_BATCHES = 4, 8


def near_field(loaded: LoadedScene, source: SceneSource) -> LoadedScene:
    """The objects in the room instead of the environment. Raises EvalsuiteError for a scene that names no room, and for a
    room that hides the objects from the camera: the GPU side does not draw it in front of them."""
    placed = within_room(loaded, source)
    alone, inside = (trace_gbuffer(one, 1).material.sum(0) for one in (loaded, placed))
    hidden = int((alone > inside).sum())
    if hidden:
        raise EvalsuiteError(
            source.path,
            f"a room that hides {hidden} of the objects' {int(alone.sum())} pixels from the camera",
            "a free view of the objects",
            "move the camera, the objects or what stands between them",
        )
    return placed


def bake(source: SceneSource) -> Room:
    """The room's triangles with the light that leaves them, path-traced at each point of their lattices along the normal:
    view-independent where surfaces are diffuse. Corners are taken a little inside, where no other surface touches.
    Raises EvalsuiteError for a scene without a room, for shapes that are no triangles and for too many of them."""
    import mitsuba as mi

    triangles = room_triangles(source)
    scene, _ = load_room(source)
    corners, two_sided = triangles.corners, triangles.two_sided
    if len(corners) > MAX_TRIANGLES:
        raise EvalsuiteError(source.path, f"a room of {len(corners)} triangles", f"at most {MAX_TRIANGLES} to bake light onto",
                             "use a simpler room, or the target near-field alone")  # fmt: skip
    extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=-1).max(axis=1)
    divisions = np.clip(np.ceil(longest / (SPACING * extent)), 1, None).astype(np.int32)
    # Every triangle twice, once a side: the back of a one-sided surface is black, and still hides what is behind it.
    corners = np.concatenate([corners, corners[:, ::-1]])
    lit = np.concatenate([np.ones_like(two_sided), two_sided])
    divisions = np.where(lit, np.tile(divisions, 2), 1).astype(np.int32)

    points, normals = _lattice(corners, divisions)
    used = np.repeat(lit, mesh_colors.sample_count(divisions))
    radiance, emission, reflectance = (np.zeros((len(points), 3), np.float32) for _ in range(3))
    offset = 1e-4 * extent
    origin, direction = mi.Point3f((points[used] + offset * normals[used]).T), mi.Vector3f(-normals[used].T)
    count = int(used.sum())
    si = scene.ray_intersect(mi.Ray3f(origin, direction))
    emission[used] = _rows(si.emitter(scene).eval(si), count)
    reflectance[used] = _rows(si.bsdf().eval_diffuse_reflectance(si), count)
    integrator = mi.load_dict({"type": "path", "max_depth": -1})
    radiance[used], error, spp = _average(
        lambda sampler, cell: integrator.sample(scene, sampler, mi.RayDifferential3f(origin, direction))[0],
        count,
        BAKE_ERROR,
        MAX_SPP,
        emission[used],
    )
    reflected = float((radiance - emission)[used].mean())
    relative = float(error.mean()) / reflected if reflected > 0 else 0.0
    return Room(corners.astype(np.float32), divisions, radiance, emission, reflectance, spp, relative)


def _lattice(corners: NDArray[np.float64], divisions: NDArray[np.int32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """World positions and unit normals of all samples, (S, 3), each moved 5 % of a cell towards its triangle's middle."""
    points, normals = [], []
    for triangle, n in zip(corners, divisions, strict=True):
        uv = mesh_colors.lattice(int(n))
        uv = uv + 0.05 / n * (1.0 / 3.0 - uv)
        a, e1, e2 = triangle[0], triangle[1] - triangle[0], triangle[2] - triangle[0]
        points.append(a + uv[:, :1] * e1 + uv[:, 1:] * e2)
        normal = np.cross(e1, e2)
        normals.append(np.broadcast_to(normal / max(np.linalg.norm(normal), 1e-30), points[-1].shape))
    return np.concatenate(points), np.concatenate(normals)


def probe(source: SceneSource, centre: tuple[float, float, float], width: int, error: float, max_spp: int = 4096) -> tuple:
    """The room's radiance at a point, without the scene's objects: (6, w, w, 3) float32 means over the texels of a cubemap,
    and their standard errors. error: relative, mean over the texels, at which sampling stops. Raises EvalsuiteError."""
    import drjit as dr
    import mitsuba as mi

    scene, _ = load_room(source)
    integrator = mi.load_dict({"type": "path", "max_depth": -1})
    count = 6 * width * width
    texel = np.arange(count)
    face, row, column = texel // width**2, texel // width % width, texel % width
    axis, s, t = (mi.Vector3f(table[face].T) for table in (cubemap.AXIS, cubemap.S, cubemap.T))
    column, row, origin = mi.Float(column), mi.Float(row), mi.Point3f(*(float(c) for c in centre))

    def radiance(sampler: Any, cell: Any) -> Any:
        jitter = (cell + sampler.next_2d()) / STRATA
        a, b = 2.0 * (column + jitter.x) / width - 1.0, 2.0 * (row + jitter.y) / width - 1.0
        ray = mi.RayDifferential3f(origin, dr.normalize(axis + a * s + b * t))
        return integrator.sample(scene, sampler, ray)[0]

    mean, deviation, _ = _average(radiance, count, error, max_spp)
    shape = (6, width, width, 3)
    return mean.reshape(shape), deviation.reshape(shape)


def _average(
    sample: Callable[[Any, Any], Any], count: int, error: float, max_spp: int, certain: ArrayLike = 0.0
) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
    """(mean, standard error, samples) of `count` random colours each, (N, 3), until mean error / mean falls to `error`.
    sample: of a Mitsuba sampler and the (x, y) of the cell that this sample's stratified dimensions fall in. certain: part of
    the colours that is known without error, and does not count in that mean."""
    import drjit as dr
    import mitsuba as mi

    def add(i: Any, total: Any, sampler: Any) -> tuple:
        return i + 1, total + sample(sampler, mi.Point2f(mi.Float(i % STRATA), mi.Float(i // STRATA))), sampler

    total, squares, batches = np.zeros((count, 3)), np.zeros((count, 3)), 0
    while True:
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(batches, count)
        start = (mi.UInt32(0), mi.Color3f(0), sampler)
        batch = _rows(dr.while_loop(start, lambda i, *_: i < STRATA**2, add)[1], count) / STRATA**2
        total, squares, batches = total + batch, squares + batch**2, batches + 1
        mean = total / batches
        deviation = np.sqrt(np.maximum(squares / batches - mean**2, 0.0) / max(batches - 1, 1))
        goal = max(error * (mean - certain).mean(), 1e-6 * mean.mean())  # below 1e-6 it is rounding
        enough = batches >= MIN_BATCHES and deviation.mean() <= goal
        if enough or (batches + 1) * STRATA**2 > max_spp:
            break
    if not np.isfinite(mean).all():
        raise EvalsuiteError("room", "NaN or Inf radiance", "finite radiance", "look for extreme BSDF values")
    return mean.astype(np.float32), deviation.astype(np.float32), batches * STRATA**2


def _rows(colours: Any, count: int) -> NDArray[np.float64]:
    """Dr.Jit colours as (N, 3) rows."""
    rows = np.array(colours, dtype=np.float64).T
    return np.broadcast_to(rows, (count, 3))
