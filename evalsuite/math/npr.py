"""Non-photorealistic environment maps (Heidrich, course notes §4): the pictures in the sphere map, in float64.

A map is a function of the sphere-map coordinates p = (right, up), |p| ≤ 1 the disc (course notes §2.1). It is looked up as it
is, without a light, so what it returns is a colour, linear Rec.709. The paper gives the maps as small pictures and in words
alone; the shapes and colours here are ours.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf

from evalsuite.math.disc_map import bilinear
from evalsuite.math.phong import reflect
from evalsuite.math.sphere_map import direction_to_disc, disc_to_direction

Float = NDArray[np.float64]

STYLES = ("sketch", "cool-warm", "silhouette", "hatching")
VIEWERS = ("distant", "local")

#: sketch: a square room with a window in each wall, turned about the vertical [degrees]; half the width and height of a window,
#: its middle above the eye, half the thickness of its bars, all over the distance to the wall. Straight behind lies a pane: the
#: whole rim of the map is that direction, and MIP levels would carry a bar's black inwards.
ROOM_TURN, WINDOW, RAISED, BAR = 25.0, (0.62, 0.66), 0.2, 0.055
#: cool-warm: its two colours; in the map, towards the light; centre of the white circle along it, its radius, and the blur σ, in
#: radii of the map.
COOL, WARM = (0.05, 0.08, 0.35), (0.7, 0.5, 0.08)
LIGHT, CIRCLE, CIRCLE_RADIUS, BLUR = (-np.sqrt(0.5), np.sqrt(0.5)), 0.5, 0.2, 0.12
#: hatching: radii of the map from which the two sets of strokes grow, until at the rim they cover half the paper.
HATCH_FROM = (0.45, 0.75)


def coordinates(normals: ArrayLike, to_view: ArrayLike, frame: ArrayLike, viewer: str = "distant") -> Float:
    """Sphere-map coordinates p, (..., 2).

    normals, to_view: (..., 3) unit, world. frame: (3, 3), rows right, up and v₀ (towards the viewer) of the camera.
    viewer: "distant": p is where the sphere map for v₀ holds r = 2(n·v)n − v (math.sphere_map.direction_to_disc); "local": the
    same with v₀ turned to each point's own v and the frame with it. Then h = n, **p = (n·right, n·up)**, and silhouettes lie on
    the rim for any viewer.
    """
    n, v, frame = (np.asarray(x, dtype=np.float64) for x in (normals, to_view, frame))
    if viewer == "local":
        right = np.cross(frame[1], v)
        right /= np.linalg.norm(right, axis=-1, keepdims=True)
        return np.stack([(n * right).sum(-1), (n * np.cross(v, right)).sum(-1)], -1)
    return np.stack(direction_to_disc(reflect(v, n) @ frame.T), -1)


def colour(style: str, p: ArrayLike, parameters: Mapping[str, object], footprint: ArrayLike = 0.0) -> Float:
    """The map itself, (..., 3), at p (..., 2). parameters: as the `npr` plugin's. footprint: (...) what one pixel spans of p,
    for `silhouette`, whose ring is that many times `width` wide. Raises KeyError for an unknown style."""
    p = np.asarray(p, dtype=np.float64)
    if style == "cool-warm":
        return cool_warm(p, parameters["cool"], parameters["warm"])
    ink = {
        "sketch": lambda: window_bars(p),
        "silhouette": lambda: 1.0 - np.linalg.norm(p, axis=-1) < float(parameters["width"]) * np.asarray(footprint),
        "hatching": lambda: strokes(p, float(parameters["strokes"])),
    }[style]()
    return np.repeat(np.where(ink, 0.0, 1.0)[..., None], 3, axis=-1)


def window_bars(p: Float) -> NDArray[np.bool_]:
    """Where the reflection of the room shows a bar of a window, (...): on the wall that the direction at p meets, bars run along
    the window's edges and its two middle lines."""
    x, y, z = np.moveaxis(disc_to_direction(p[..., 0], p[..., 1]), -1, 0)
    turn = np.radians(ROOM_TURN)
    x, z = np.abs(np.cos(turn) * x - np.sin(turn) * z), np.abs(np.sin(turn) * x + np.cos(turn) * z)
    wall = np.maximum(x, z)
    across, up = np.minimum(x, z) / wall, np.abs(y / wall - RAISED)
    inside = (across < WINDOW[0] + BAR) & (up < WINDOW[1] + BAR)
    bar = (np.minimum(across, np.abs(across - WINDOW[0])) < BAR) | (np.minimum(up, np.abs(up - WINDOW[1])) < BAR)
    return inside & bar


def cool_warm(p: Float, cool: ArrayLike, warm: ArrayLike) -> Float:
    """Two triangles, a warm one towards the light and a cool one, a white circle in the warm one, and a Gaussian blur over all
    (Gooch et al. 1998 through the course notes): **cool + Φ(s/σ)(warm − cool) + B(white − warm)**, s = p·light, Φ the normal
    distribution and B the blurred circle."""
    cool, warm = np.asarray(cool, dtype=np.float64), np.asarray(warm, dtype=np.float64)
    light = np.asarray(LIGHT)
    towards = 0.5 * (1.0 + erf((p @ light) / (BLUR * np.sqrt(2.0))))[..., None]
    circle = blurred_disc(np.linalg.norm(p - CIRCLE * light, axis=-1))[..., None]
    return cool + towards * (warm - cool) + circle * (1.0 - warm)


def chords(nodes: int = 16) -> tuple[Float, Float, Float]:
    """Gauss–Chebyshev rule over the chords of the white circle: position x, half length c, weight, each (nodes,)."""
    angle = np.pi * (np.arange(nodes) + 0.5) / nodes
    return CIRCLE_RADIUS * np.cos(angle), CIRCLE_RADIUS * np.sin(angle), np.pi / nodes * CIRCLE_RADIUS * np.sin(angle)


def blurred_disc(distance: Float) -> Float:
    """Disc of CIRCLE_RADIUS ρ under a Gaussian blur of σ = BLUR, at a distance d from its centre:
    **B(d) = ∫_{−ρ}^{ρ} g(x − d) erf(√(ρ² − x²) / (√2 σ)) dx**, g the normal density; good to 1e-6 with 16 chords."""
    out = np.zeros_like(distance)
    for x, half, weight in zip(*chords(), strict=True):
        density = np.exp(-0.5 * ((x - distance) / BLUR) ** 2) / (BLUR * np.sqrt(2.0 * np.pi))
        out += weight * density * erf(half / (BLUR * np.sqrt(2.0)))
    return out


def strokes(p: Float, count: float) -> NDArray[np.bool_]:
    """Where a stroke lies, (...): `count` parallel diagonal strokes over the map's width, each as much wider as it nears the rim,
    and a second set across them nearer to it."""
    radius = np.linalg.norm(p, axis=-1)
    out = np.zeros(radius.shape, bool)
    for start, sign in zip(HATCH_FROM, (1.0, -1.0), strict=True):
        cover = 0.5 * np.clip((radius - start) / (1.0 - start), 0.0, 1.0)
        along = 0.5 * count * np.sqrt(0.5) * (p[..., 0] + sign * p[..., 1])
        out |= np.abs(along - np.floor(along) - 0.5) < 0.5 * cover
    return out


def texel_positions(size: int, subsamples: int = 1) -> Float:
    """p at the centres of a map's texels, or of k × k parts of them, (size·k, size·k, 2); row 0 is the bottom, as in OpenGL."""
    centre = 2.0 * (np.arange(size * subsamples) + 0.5) / (size * subsamples) - 1.0
    up, right = np.meshgrid(centre, centre, indexing="ij")
    return np.stack([right, up], -1)


def levels(style: str, parameters: Mapping[str, object], size: int, hierarchy: str = "box", subsamples: int = 4) -> list[Float]:
    """MIP levels of a map, (w, w, 3) from w = size to 1, each texel its mean over subsamples² points.

    hierarchy: "box": 2 × 2 means of the level below. "equal": for `silhouette`, each level drawn afresh with a ring of `width` of
    its own texels, so that silhouettes are as wide on the screen, in pixels, whatever level their curvature asks for.
    """

    def draw(width: int) -> Float:
        if style != "silhouette":  # a row of texels at a time stays in the processor's caches
            rows = texel_positions(width, subsamples).reshape(width, subsamples, width * subsamples, 2)
            fine = [colour(style, row, parameters).reshape(subsamples, width, subsamples, 3).mean((0, 2)) for row in rows]
            return np.stack(fine)
        k = 1 if width > 64 else 8  # the edge is sharp within a texel by itself, and straight in the larger levels
        inside = 0.5 * width * (1.0 - np.linalg.norm(texel_positions(width, k), axis=-1)) - float(parameters["width"])
        share = np.clip(0.5 + k * inside, 0.0, 1.0).reshape(width, k, width, k).mean((1, 3))
        return np.repeat(share[..., None], 3, axis=-1)

    out = [draw(size)]
    while out[-1].shape[0] > 1:
        fine = out[-1]
        width = fine.shape[0] // 2
        out.append(draw(width) if hierarchy == "equal" else fine.reshape(width, 2, width, 2, 3).mean((1, 3)))
    return out


def trilinear(chain: list[Float], p: ArrayLike, lod: ArrayLike) -> Float:
    """Look-up between levels, (..., 3), at p (..., 2); lod: (...) λ, clamped to the chain."""
    p = np.asarray(p, dtype=np.float64)
    lod = np.broadcast_to(np.clip(lod, 0.0, len(chain) - 1.0), p.shape[:-1])
    out = np.zeros((*p.shape[:-1], 3))
    for number, level in enumerate(chain):
        weight = np.maximum(0.0, 1.0 - np.abs(lod - number))
        used = weight > 0
        x, y = np.moveaxis(0.5 * (p[used] + 1.0) * len(level), -1, 0)
        out[used] += weight[used][..., None] * bilinear(level, x, y)
    return out
