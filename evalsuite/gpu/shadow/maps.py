"""Hard shadows of lights at infinity: for each a map of the depth along its direction of what the light meets first.

Depth is linear, −l·p for a unit direction l to the light, so it has no near or far plane. A map spans what can hide something
from its light, no more. A batch of lights is drawn at once, each into a layer of one texture, by instances of all triangles; the
least depth of a texel is kept by blending. Both sides of a triangle cast.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from evalsuite.gpu import context, programs
from evalsuite.gpu.passes import timed
from evalsuite.math.disc_coverage import tangent_frame
from evalsuite.scene.model import Scene

Float = NDArray[np.float64]
#: Distance from a triangle's plane, as a part of the scene's extent, below which a point counts as on it: float32's positions.
COPLANAR = 1e-6
#: Depths that differ by less, as a part of the scene's extent and of the plane's slope, are one surface: some roundings of
#: float32.
ROUNDING = 2e-6
_TEXELS = 1 << 25  # in one texture: 128 MiB
_MARGIN = 1.0  # texels around the casters


@dataclass(frozen=True, eq=False)
class Fit:
    """Where N maps lie. to_light: (N, 3) unit, world. across, up: (N, 4), world position → texels, from the map's lower left
    corner. texel: (N, 2) a texel's width and height, in units of the scene. nearest: (N,) least depth of a caster."""

    to_light: Float
    across: Float
    up: Float
    texel: Float
    nearest: Float

    def part(self, wanted: slice) -> Fit:
        """Some of the maps."""
        return Fit(*(getattr(self, name)[wanted] for name in ("to_light", "across", "up", "texel", "nearest")))


def _part(name: str) -> programs.Part:
    return programs.Part(name, Path(__file__).with_name(name).read_text(encoding="utf-8"))


class ShadowMaps:
    """Maps of size² texels of a scene's casters, as many at once as `batch`; the texture `depths`, infinite where nothing is.

    batch: what is wanted; fewer where the maps would not fit into memory.
    """

    def __init__(self, scene: Scene, size: int, batch: int) -> None:
        gl = context.get()
        context.check_texture_size("shadow map", size, size)
        self.size, self.batch = size, max(1, min(batch, _TEXELS // size**2))
        triangles = np.concatenate([np.zeros((0, 3, 3)), *(m.positions[m.faces] for m in scene.meshes)]).astype(np.float64)
        self.extent = 2.0 * float(np.linalg.norm(triangles, axis=-1).max(initial=0.0))
        self.support = supports(triangles, COPLANAR * self.extent)
        one_sided = self.support.any(axis=1)
        self._edge, self._edge_support = triangles[one_sided], self.support[one_sided]
        self._inner = hull(triangles[~one_sided].reshape(-1, 3))
        self.triangles = len(triangles)
        data = np.concatenate([triangles, np.repeat(self.support[:, None], 3, axis=1)], axis=-1).astype(np.float32)
        vertex, geometry, fragment = (_part(name) for name in ("map.vert", "map.geom", "map.frag"))
        self._program = programs.program((vertex,), (fragment,), (("LAYERS", self.batch),), (geometry,))
        buffer = gl.buffer(data.tobytes() or bytes(24))
        self._array = gl.vertex_array(self._program, [(buffer, "3f 3f", "in_position", "in_support")])
        self.depths = gl.texture_array((size, size, self.batch), 1, dtype="f4")
        self.depths.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._target = gl.framebuffer([self.depths])
        context.check_errors("setting up shadow maps")

    def fit(self, to_light: ArrayLike) -> Fit:
        """Maps of lights in unit directions (N, 3), about the casters that can hide anything from them."""
        to_light = np.asarray(to_light, np.float64).reshape(-1, 3)
        across, up = (np.array([tangent_frame(d)[k] for d in to_light]).reshape(-1, 3) for k in (0, 1))
        low, high = np.full((len(to_light), 3), np.inf), np.full((len(to_light), 3), -np.inf)
        for i, axes in enumerate(np.stack([across, up, -to_light], axis=-1)):
            casting = self._edge[self._edge_support @ to_light[i] <= 0.0].reshape(-1, 3)
            for corners in (self._inner, casting):
                places = corners @ axes
                low[i] = np.minimum(low[i], places.min(0, initial=np.inf))
                high[i] = np.maximum(high[i], places.max(0, initial=-np.inf))
        # Nothing casts: any map will do.
        low, high = np.where(np.isfinite(low), low, 0.0), np.where(np.isfinite(high), high, 1.0)
        texel = np.maximum(high - low, 1e-6 * max(self.extent, 1e-30))[:, :2] / (self.size - 2.0 * _MARGIN)
        corner = low[:, :2] - _MARGIN * texel
        rows = [
            np.concatenate([axis, -corner[:, k : k + 1]], axis=1) / texel[:, k : k + 1] for k, axis in enumerate((across, up))
        ]
        return Fit(to_light, *rows, texel, low[:, 2])

    def draw(self, fit: Fit) -> float:
        """Fill the first layers with the maps of at most `batch` lights; returns the milliseconds it took."""
        context.get().finish()
        milliseconds = timed(lambda: self._draw(fit))
        context.check_errors("drawing shadow maps")
        return milliseconds

    def _draw(self, fit: Fit) -> None:
        gl = context.get()
        self._target.use()
        self._target.clear(np.inf, np.inf, np.inf, np.inf)
        if not self.triangles or not len(fit.to_light):
            return
        gl.enable_only(moderngl.BLEND)
        gl.blend_equation = moderngl.MIN
        programs.set_uniforms(self._program, self.uniforms(fit))
        self._array.render(moderngl.TRIANGLES, instances=len(fit.to_light))
        gl.blend_equation = moderngl.FUNC_ADD
        gl.enable_only(moderngl.DEPTH_TEST)

    def uniforms(self, fit: Fit) -> dict[str, object]:
        """Of library/shadow_maps.glsl, for the maps of a batch."""
        return {
            "map_to_light": padded(fit.to_light, self.batch),
            "map_across": padded(fit.across, self.batch),
            "map_up": padded(fit.up, self.batch),
            "map_size": float(self.size),
            "map_texel": padded(fit.texel, self.batch),
            "map_nearest": padded(fit.nearest, self.batch),
            "map_rounding": ROUNDING * self.extent,
        }

    def read(self, layers: int) -> NDArray[np.float32]:
        """Depths as last drawn, (layers, size, size), row 0 at the bottom."""
        return np.frombuffer(self.depths.read(), np.float32).reshape(self.batch, self.size, self.size)[:layers]


def supports(triangles: Float, tolerance: float) -> Float:
    """For each triangle (T, 3, 3) the unit normal towards the side of its plane on which all of the others lie, (T, 3); 0 where
    they lie on both."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    points = hull(triangles.reshape(-1, 3))
    low, high = np.zeros(len(triangles)), np.zeros(len(triangles))
    step = max(1, (1 << 22) // max(len(points), 1))
    for first in range(0, len(triangles), step):
        part = slice(first, first + step)
        height = normal[part] @ points.T - (normal[part] * triangles[part, 0]).sum(-1, keepdims=True)
        low[part], high[part] = height.min(1), height.max(1)
    return normal * np.where(low >= -tolerance, 1.0, np.where(high <= tolerance, -1.0, 0.0))[:, None]


def hull(points: Float) -> Float:
    """Corners of the convex hull of points (N, 3), perhaps with some more of the points."""
    points = np.unique(points, axis=0)
    return points if len(points) < 64 else points[ConvexHull(points, qhull_options="QJ Pp").vertices]


def padded(rows: Float, count: int) -> NDArray[np.float32]:
    """As many rows as a shader's array has."""
    out = np.zeros((count, *rows.shape[1:]), np.float32)
    out[: len(rows)] = rows
    return out
