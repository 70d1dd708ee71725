"""`cathedral`: a dark nave with candles, a few small bright lamps and stained glass. Metres, y up, altar towards −z."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from room import Room, Vector, glass, glow, save_mesh, save_texture


def stained_glass(random: np.random.Generator, radiance: float, round_window: bool) -> NDArray[np.float64]:
    """Radiance of leaded panes: a rose (rings and sectors) or a lancet (lozenges)."""
    glass_colours = np.array(
        [
            [0.95, 0.10, 0.06],
            [0.06, 0.14, 0.95],
            [0.95, 0.62, 0.08],
            [0.08, 0.62, 0.18],
            [0.45, 0.08, 0.75],
            [0.8, 0.8, 0.7],
        ]
    )
    size = 128
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    if round_window:
        radius, angle = np.hypot(x, y), np.arctan2(y, x) / (2 * np.pi) % 1
        ring = np.minimum((radius * 5).astype(int), 5)
        sector = (angle * np.array([1, 8, 12, 16, 24, 24])[ring]).astype(int)
        lead = (np.abs(radius * 5 % 1 - 0.5) > 0.43) | (radius > 0.98)
        count = np.array([1, 8, 12, 16, 24, 24])[ring]
        lead |= np.abs(angle * count % 1 - 0.5) * radius / count * 2 * np.pi > (0.5 / count * 2 * np.pi * radius - 0.018)
        pane = ring * 31 + sector
    else:
        a, b = (x * 1.5 + y * 4), (x * 1.5 - y * 4)
        lead = (np.abs(a % 1 - 0.5) > 0.42) | (np.abs(b % 1 - 0.5) > 0.42)
        pane = np.floor(a).astype(int) * 17 + np.floor(b).astype(int) * 5
    table = glass_colours[random.integers(0, len(glass_colours), 512)] * (0.4 + 0.8 * random.random((512, 1)))
    return np.where(lead[..., None], 0.01, table[pane % 512]) * radiance


def pointed_arch(half_span: float, spring: float, rise: float, steps: int) -> NDArray[np.float64]:
    """(steps, 2) points (across, height) of a two-centred arch from −half_span to +half_span."""
    across = -half_span * np.cos(np.linspace(0, np.pi, steps))
    radius = (half_span**2 + rise**2) / (2 * half_span)  # both arcs pass through their spring point and the apex
    return np.stack([across, spring + np.sqrt(np.maximum(radius**2 - (np.abs(across) + radius - half_span) ** 2, 0))], -1)


def build(directory: Path) -> None:
    random = np.random.default_rng(2)
    textures, meshes = directory / "textures", directory / "meshes"
    save_texture(textures / "rose.exr", stained_glass(random, 5.0, True))
    for k in range(2):
        save_texture(textures / f"lancet{k}.exr", stained_glass(random, 1.2, False))
    tone = 0.75 + 0.5 * random.random((24, 16, 1))
    blocks = np.repeat(np.repeat(np.array([0.36, 0.32, 0.26]) * tone, 8, 0), 8, 1)
    blocks[::8] *= 0.45
    blocks[:, ::8] *= 0.45
    save_texture(textures / "stones.exr", blocks)
    tiles = np.where((np.indices((8, 8)).sum(0) % 2)[..., None], [0.34, 0.30, 0.25], [0.09, 0.08, 0.08])
    save_texture(textures / "tiles.exr", np.repeat(np.repeat(tiles * (0.8 + 0.4 * random.random((8, 8, 1))), 8, 0), 8, 1))

    front, back, bay = -22.0, 14.0, 4.0
    pillars = np.arange(front + 2, back + 1, bay)
    z = np.array([front, back])

    def extrude(arch: NDArray[np.float64], centre: float, depths: NDArray[np.float64]) -> NDArray[np.float64]:
        shape = (len(arch), len(depths))
        return np.stack(
            [
                np.broadcast_to(arch[:, :1] + centre, shape),
                np.broadcast_to(arch[:, 1:], shape),
                np.broadcast_to(depths, shape),
            ],
            -1,
        )

    vaults = [extrude(pointed_arch(4.0, 10.5, 4.6, 33), 0.0, z)]
    vaults += [extrude(pointed_arch(2.0, 6.0, 2.6, 25), side * 6.0, z) for side in (-1, 1)]
    save_mesh(meshes / "vaults.ply", vaults)

    ribs = []
    for depth in pillars:
        for half, spring, rise, centre, deep in [
            (4.0, 10.5, 4.6, 0, 0.32),
            (2.0, 6.0, 2.6, -6, 0.2),
            (2.0, 6.0, 2.6, 6, 0.2),
        ]:
            outer, inner = pointed_arch(half, spring, rise, 33), pointed_arch(half - deep, spring, rise - deep, 33)
            section = [(outer, -0.22), (inner, -0.16), (inner, 0.16), (outer, 0.22)]
            ribs.append(np.stack([extrude(arch, centre, np.array([depth + dz]))[:, 0] for arch, dz in section]))
    save_mesh(meshes / "ribs.ply", ribs)

    walls = []
    for side in (-1, 1):
        for start in pillars[:-1]:
            arch = pointed_arch(bay / 2 - 0.45, 4.6, 2.6, 25)
            lower = np.concatenate([[[-bay / 2, 4.6]], arch, [[bay / 2, 4.6]]])
            upper = np.stack([lower[:, 0], np.full(len(lower), 10.6)], -1)
            x = [3.7 * side, 3.7 * side, 4.3 * side, 4.3 * side]
            edges = [upper, lower, lower, upper]
            walls.append(
                np.stack(
                    [
                        np.stack([np.full(len(e), c), e[:, 1], e[:, 0] + start + bay / 2], -1)
                        for e, c in zip(edges, x, strict=True)
                    ]
                )
            )
    save_mesh(meshes / "arcade.ply", walls)

    room = Room(
        "Cathedral",
        "a dark nave with candles, a few small bright lamps and stained glass",
        (0.3, 1.7, 0),
        (-1, 3, -6),
        7,
    )
    room.picture("stone", "stones", (9, 5))
    room.picture("tiles", "tiles", (5, 10))
    room.paint("plain", (0.34, 0.30, 0.25))
    room.paint("rib", (0.42, 0.38, 0.31))
    room.paint("vault", (0.26, 0.25, 0.26))
    room.paint("pew", (0.16, 0.075, 0.03))
    room.paint("red", (0.3, 0.03, 0.03))
    room.paint("blue", (0.05, 0.08, 0.35))
    room.paint("cloth", (0.7, 0.66, 0.55))
    room.paint("gold", (0.7, 0.45, 0.1))
    room.paint("iron", (0.04, 0.04, 0.04))
    room.paint("wax", (0.75, 0.68, 0.5))
    room.panel("tiles", (0, 0, (front + back) / 2), (16, back - front), "+y")
    for side, facing in ((-8, "+x"), (8, "-x")):
        room.panel("stone", (side, 4.5, (front + back) / 2), (back - front, 9), facing)
    room.panel("stone", (0, 8, front), (16, 16), "+z")
    room.panel("stone", (0, 8, back), (16, 16), "-z")
    room.mesh("vault", "vaults")
    room.mesh("rib", "ribs")
    room.mesh("plain", "arcade")
    for depth in pillars:
        for x in (-4.0, 4.0):
            room.column("plain", (x, 0, float(depth)), 4.6, 0.42)
            for dx, dz in ((0.36, 0), (-0.36, 0), (0, 0.36), (0, -0.36)):
                room.column("rib", (x + dx, 0, float(depth) + dz), 4.6, 0.13)
            room.box("rib", (x, 0.25, float(depth)), (1.15, 0.5, 1.15))
            room.box("rib", (x, 4.5, float(depth)), (1.1, 0.3, 1.1))
            room.column("rib", (x * 0.925, 4.6, float(depth)), 6.0, 0.14)
        for x in (-7.95, 7.95):
            room.box("rib", (x, 3.0, float(depth)), (0.3, 6.0, 0.5))

    for k, depth in enumerate(pillars[:-1:2] + bay / 2):  # lancets in the left aisle, every other bay
        room.panel("plain", (-7.97, 3.6, float(depth)), (1.0, 3.2), "+x", glass(f"lancet{k % 2}", 0.3))
        for dz in (-0.56, 0.56):
            room.box("rib", (-7.93, 3.6, float(depth) + dz), (0.14, 3.5, 0.12))
    rose_height = 9.6
    room.panel("plain", (0, rose_height, front + 0.05), (5.2, 5.2), "+z", glass("rose"))

    for depth in [d for d in np.arange(-14.5, 13, 1.1) if not -1.4 < d < 1.4]:
        for x in (-2.05, 2.05):
            room.box("pew", (x, 0.45, float(depth)), (2.3, 0.05, 0.42))
            room.box("pew", (x, 0.7, float(depth) + 0.24), (2.3, 0.6, 0.05))
            for dx in (-1.15, 1.15):
                room.box("pew", (x + dx, 0.5, float(depth)), (0.06, 1.0, 0.55))
    room.box("red", (0, 0.006, -4), (1.3, 0.012, 26))
    for k in range(3):
        room.box("rib", (0, 0.09 + 0.18 * k, -19.2), (7 - 1.2 * k, 0.18, 5 - 1.0 * k))
    room.box("cloth", (0, 1.05, -19.4), (2.6, 1.0, 0.9))
    room.box("red", (0, 1.06, -19.4), (0.7, 1.03, 0.93))
    room.box("gold", (0, 2.6, -21.4), (0.14, 2.4, 0.1))
    room.box("gold", (0, 3.1, -21.4), (1.2, 0.14, 0.1))
    room.box("blue", (0, 3.0, -21.85), (4.2, 4.4, 0.08))
    room.box("gold", (0, 5.25, -21.84), (4.4, 0.14, 0.12))
    for k, depth in enumerate(pillars[1:-1]):  # banners on the pillars
        for x in (-3.05, 3.05):
            room.box("red" if k % 2 else "blue", (x, 3.5, float(depth)), (0.03, 1.5, 0.55))
            room.box("gold", (x, 2.72, float(depth)), (0.035, 0.08, 0.57))

    flames = []
    for x, depth in ((-2.9, -2.4), (2.9, 2.9)):  # two stands of votive candles near the eye
        for tier in range(3):
            room.box("iron", (x, 0.8 + 0.2 * tier, depth - 0.22 * tier), (1.1, 0.03, 0.2))
            for k in range(7):
                if random.random() < 0.75:
                    candle(room, flames, random, (x - 0.48 + 0.16 * k, 0.815 + 0.2 * tier, depth - 0.22 * tier), 0.02)
        for dx in (-0.5, 0.5):
            room.box("iron", (x + dx, 0.5, depth - 0.2), (0.03, 1.0, 0.5))
    for k in range(6):  # altar candles
        candle(room, flames, random, (-1.1 + 0.44 * k, 1.55, -19.4), 0.04, 0.5)
    save_mesh(meshes / "flames.ply", flames)
    room.mesh("iron", "flames", glow((1300, 620, 190), 2.0))

    lamps = []
    for depth in (-16.0, -8.0, 4.0):  # lamps on chains, off the middle
        for x in (-2.4, 2.4):
            lamps.append(octasphere((x, 5.2, depth + 0.6), 0.075))
            room.column("iron", (x, 5.28, depth + 0.6), 6.5, 0.015)
            room.column("iron", (x, 5.33, depth + 0.6), 0.06, 0.14)
    save_mesh(meshes / "lamps.ply", lamps)
    room.mesh("iron", "lamps", glow((900, 640, 340), 4.0))
    room.write(directory / "cathedral.xml")


def octasphere(centre: Vector, radius: float, stretch: float = 1.0) -> NDArray[np.float64]:
    """Small lat-long sphere, stretched along y, wound outward (an area light shines from its front only)."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 9), np.linspace(0, 2 * np.pi, 13), indexing="ij")
    unit = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta) * stretch, np.sin(theta) * np.cos(phi)], -1)
    return (np.array(centre) + radius * unit)[:, ::-1]


def candle(
    room: Room,
    flames: list[NDArray[np.float64]],
    random: np.random.Generator,
    foot: Vector,
    radius: float,
    tall: float = 0.1,
) -> None:
    x, y, z = foot
    height = tall * (0.7 + 0.6 * random.random())
    room.column("wax", foot, height, radius)
    flames.append(octasphere((x, y + height + 0.045, z), 0.011 + 0.3 * (radius - 0.02), 2.2))
