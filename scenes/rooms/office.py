"""`office`: a room evenly lit by four windows on an overcast day and by ceiling panels. Metres, y up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from room import Colour, Room, Vector, glass, glow, save_texture


def planks(random: np.random.Generator) -> NDArray[np.float64]:
    """Oak floor: 8 × 2 staggered planks with grain."""
    image = np.zeros((128, 128, 3))
    grain = random.random((128, 1)) * 0.5 + random.random((128, 128)) * 0.25
    for row in range(8):
        for half in range(2):
            start = (half * 64 + row * 23) % 128
            columns = np.arange(start, start + 64) % 128
            tone = 0.75 + 0.5 * random.random()
            block = np.ix_(np.arange(row * 16, row * 16 + 16), columns)
            image[block] = np.array([0.36, 0.22, 0.115]) * tone * (0.75 + 0.5 * grain[block])[..., None]
            image[row * 16 : row * 16 + 16, start] *= 0.4
        image[row * 16] *= 0.4
    return image


def stripes(random: np.random.Generator, colours: list[Colour]) -> NDArray[np.float64]:
    """Abstract painting: overlapping bands and discs of the given colours."""
    y, x = np.mgrid[0:64, 0:64] / 63.0
    image = np.broadcast_to(colours[0], (64, 64, 3)).copy()
    for k in range(14):
        colour = np.array(colours[k % len(colours)]) * (0.7 + 0.4 * random.random())
        cx, cy, angle, size = random.random(), random.random(), random.random() * np.pi, 0.06 + 0.16 * random.random()
        band = np.abs((x - cx) * np.cos(angle) + (y - cy) * np.sin(angle)) < size / 3
        disc = (x - cx) ** 2 + (y - cy) ** 2 < size**2
        image[disc if k % 2 else band] = colour
    return image


def overcast_view(random: np.random.Generator) -> NDArray[np.float64]:
    """Radiance seen through a window: a bright overcast sky above roofs and trees (row 0 at the top)."""
    height, width = 96, 96
    v = np.linspace(0, 1, height)[:, None, None]
    image = np.broadcast_to(np.array([9.0, 10.0, 11.5]) * (1.15 - 0.45 * v), (height, width, 3)).copy()
    clouds = random.random((7, 7))
    rows, columns = np.linspace(0, 5.999, height), np.linspace(0, 5.999, width)
    i, j = rows.astype(int)[:, None], columns.astype(int)[None]
    s, t = (rows % 1)[:, None], (columns % 1)[None]
    cloud = (clouds[i, j] * (1 - t) + clouds[i, j + 1] * t) * (1 - s) + (
        clouds[i + 1, j] * (1 - t) + clouds[i + 1, j + 1] * t
    ) * s
    image *= (0.8 + 0.4 * cloud)[..., None]
    column = 0
    while column < width:
        wide, top = int(random.integers(8, 20)), int(random.integers(52, 70))
        wall = np.array([2.4, 2.2, 2.0]) * (0.6 + 0.6 * random.random())
        image[top:, column : column + wide] = wall
        image[top + 3 :: 5, column + 2 : column + wide - 1 : 3] = wall * 0.45
        column += wide
    for _ in range(10):
        cx, radius = random.random() * width, 4 + 6 * random.random()
        y, x = np.mgrid[0:height, 0:width]
        image[(x - cx) ** 2 + (y - 84) ** 2 < radius**2] = np.array([0.5, 0.8, 0.3]) * (0.6 + 0.6 * random.random())
    image[86:] = [1.0, 1.5, 0.6]
    return image[::-1]  # v grows upwards on a rectangle


def build(directory: Path) -> None:
    random = np.random.default_rng(1)
    textures = directory / "textures"
    save_texture(textures / "planks.exr", planks(random))
    for k in range(4):
        save_texture(textures / f"view{k}.exr", overcast_view(random))
    palettes = [
        [(0.8, 0.75, 0.6), (0.7, 0.1, 0.06), (0.05, 0.1, 0.35), (0.75, 0.5, 0.05)],
        [(0.1, 0.25, 0.3), (0.75, 0.7, 0.6), (0.8, 0.3, 0.1), (0.05, 0.35, 0.3)],
    ]
    for k, palette in enumerate(palettes):
        save_texture(textures / f"painting{k}.exr", stripes(random, palette))

    room = Room("Office", "a room evenly lit by windows on an overcast day and by ceiling panels", (0, 1.5, 0), (-1, 1.4, -1), 8)
    room.picture("floor", "planks", (5, 4), alpha=0.25)
    room.paint("wall", (0.72, 0.69, 0.62))
    room.paint("accent", (0.20, 0.36, 0.40))
    room.paint("ceiling", (0.8, 0.8, 0.78))
    room.paint("white", (0.75, 0.75, 0.73), alpha=0.2)
    room.paint("wood", (0.42, 0.26, 0.13), alpha=0.25)
    room.paint("dark", (0.035, 0.035, 0.04), alpha=0.2)
    room.paint("screen", (0.06, 0.13, 0.3), alpha=0.15)
    room.paint("steel", (0.4, 0.41, 0.43), alpha=0.2)
    room.paint("carpet", (0.42, 0.12, 0.08))
    room.paint("carpet-edge", (0.6, 0.5, 0.3))
    room.paint("sofa", (0.62, 0.33, 0.06))
    room.paint("leaf", (0.06, 0.25, 0.05))
    room.paint("pot", (0.55, 0.22, 0.1))
    room.paint("door", (0.3, 0.17, 0.08), alpha=0.25)
    books = [
        (0.6, 0.08, 0.06),
        (0.07, 0.2, 0.5),
        (0.65, 0.5, 0.1),
        (0.08, 0.35, 0.15),
        (0.6, 0.58, 0.5),
        (0.3, 0.1, 0.3),
        (0.75, 0.3, 0.05),
    ]
    for k, colour in enumerate(books):
        room.paint(f"book{k}", colour)
    for k in range(2):
        room.picture(f"painting{k}", f"painting{k}")

    room.panel("floor", (0, 0, 0), (10, 8), "+y")
    room.panel("ceiling", (0, 3, 0), (10, 8), "-y")
    room.panel("wall", (0, 1.5, -4), (10, 3), "+z")
    room.panel("accent", (0, 1.5, 4), (10, 3), "-z")
    room.panel("wall", (-5, 1.5, 0), (8, 3), "+x")
    room.panel("wall", (5, 1.5, 0), (8, 3), "-x")
    room.box("white", (0, 0.06, -3.98), (10, 0.12, 0.04))
    room.box("white", (0, 0.06, 3.98), (10, 0.12, 0.04))
    room.box("white", (-4.98, 0.06, 0), (0.04, 0.12, 8))
    room.box("white", (4.98, 0.06, 0), (0.04, 0.12, 8))

    for k, (along, wall) in enumerate([(-3.1, "z"), (0.0, "z"), (3.1, "z"), (-0.8, "x")]):
        window(room, along, wall, glass(f"view{k}"))
    for x in (-2.8, 0.0, 2.8):
        for z in (-1.9, 1.9):
            room.box("white", (x, 2.985, z), (1.36, 0.03, 0.76))
            room.panel("white", (x, 2.965, z), (1.2, 0.6), "-y", glow((5.2, 4.9, 4.3)))

    for x, z, turn in [(-2.9, -2.7, 0.0), (2.7, -2.7, 0.0), (-3.3, 0.6, 90.0), (2.9, 1.3, -20.0)]:
        desk(room, x, z, turn)
    room.box("carpet-edge", (0, 0.006, -0.4), (3.4, 0.012, 2.6))
    room.box("carpet", (0, 0.012, -0.4), (3.1, 0.012, 2.3))

    for x in (-3.6, -1.2):  # shelves with books on the accent wall
        for y in (0.05, 0.55, 1.05, 1.55, 2.05):
            room.box("wood", (x, y, 3.8), (2.0, 0.04, 0.32))
        for side in (-1.0, 1.0):
            room.box("wood", (x + side, 1.05, 3.8), (0.04, 2.08, 0.32))
        for y in (0.07, 0.57, 1.07, 1.57):
            edge = x - 0.95
            while edge < x + 0.85:
                thick, tall = 0.03 + 0.05 * random.random(), 0.24 + 0.16 * random.random()
                if random.random() < 0.88:
                    room.box(
                        f"book{random.integers(len(books))}",
                        (edge + thick / 2, y + tall / 2, 3.78),
                        (thick * 0.94, tall, 0.22),
                    )
                edge += thick
    room.box("sofa", (2.3, 0.22, 3.4), (2.2, 0.44, 0.9))
    room.box("sofa", (2.3, 0.6, 3.78), (2.2, 0.5, 0.24))
    for side in (-1.05, 1.05):
        room.box("sofa", (2.3 + side, 0.42, 3.4), (0.22, 0.5, 0.9))
    room.box("book1", (1.7, 0.6, 3.55), (0.42, 0.4, 0.14), 12)
    room.box("book4", (2.85, 0.6, 3.55), (0.42, 0.4, 0.14), -9)
    for k, (x, wide) in enumerate([(1.5, 1.1), (3.1, 1.1)]):
        room.box("dark", (x, 1.75, 3.98), (wide + 0.08, 0.98, 0.04))
        room.panel(f"painting{k}", (x, 1.75, 3.955), (wide, 0.9), "-z")
    room.box("door", (-4.97, 1.05, 2.6), (0.06, 2.1, 0.95))
    room.box("white", (-4.985, 1.08, 2.6), (0.03, 2.18, 1.11))
    room.ball("steel", (-4.9, 1.0, 2.25), 0.04)
    room.box("white", (-4.97, 1.6, -1.6), (0.04, 1.1, 1.9))  # whiteboard
    for k in range(5):
        room.box(f"book{k}", (-4.945, 1.85 - 0.16 * k, -1.9 + 0.13 * (k % 2)), (0.01, 0.02, 0.7 + 0.12 * (k % 3)))
    for x, z, tall in [(-4.4, 3.3, 1.1), (4.45, -3.4, 1.3), (4.5, 3.4, 0.9)]:
        plant(room, random, x, z, tall)
    room.write(directory / "office.xml")


def window(room: Room, along: float, wall: str, view: str) -> None:
    """A window 2.1 × 1.5 m with frame, bars and sill on the wall z = −4 or x = 5."""

    def place(a: float, y: float, out: float) -> Vector:
        return (a, y, -4 + out) if wall == "z" else (5 - out, y, a)

    def size(a: float, y: float, out: float) -> Vector:
        return (a, y, out) if wall == "z" else (out, y, a)

    room.panel("white", place(along, 1.75, 0.01), (2.1, 1.5), "+z" if wall == "z" else "-x", view)
    for dy in (-0.77, 0.77):
        room.box("white", place(along, 1.75 + dy, 0.05), size(2.26, 0.08, 0.1))
    for da in (-1.09, -0.35, 0.35, 1.09):
        room.box("white", place(along + da, 1.75, 0.04), size(0.08 if abs(da) > 1 else 0.05, 1.5, 0.08))
    room.box("white", place(along, 0.96, 0.14), size(2.4, 0.04, 0.28))


def desk(room: Room, x: float, z: float, turn: float) -> None:
    """A desk with legs, screen, keyboard, mug, papers and chair, turned about its own centre."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))

    def put(paint: str, centre: Vector, size: Vector, extra: float = 0.0) -> None:
        room.box(paint, (x + c * centre[0] + s * centre[2], centre[1], z - s * centre[0] + c * centre[2]), size, turn + extra)

    put("wood", (0, 0.73, 0), (1.7, 0.04, 0.8))
    for dx in (-0.78, 0.78):
        put("steel", (dx, 0.355, 0), (0.05, 0.71, 0.7))
    put("white", (0.5, 0.45, 0.05), (0.42, 0.5, 0.55))
    put("dark", (0, 1.12, -0.2), (0.78, 0.46, 0.03))
    put("screen", (0, 1.12, -0.183), (0.74, 0.42, 0.006))
    put("steel", (0, 0.83, -0.22), (0.06, 0.16, 0.05))
    put("steel", (0, 0.755, -0.2), (0.26, 0.012, 0.18))
    put("dark", (0, 0.76, 0.14), (0.44, 0.02, 0.14))
    put("white", (-0.55, 0.755, 0.1), (0.21, 0.01, 0.3), 14)
    put("book4", (-0.6, 0.775, -0.2), (0.2, 0.05, 0.28), -8)
    put("book0", (-0.6, 0.815, -0.2), (0.18, 0.03, 0.25), 10)
    room.column("book6", (x + c * 0.45 + s * 0.1, 0.75, z - s * 0.45 + c * 0.1), 0.1, 0.045)
    put("dark", (0.05, 0.46, 0.75), (0.5, 0.07, 0.48))
    put("dark", (0.05, 0.85, 0.98), (0.46, 0.6, 0.06))
    put("steel", (0.05, 0.22, 0.75), (0.06, 0.42, 0.06))
    put("steel", (0.05, 0.04, 0.75), (0.5, 0.04, 0.08))
    put("steel", (0.05, 0.04, 0.75), (0.08, 0.04, 0.5))


def plant(room: Room, random: np.random.Generator, x: float, z: float, tall: float) -> None:
    room.column("pot", (x, 0, z), 0.36, 0.2)
    room.column("wood", (x, 0.3, z), tall - 0.35, 0.02)
    for _ in range(16):
        dx, dy, dz = random.normal(size=3) * [0.17, 0.2, 0.17]
        room.ball("leaf", (x + dx, tall + dy, z + dz), 0.06 + 0.09 * random.random())
