"""Integrals of radiance times a lobe by a quadtree over a cubemap's texels: deterministic, and far cheaper than all texels.

As in Barnes, Hut 1986: a node that looks small from where the lobe has its peak is taken as one light at its own centre of
light; others are opened. A point-like sun then stays where it is at every level, and every node holds its exact energy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.cubemap import texel_directions, texel_solid_angles

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CubeTree:
    """Nodes of six quadtrees in depth-first order (N = 6 (4w² − 1)/3). energy: (N, 3) ∫ L dω [W m⁻²]. directions: (N, 3) unit,
    the mean of the texels' weighted with their energy (of three channels together). solid_angles: (N,) [sr]. sizes: (N,) the
    node's extent √Ω, 0 for texels, which cannot be opened. skips: (N,) the next node after a node's own."""

    energy: Float
    directions: Float
    solid_angles: Float
    sizes: Float
    skips: NDArray[np.int64]

    def integrate(
        self, axes: ArrayLike, value: Callable[[NDArray[np.int64], Float], Float], width: ArrayLike, opening: float
    ) -> tuple[Float, Float]:
        """∫ p L dω and ∫ p dω for P lobes, (P, 3) each.

        axes: (P, 3) unit peaks. value: (which lobe (M,), directions (M, 3)) → p (M,) or (M, 3) [sr⁻¹]. width: (P,) scale [rad]
        of the peak. A node is opened where **√Ω > opening · (|direction − axis| + width)**.
        """
        axes = np.asarray(axes, np.float64)
        width = np.broadcast_to(np.asarray(width, np.float64), len(axes))
        light, whole = np.zeros((len(axes), 3)), np.zeros((len(axes), 3))
        lobe = np.arange(len(axes))
        node = np.zeros(len(axes), np.int64)
        while len(lobe):
            d = self.directions[node]
            distance = np.linalg.norm(d - axes[lobe], axis=-1)
            opened = self.sizes[node] > opening * (distance + width[lobe])
            taken = ~opened
            p = value(lobe[taken], d[taken])
            p = p[:, None] if p.ndim == 1 else p
            light[lobe[taken]] += p * self.energy[node[taken]]  # every lobe is at one node at a time
            whole[lobe[taken]] += p * self.solid_angles[node[taken], None]
            node = np.where(opened, node + 1, self.skips[node])
            alive = node < len(self.sizes)
            lobe, node = lobe[alive], node[alive]
        return light, whole


def _preorder(width: int, size: int) -> NDArray[np.int64]:
    """Place in depth-first order, (6, size, size), of the nodes of one level in trees over faces of width²."""
    depth, face_nodes = (width // size).bit_length() - 1, (4 * width * width - 1) // 3
    y, x = np.meshgrid(np.arange(size), np.arange(size), indexing="ij")
    place = np.zeros((size, size), np.int64)
    for bit in range(size.bit_length() - 1):
        # The child's number at the level where cells are 2^bit of this level's, and the nodes in each such subtree.
        child = 2 * ((y >> bit) & 1) + ((x >> bit) & 1)
        subtree = (4 ** (depth + bit + 1) - 1) // 3
        place += 1 + child * subtree
    return place[None] + face_nodes * np.arange(6)[:, None, None]


def build(level0: ArrayLike) -> CubeTree:
    """The tree of a cubemap (6, w, w, 3) of radiance, w a power of two; negative radiance counts as it is in the energy."""
    radiance = np.asarray(level0, np.float64)
    width = radiance.shape[1]
    omega = np.broadcast_to(texel_solid_angles(width)[None, ..., None], (*radiance.shape[:3], 1))
    energy, centres = radiance * omega, texel_directions(width)
    weight = np.abs(energy).sum(-1, keepdims=True)
    # The tiny share of plain solid angle places black nodes in their middle.
    weight = weight + 1e-9 * omega * max(float(weight.sum()), 1e-30)
    quantities = np.concatenate([energy, omega, weight * centres], -1)
    count = 6 * (4 * width * width - 1) // 3
    nodes, sizes, skips = np.empty((count, 7)), np.empty(count), np.empty(count, np.int64)
    size = width
    while size >= 1:
        place = _preorder(width, size).ravel()
        nodes[place] = quantities.reshape(-1, 7)
        sizes[place] = 0.0 if size == width else np.sqrt(quantities[..., 3]).ravel()
        skips[place] = place + (4 * (width // size) ** 2 - 1) // 3
        if size > 1:
            quantities = quantities.reshape(6, size // 2, 2, size // 2, 2, 7).sum((2, 4))
        size //= 2
    moments = nodes[:, 4:]
    return CubeTree(nodes[:, :3], moments / np.linalg.norm(moments, axis=-1, keepdims=True), nodes[:, 3], sizes, skips)
