"""`chapel`: a plastered church of one nave with a tomb, eight windows and two lamps. Metres, y up, altar towards −z."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from room import Room, barrel, glass, glow, panes, save_mesh, save_texture

HALF, SPRING = 4.5, 7.0  # of the barrel vault: radius, and height where it begins
FRONT, BACK = -11.0, 9.0
PILASTERS = (-10.5, -5.5, -0.5, 4.5, 8.6)


def build(directory: Path) -> None:
    random = np.random.default_rng(3)
    textures, meshes = directory / "textures", directory / "meshes"
    save_texture(textures / "pane-shade.exr", panes(16.0))
    save_texture(textures / "pane-sun.exr", panes(48.0))
    slabs = np.where((np.indices((10, 5)).sum(0) % 2)[..., None], [0.34, 0.14, 0.09], [0.42, 0.39, 0.33])
    save_texture(textures / "slabs.exr", np.repeat(np.repeat(slabs * (0.8 + 0.4 * random.random((10, 5, 1))), 8, 0), 8, 1))
    save_mesh(meshes / "chapel-vault.ply", [barrel(HALF, SPRING, FRONT, BACK)])
    save_mesh(meshes / "chapel-ribs.ply", [barrel(HALF - 0.25, SPRING, z - 0.25, z + 0.25, HALF) for z in PILASTERS])

    room = Room("Chapel", "a church of one nave with a tomb, eight windows and two lamps", (0.5, 1.7, 0.5), (-0.5, 3, -6), 6)
    room.picture("slabs", "slabs", (2, 2))
    room.paint("plaster", (0.46, 0.42, 0.35))
    room.paint("stone", (0.26, 0.25, 0.23))
    room.paint("marble", (0.6, 0.58, 0.55))
    room.paint("porphyry", (0.28, 0.07, 0.06))
    room.paint("wood", (0.14, 0.07, 0.03))
    room.paint("gold", (0.65, 0.42, 0.1))
    room.paint("fresco", (0.12, 0.2, 0.42))
    room.paint("iron", (0.04, 0.04, 0.04))

    middle = (FRONT + BACK) / 2
    room.panel("slabs", (0, 0, middle), (2 * HALF, BACK - FRONT), "+y")
    for x, facing in ((-HALF, "+x"), (HALF, "-x")):
        room.panel("plaster", (x, SPRING / 2, middle), (BACK - FRONT, SPRING), facing)
        room.box("stone", (0.985 * x, 0.5, middle), (0.14, 1.0, BACK - FRONT))
        room.box("stone", (0.97 * x, SPRING, middle), (0.3, 0.3, BACK - FRONT))
        for z in PILASTERS:
            room.box("stone", (0.97 * x, SPRING / 2, z), (0.3, SPRING, 0.5))
        # Sun on the right, the shaded sky on the left.
        for z in (-8.0, -3.0, 2.0):
            room.panel("plaster", (0.997 * x, 4.9, z), (1.1, 2.4), facing, glass("pane-sun" if x > 0 else "pane-shade"))
            for dy, dz, size in ((0, 0.65, (0.3, 2.8, 0.2)), (0, -0.65, (0.3, 2.8, 0.2)), (1.3, 0, (0.3, 0.2, 1.5))):
                room.box("stone", (0.97 * x, 4.9 + dy, z + dz), size)
    for z, facing, file in ((FRONT, "+z", "pane-shade"), (BACK, "-z", "pane-sun")):
        room.panel("plaster", (0, 6, z), (2 * HALF, 12), facing)
        inside = z - 0.03 * np.sign(z)
        room.panel("plaster", (0, 8.2, inside), (1.9, 1.9), facing, glass(file), kind="disk")
    room.mesh("plaster", "chapel-vault")
    room.mesh("stone", "chapel-ribs")

    # The tomb on the left wall, where the lamps are; altar, steps and painting in front; pews behind.
    room.box("marble", (-3.9, 0.3, -3.0), (1.2, 0.6, 3.4))
    room.box("porphyry", (-3.9, 1.05, -3.0), (0.9, 0.9, 2.6))
    room.box("marble", (-3.9, 1.6, -3.0), (1.1, 0.2, 2.9))
    room.column("marble", (-4.0, 1.7, -3.0), 0.7, 0.28)
    room.ball("marble", (-4.0, 2.6, -3.0), 0.26)
    for z in (-4.6, -1.4):
        room.column("marble", (-4.15, 0, z), 3.1, 0.16)
    for k in range(3):
        room.box("stone", (0, 0.09 + 0.18 * k, -9.2), (6 - k, 0.18, 3.4 - 0.8 * k))
    room.box("marble", (0, 1.0, -9.6), (2.4, 1.0, 0.9))
    room.box("gold", (0, 3.9, -10.9), (2.6, 3.6, 0.1))
    room.box("fresco", (0, 3.9, -10.84), (2.2, 3.2, 0.06))
    room.box("gold", (0, 2.0, -9.7), (0.08, 1.0, 0.08))
    room.box("gold", (0, 2.2, -9.7), (0.5, 0.08, 0.08))
    for z in np.arange(2.2, 8.0, 1.1):
        for x in (-2.1, 2.1):
            room.box("wood", (x, 0.45, z), (2.4, 0.06, 0.42))
            room.box("wood", (x, 0.7, z + 0.24), (2.4, 0.6, 0.06))
    for z in (-5.2, -0.8):
        room.column("iron", (-2.6, 0, z), 2.6, 0.03)
        room.panel("iron", (-2.6, 2.75, z), (0.3, 0.3), "-x", glow((300, 235, 150), 0.5), kind="disk")
    room.write(directory / "chapel.xml")
