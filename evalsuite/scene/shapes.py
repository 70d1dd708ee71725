"""Mitsuba shapes to triangles and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.scene.model import TriangleMesh
from evalsuite.scene.tessellate import CANONICAL, Triangles, orient, place, unweld

MESHES = ("ply", "obj", "serialized", "cube", "rectangle")


def shape_triangles(shape: Any, plugin: str) -> Triangles | None:
    """World-space triangles of a Mitsuba shape, None for one that is neither a mesh nor in `tessellate.CANONICAL`.

    The winding is counter-clockwise seen from the side that Mitsuba's shading normals point to, whatever mirroring
    transforms or `flip_normals` did. Meshes without vertex normals come back unwelded. Raises EvalsuiteError for a mesh
    without triangles, or whose vertices are not finite.
    """
    if plugin in CANONICAL:
        return _tessellated(shape, plugin)
    if plugin not in MESHES:
        return None
    import drjit as dr
    import mitsuba as mi

    if not shape.face_count():
        raise EvalsuiteError(f"shape '{shape.id()}'", "no triangles", "a mesh with at least one", "mend its file")
    vertices, triangles = dr.arange(mi.UInt32, shape.vertex_count()), dr.arange(mi.UInt32, shape.face_count())
    positions = _rows(shape.vertex_position(vertices), shape.vertex_count())
    if not np.isfinite(positions).all():
        raise EvalsuiteError(f"shape '{shape.id()}'", "a vertex at NaN or Inf", "finite positions", "mend its file")
    uvs = _rows(shape.vertex_texcoord(vertices), shape.vertex_count()) if shape.has_vertex_texcoords() else None
    faces = _rows(shape.face_indices(triangles), shape.face_count()).astype(np.uint32)
    seen = _seen_normals(shape)
    if not shape.has_vertex_normals() or shape.has_face_normals():
        return unweld(positions, seen, orient(positions, seen, faces), uvs)
    normals = _rows(shape.vertex_normal(vertices), shape.vertex_count())
    if np.einsum("ij,ij->", normals[faces].sum(axis=1), seen) < 0.0:  # flip_normals turns them at look-up only
        normals = -normals
    return Triangles(positions, normals, uvs, orient(positions, normals[faces].sum(axis=1), faces))


def mitsuba_mesh(mesh: TriangleMesh, bsdf: Any, emitter: Any | None = None) -> Any:
    """Mitsuba mesh with exactly the model's vertices, normals, uvs and faces."""
    import mitsuba as mi

    properties = mi.Properties()
    properties["bsdf"] = bsdf
    if emitter is not None:
        properties["emitter"] = emitter
    properties.set_id(mesh.name)
    result = mi.Mesh(mesh.name, len(mesh.positions), len(mesh.faces), properties, True, mesh.uvs is not None)
    parameters = mi.traverse(result)
    parameters["vertex_positions"] = mi.Float(mesh.positions.ravel())
    parameters["vertex_normals"] = mi.Float(mesh.normals.ravel())
    parameters["faces"] = mi.UInt32(mesh.faces.ravel())
    if mesh.uvs is not None:
        parameters["vertex_texcoords"] = mi.Float(mesh.uvs.ravel())
    parameters.update()
    return result


def _tessellated(shape: Any, plugin: str) -> Triangles:
    import mitsuba as mi

    matrix = np.array(mi.traverse(shape)["to_world"].matrix, dtype=np.float64).reshape(4, 4)
    return place(CANONICAL[plugin](), matrix, _faces_inward(shape, place(CANONICAL[plugin](), matrix, inward=False)))


def _faces_inward(shape: Any, outward: Triangles) -> bool:
    """Whether Mitsuba's normals oppose the outward ones, asked by a ray: which of mirroring and `flip_normals` count
    differs from shape to shape, and the shapes' own flags do not always tell."""
    import mitsuba as mi

    corners = outward.faces[len(outward.faces) // 3]
    point, normal = outward.positions[corners].mean(axis=0), outward.normals[corners].mean(axis=0)
    normal /= np.linalg.norm(normal)
    size = np.linalg.norm(np.ptp(outward.positions, axis=0))
    ray = mi.Ray3f(mi.Point3f((point + 0.05 * size * normal).tolist()), mi.Vector3f((-normal).tolist()))
    hit = mi.load_dict({"type": "scene", "shape": shape}, optimize=False).ray_intersect(ray)
    if not hit.is_valid()[0]:
        return bool(shape.has_flipped_normals())
    return bool(np.ravel(np.array(hit.sh_frame.n)) @ normal < 0.0)


def _seen_normals(mesh: Any) -> NDArray[np.float64]:
    """(F, 3) shading normals that Mitsuba reports at the triangles' centres."""
    import drjit as dr
    import mitsuba as mi

    count = mesh.face_count()
    hit = dr.zeros(mi.PreliminaryIntersection3f, count)
    hit.t, hit.prim_index, hit.prim_uv = 1.0, dr.arange(mi.UInt32, count), mi.Point2f(1.0 / 3.0, 1.0 / 3.0)
    hit.shape = mi.ShapePtr(mesh)
    ray = dr.zeros(mi.Ray3f, count)
    ray.d = mi.Vector3f(0.0, 0.0, 1.0)
    return _rows(mesh.compute_surface_interaction(ray, hit).sh_frame.n, count)


def _rows(columns: Any, count: int) -> NDArray[np.float64]:
    """Dr.Jit vectors as (count, D) rows; a literal, which has width 1, is repeated."""
    rows = np.array(columns, dtype=np.float64).T
    return np.array(np.broadcast_to(rows, (count, rows.shape[1])))
