"""Radiance of a rough conductor seen from fixed views, and its warp to other views (Cabral, Olano, Nemec 1999), in float64.

Map i holds L_o(v_i, n) over the xy of n in the frame of v_i, as a picture of a ball. For another view v with r = 2(n·v)n − v the
map is read at the normal that mirrors v_i to the same r: **n_i = (r + v_i)/|r + v_i|**. The maps of the three views round v are
blended with λ from [v_a v_b v_c] λ = v, Σλ := 1.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math import fresnel, microfacet, phong
from evalsuite.math.cube_tree import CubeTree
from evalsuite.math.radial_lobe import OPENING, WIDEST
from evalsuite.math.sphere_map import frame

Float = NDArray[np.float64]

#: Of the disc: nearer to the rim (n·v < 0.02) texels repeat this radius.
MAX_RADIUS = 0.9998
#: Points of the albedo's table, at n·v = (i/(ALBEDOS − 1))².
ALBEDOS = 33
#: A map is left out where 1 + r·v_i is less: r = −v_i is its whole rim.
SINGULAR = 1e-3


def views(count: int) -> tuple[Float, NDArray[np.int64]]:
    """Fixed views, (count, 3) unit, and the triangles between them, (20 or 80, 3) indices: 12 corners of an icosahedron, or 42
    with the middles of its edges."""
    golden = 0.5 * (1 + np.sqrt(5))
    points = [np.roll([0.0, a, b * golden], i) for i in range(3) for a in (-1, 1) for b in (-1, 1)]
    # Corners that share an edge are 2 apart, others at least 3.2.
    close = [[np.linalg.norm(p - q) < 2.1 for q in points] for p in points]
    faces = [f for f in combinations(range(12), 3) if all(close[i][j] for i, j in combinations(f, 2))]
    if count == 42:
        middle: dict[tuple[int, int], int] = {}
        for face in faces:
            for i, j in combinations(face, 2):
                if (i, j) not in middle:
                    middle[i, j] = len(points)
                    points.append(points[i] + points[j])
        faces = [
            f
            for a, b, c in faces
            for ab, ac, bc in [(middle[a, b], middle[a, c], middle[b, c])]
            for f in ((a, ab, ac), (b, ab, bc), (c, ac, bc), (ab, ac, bc))
        ]
    fixed = np.array(points)
    return fixed / np.linalg.norm(fixed, axis=1, keepdims=True), np.array(faces)


def texel_normals(width: int) -> Float:
    """Unit normal of each texel in a view's frame (z = v_i), (w, w, 3); the disc's rim lies one texel inside the map's edge."""
    c = (np.arange(width) + 0.5 - 0.5 * width) / (0.5 * width - 1.0)
    disc = np.stack(np.broadcast_arrays(c[None, :], c[:, None]), -1)
    disc = disc * np.minimum(1.0, MAX_RADIUS / np.maximum(np.linalg.norm(disc, axis=-1, keepdims=True), 1e-9))
    return np.concatenate([disc, np.sqrt(1.0 - (disc**2).sum(-1, keepdims=True))], -1)


def albedo_table(distribution: str, alpha: float, eta: ArrayLike, k: ArrayLike) -> Float:
    """∫ f n·l dl with the conductor's Fresnel inside, (ALBEDOS, 3)."""
    cosines = np.maximum((np.arange(ALBEDOS) / (ALBEDOS - 1)) ** 2, 1e-4)
    index = np.asarray(eta, np.float64), np.asarray(k, np.float64)
    return microfacet.albedo(distribution, alpha, cosines, lambda c: fresnel.fresnel_conductor(c[..., None], *index))


def radiance(
    tree: CubeTree,
    view: ArrayLike,
    normals: ArrayLike,
    material: tuple[str, float, ArrayLike, ArrayLike],
    opening: float = OPENING,
) -> Float:
    """L_o(v, n), (P, 3), of a conductor (distribution, α, η, k) for unit views, (3,) or (P, 3), and unit normals (P, 3): the mean
    of L under f n·l, by the tree, times the albedo."""
    distribution, alpha, eta, k = material
    n = np.asarray(normals, np.float64)
    v = np.broadcast_to(np.asarray(view, np.float64), n.shape)
    n_v, index = (n * v).sum(-1), (np.asarray(eta, np.float64), np.asarray(k, np.float64))

    def value(which: NDArray[np.int64], to_light: Float) -> Float:
        half = to_light + v[which]
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        density = microfacet.normal_density(distribution, alpha, (half * n[which]).sum(-1))
        p = density * microfacet.smith_g1(distribution, alpha, (to_light * n[which]).sum(-1))
        return p[:, None] * fresnel.fresnel_conductor(np.clip((half * v[which]).sum(-1), 0.0, 1.0)[:, None], *index)

    width = np.minimum(2.0 * alpha * np.maximum(n_v, 0.3), WIDEST)
    light, whole = tree.integrate(phong.reflect(v, n), value, width, opening)
    table = albedo_table(distribution, alpha, eta, k)
    position = np.sqrt(n_v) * (ALBEDOS - 1)
    albedo = np.stack([np.interp(position, np.arange(ALBEDOS), table[:, c]) for c in range(3)], -1)
    return albedo * light / np.maximum(whole, 1e-30)


def blend(count: int, to_view: ArrayLike, reflected: ArrayLike) -> Float:
    """Weights of all fixed views for to_view and r, (P, 3) each: (P, count), three or fewer of a row not 0, summing to 1."""
    fixed, faces = views(count)
    v, r = np.asarray(to_view, np.float64), np.asarray(reflected, np.float64)
    shares = np.einsum("fij,pj->pfi", inverses(count), v)
    face = shares.min(-1).argmax(1)  # the triangle that v is in
    share = np.maximum(np.take_along_axis(shares, face[:, None, None], 1)[:, 0], 0.0)
    share = np.where(1.0 + np.einsum("pic,pc->pi", fixed[faces[face]], r) > SINGULAR, share, 0.0)
    share /= np.maximum(share.sum(1, keepdims=True), 1e-9)
    out = np.zeros((len(v), count))
    np.put_along_axis(out, faces[face], share, 1)
    return out


def inverses(count: int) -> Float:
    """[v_a v_b v_c]⁻¹ of each triangle, (F, 3, 3): times v it gives λ."""
    fixed, faces = views(count)
    return np.linalg.inv(np.swapaxes(fixed[faces], 1, 2))


def lookup(texels: ArrayLike, view: ArrayLike, reflected: ArrayLike) -> Float:
    """Bilinear (P, C) from one view's map (w, w, C) at the normals that mirror the view to r (P, 3)."""
    texels, r = np.asarray(texels, np.float64), np.asarray(reflected, np.float64)
    width = len(texels)
    middle = r + view
    disc = (middle @ frame(view))[:, :2] / np.maximum(np.linalg.norm(middle, axis=-1, keepdims=True), 1e-9)
    x, y = (disc * (0.5 * width - 1.0) + 0.5 * width - 0.5).T
    i, j = (np.clip(np.floor(c).astype(int), 0, width - 2) for c in (x, y))
    p, q = (x - i)[:, None], (y - j)[:, None]
    upper = (1 - p) * texels[j, i] + p * texels[j, i + 1]
    lower = (1 - p) * texels[j + 1, i] + p * texels[j + 1, i + 1]
    return (1 - q) * upper + q * lower
