"""Prefiltering by quadrature over the tree of a cubemap's texels: math.cube_tree."""

from __future__ import annotations

import moderngl
import numpy as np

from evalsuite.gpu import context, programs
from evalsuite.gpu.environment import GpuEnvironment
from evalsuite.math import cube_tree
from evalsuite.math.radial_lobe import OPENING, RadialLobe

COLUMNS = 1024
NODES = 500  # that a lobe takes at most, about, with OPENING


class TreeTextures:
    """A cubemap's tree on the GPU, as library/cube_tree.glsl reads it; kept with its environment."""

    def __init__(self, tree: cube_tree.CubeTree) -> None:
        self._count = len(tree.skips)
        self._textures = {
            "node_direction_skip": _texture(tree.directions, tree.skips),
            "node_energy_solid_angle": _texture(tree.energy, tree.solid_angles),
        }

    def bind(self, shader: moderngl.ComputeShader) -> None:
        """Set the shader up to read this tree."""
        programs.bind_textures(shader, self._textures)
        programs.set_uniforms(shader, {"opening": OPENING, "node_count": self._count})

    def release(self) -> None:
        """Free the textures."""
        for texture in self._textures.values():
            texture.release()


def _texture(vectors: np.ndarray, scalars: np.ndarray) -> moderngl.Texture:
    """(N, 3) and (N,) as RGBA texels, COLUMNS a row. float32 holds the largest skip exactly: N < 2²⁴ to faces of 1024²."""
    rows = -(-len(vectors) // COLUMNS)
    data = np.zeros((rows * COLUMNS, 4), np.float32)
    data[: len(vectors), :3], data[: len(vectors), 3] = vectors, scalars
    texture = context.get().texture((COLUMNS, rows), 4, data.tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def of(env: GpuEnvironment, face_size: int) -> TreeTextures:
    """The tree over the environment's cubemap of that size, made once."""
    return env.kept(("cube-tree", face_size), lambda: TreeTextures(cube_tree.build(env.cube(face_size).level0)))


class TreeLobe:
    """A radial lobe over a tree; a `maps.Filter`."""

    parts = ("library/cube_tree.glsl", "tree_lobe.comp")
    defines = (("NODE_COLUMNS", COLUMNS),)

    def __init__(self, tree: TreeTextures, lobe: RadialLobe) -> None:
        self._tree, self._lobe = tree, lobe
        self._profile = context.get().buffer(lobe.profile.astype(np.float32).tobytes())

    def bind(self, shader: moderngl.ComputeShader) -> int:
        """The tree and the lobe's profile."""
        self._tree.bind(shader)
        self._profile.bind_to_storage_buffer(0)
        programs.set_uniforms(shader, {"lobe_width": self._lobe.width})
        return NODES

    def release(self) -> None:
        """Free the profile."""
        self._profile.release()
