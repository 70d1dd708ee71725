"""Radiance sphere maps of a rough conductor for fixed views, made by compute shader: math.view_maps."""

from __future__ import annotations

import time

import moderngl
import numpy as np

from evalsuite.gpu import context, programs
from evalsuite.gpu.prefilter import maps
from evalsuite.gpu.prefilter.tree import COLUMNS, NODES, TreeTextures
from evalsuite.math import view_maps
from evalsuite.math.sphere_map import frame

Material = tuple[str, float, tuple[float, ...], tuple[float, ...]]


def make(tree: TreeTextures, width: int, views: np.ndarray, material: Material) -> maps.Prefiltered:
    """A texture array, one width² sphere map a view. material: distribution, α, η, k."""
    gl, start = context.get(), time.perf_counter()
    distribution, alpha, eta, k = material
    defines = (("VIEWS", len(views)), ("ALBEDOS", view_maps.ALBEDOS), ("MAX_RADIUS", view_maps.MAX_RADIUS),
               ("NODE_COLUMNS", COLUMNS))  # fmt: skip
    parts = tuple(programs.part(name) for name in ("fresnel.glsl", "library/cube_tree.glsl", "view_maps.comp"))
    shader = programs.compute(parts, defines)
    texture = gl.texture_array((width, width, len(views)), 4, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    frames = np.stack([frame(v).T for v in views])  # GLSL's matrices are column by column
    uniforms = {"alpha": alpha, "beckmann": distribution == "beckmann", "eta": eta, "k": k, "frames": frames,
                "albedo": view_maps.albedo_table(distribution, alpha, eta, k)}  # fmt: skip
    programs.set_uniforms(shader, uniforms)
    tree.bind(shader)
    texture.bind_to_image(0, read=False, write=True)
    maps.dispatch(shader, width, len(views), NODES)
    return maps.finished(texture, start)
