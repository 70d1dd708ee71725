"""Writes the textures of `scenes/textures/` anew: `python scenes/generate_textures.py [-o DIRECTORY]`.

A wooden crate's side: four planks in a frame, as one height field h(u, v) in units of the side's width, from which both the
normal map and the shading of the albedo follow. v runs downwards from row 0.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

SIZE = 256
FRAME, GAP, ROUND = 0.14, 0.004, 0.03
FRAME_HEIGHT, GAP_DEPTH, GRAIN_DEPTH = 0.010, 0.008, 0.0006

Float = NDArray[np.float64]


def smoothstep(low: float, high: float, x: Float) -> Float:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def noise(u: Float, v: Float, seed: int) -> Float:
    """Smooth noise in about [−1, 1] from a bicubic-like blend of a random lattice with unit cells."""
    lattice = np.random.default_rng(seed).uniform(-1.0, 1.0, (64, 64))
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    a, b = (np.clip(x - k, 0.0, 1.0) for x, k in ((u, i), (v, j)))
    a, b = a * a * (3 - 2 * a), b * b * (3 - 2 * b)
    corner = lambda di, dj: lattice[(j + dj) % 64, (i + di) % 64]  # noqa: E731
    return (1 - b) * ((1 - a) * corner(0, 0) + a * corner(1, 0)) + b * ((1 - a) * corner(0, 1) + a * corner(1, 1))


def grain(along: Float, across: Float, seed: int) -> Float:
    """Wood grain: rings drawn out along one axis and bent by slow noise."""
    bent = across + 0.03 * noise(3.0 * along, 2.0 * across, seed)
    rings = np.sin(2 * np.pi * (18.0 * bent + 1.5 * noise(2.0 * along, 5.0 * bent, seed + 1)))
    return 0.6 * rings + 0.4 * noise(6.0 * along, 60.0 * bent, seed + 2)


def crate(u: Float, v: Float) -> tuple[Float, Float]:
    """Height and grain at (u, v)."""
    edge = np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v))
    frame = 1.0 - smoothstep(FRAME - ROUND, FRAME, edge)
    inner = (v - FRAME) / (1 - 2 * FRAME) * 4.0
    to_gap = np.abs(inner - np.round(inner)) / 4.0 * (1 - 2 * FRAME)
    planks = smoothstep(GAP, GAP + ROUND, to_gap) - 1.0
    upright = (np.minimum(u, 1 - u) < FRAME) & (np.minimum(u, 1 - u) < np.minimum(v, 1 - v))
    plank = np.clip(np.floor(inner), 0, 3)
    fibres = np.where(upright, grain(v, u, 10), grain(u, v + 0.37 * plank, 20))
    height = FRAME_HEIGHT * frame + GAP_DEPTH * planks * (1 - frame) + GRAIN_DEPTH * fibres
    return height - 0.008 * (1.0 - smoothstep(0.0, 0.025, edge)), fibres


def make() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """(albedo in sRGB, normal map), each (SIZE, SIZE, 3) uint8."""
    centre = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid(centre, centre)
    step = 0.25 / SIZE
    du = (crate(u + step, v)[0] - crate(u - step, v)[0]) / (2 * step)
    dv = (crate(u, v + step)[0] - crate(u, v - step)[0]) / (2 * step)
    height, fibres = crate(u, v)
    normal = np.stack([-du, -dv, np.ones_like(du)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    tone = 0.5 + 0.22 * fibres + 30.0 * np.minimum(height, 0.0)
    dark, light = np.array([0.16, 0.075, 0.03]), np.array([0.62, 0.38, 0.19])
    albedo = dark + np.clip(tone, 0.0, 1.0)[..., None] * (light - dark)  # linear reflectance
    srgb = np.where(albedo <= 0.0031308, 12.92 * albedo, 1.055 * albedo ** (1 / 2.4) - 0.055)
    return np.round(255 * srgb).astype(np.uint8), np.round(255 * (0.5 + 0.5 * normal)).astype(np.uint8)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", type=Path, default=Path(__file__).parent / "textures")
    folder = parser.parse_args().o
    folder.mkdir(parents=True, exist_ok=True)
    for name, texels in zip(("crate-albedo", "crate-normals"), make(), strict=True):
        Image.fromarray(texels).save(folder / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
