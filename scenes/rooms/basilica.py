"""`basilica`: a vast vaulted hall with sixteen high windows, a lantern, a glory and lamps. Metres, y up, altar towards −z."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from room import Room, barrel, glass, glow, panes, save_mesh, save_texture

HALF, SPRING = 12.0, 17.0  # of the barrel vault: radius, and height where it begins
FRONT, BACK, BAY = -44.0, 20.0, 8.0
PIERS = np.arange(FRONT, BACK + 1, BAY)


def build(directory: Path) -> None:
    random = np.random.default_rng(4)
    textures, meshes = directory / "textures", directory / "meshes"
    save_texture(textures / "clerestory-shade.exr", panes(25.0))
    save_texture(textures / "clerestory-sun.exr", panes(75.0))
    tone = np.array([[0.55, 0.5, 0.43], [0.35, 0.16, 0.11], [0.2, 0.22, 0.2]])[random.integers(0, 3, (16, 6))]
    save_texture(textures / "marble.exr", np.repeat(np.repeat(tone * (0.85 + 0.3 * random.random((16, 6, 1))), 8, 0), 8, 1))
    save_mesh(meshes / "basilica-vault.ply", [barrel(HALF, SPRING, FRONT, BACK)])
    ribs = [barrel(HALF - 0.5, SPRING, z - 0.9, z + 0.9, HALF) for z in PIERS]
    save_mesh(meshes / "basilica-ribs.ply", ribs)

    room = Room("Basilica", "a vast vaulted hall with sixteen high windows, a lantern, a glory and lamps",
                (1.5, 1.8, -2.0), (-1, 6, -14), 6)  # fmt: skip
    room.picture("marble", "marble", (3, 3))
    room.paint("wall", (0.42, 0.36, 0.28))
    room.paint("pier", (0.55, 0.5, 0.42))
    room.paint("niche", (0.2, 0.16, 0.13))
    room.paint("vault", (0.48, 0.4, 0.26))
    room.paint("gold", (0.65, 0.42, 0.1))
    room.paint("bronze", (0.1, 0.07, 0.04))
    room.paint("red", (0.35, 0.04, 0.03))

    middle = (FRONT + BACK) / 2
    room.panel("marble", (0, 0, middle), (2 * HALF, BACK - FRONT), "+y")
    for x, facing in ((-HALF, "+x"), (HALF, "-x")):
        room.panel("wall", (x, SPRING / 2, middle), (BACK - FRONT, SPRING), facing)
        room.box("pier", (0.96 * x, 10.6, middle), (1.0, 0.9, BACK - FRONT))
        room.box("pier", (0.97 * x, SPRING, middle), (0.8, 0.6, BACK - FRONT))
        for z in PIERS:
            room.box("pier", (0.95 * x, SPRING / 2, z), (1.2, SPRING, 2.2))
        for z in PIERS[:-1] + BAY / 2:
            room.box("niche", (0.995 * x, 4.5, z), (0.2, 9.0, 4.0))
            room.column("pier", (0.93 * x, 0, z), 2.4, 0.6)  # a statue on its base
            room.ball("pier", (0.93 * x, 4.2, z), 0.35)
            room.column("pier", (0.93 * x, 2.4, z), 1.6, 0.4)
            # Sun on the right, the shaded sky on the left.
            file = "clerestory-sun" if x > 0 else "clerestory-shade"
            room.panel("wall", (0.998 * x, 13.6, z), (2.4, 3.6), facing, glass(file))
    for z, facing in ((FRONT, "+z"), (BACK, "-z")):
        room.panel("wall", (0, 15, z), (2 * HALF, 30), facing)
    room.mesh("vault", "basilica-vault")
    room.mesh("pier", "basilica-ribs")
    room.panel("vault", (0, SPRING + HALF - 0.3, -16), (4.4, 4.4), "-y", glow((60, 66, 75)), kind="disk")
    room.panel("gold", (0, 11, FRONT + 0.4), (7, 7), "+z", kind="disk")
    room.panel("gold", (0, 11, FRONT + 0.45), (3.4, 3.4), "+z", glow((70, 48, 16)), kind="disk")

    # Steps and the canopy over the altar, on four columns; benches; lamps on chains before it.
    for k in range(4):
        room.box("marble", (0, 0.1 + 0.2 * k, -30), (14 - 1.6 * k, 0.2, 11 - 1.6 * k))
    room.box("pier", (0, 1.4, -30), (4.2, 1.2, 1.8))
    for x in (-2.9, 2.9):
        for z in (-32.6, -27.4):
            room.column("bronze", (x, 0.8, z), 8.0, 0.34)
    room.box("bronze", (0, 9.1, -30), (6.8, 0.7, 6.2))
    room.box("gold", (0, 9.9, -30), (5.2, 0.9, 4.6))
    room.ball("gold", (0, 11.0, -30), 0.8)
    for z in np.arange(4.0, 18.0, 1.6):
        for x in (-4.6, 4.6):
            room.box("red", (x, 0.5, z), (6.0, 0.9, 0.6))
    for x, z in ((-6.0, -14.0), (6.0, -14.0), (-5.0, 8.0)):
        room.column("bronze", (x, 7.6, z), 16.0, 0.03)
        room.box("bronze", (x, 7.45, z), (1.0, 0.3, 1.0))
        room.panel("gold", (x, 7.28, z), (0.9, 0.9), "-y", glow((420, 300, 160), 0.5), kind="disk")
    room.write(directory / "basilica.xml")
