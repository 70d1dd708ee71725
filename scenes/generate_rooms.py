"""Writes the two modelled rooms of `scenes/rooms/` anew: `python scenes/generate_rooms.py [-o DIRECTORY]`.

`office`: evenly lit by four windows on an overcast day and by ceiling panels. `cathedral`: dark, with candles, a few small
lamps and stained glass. Metres, y up; the camera stands where the environment maps of the same names are taken. NumPy and
OpenEXR only, deterministic. All surfaces are diffuse or nearly so: sharp reflections of small lamps would not converge.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Colour = tuple[float, float, float]


class Room:
    """Mitsuba XML in the making: every method appends one element. Boxes and panels are centred at `centre`."""

    def __init__(self, name: str, description: str, eye: Vector, target: Vector, depth: int) -> None:
        self.lines = [
            '<?xml version="1.0" encoding="utf-8"?>',
            f"<!-- {name}: {description}. Written by generate_rooms.py. -->",
            '<scene version="3.0.0">',
            f'<integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>',
            '<sensor type="perspective">',
            f'  <transform name="to_world"><lookat origin="{triple(eye)}" target="{triple(target)}" up="0, 1, 0"/></transform>',
            '  <float name="fov" value="90"/>',
            '  <film type="hdrfilm"><integer name="width" value="512"/><integer name="height" value="384"/>',
            '    <rfilter type="box"/></film>',
            '  <sampler type="independent"><integer name="sample_count" value="256"/></sampler>',
            "</sensor>",
        ]

    def paint(self, name: str, colour: Colour, alpha: float | None = None) -> None:
        """A BSDF: diffuse, or with a rough plastic coat of GGX width alpha; two-sided."""
        kind, slot = ("diffuse", "reflectance") if alpha is None else ("roughplastic", "diffuse_reflectance")
        coat = "" if alpha is None else f'<float name="alpha" value="{alpha}"/>'
        self.lines.append(
            f'<bsdf type="twosided" id="{name}"><bsdf type="{kind}"><rgb name="{slot}" value="{triple(colour)}"/>{coat}</bsdf></bsdf>'
        )

    def picture(self, name: str, file: str, repeat: tuple[float, float] = (1, 1), alpha: float | None = None) -> None:
        """A BSDF as `paint`, with its colour from textures/<file>.exr."""
        kind, slot = ("diffuse", "reflectance") if alpha is None else ("roughplastic", "diffuse_reflectance")
        coat = "" if alpha is None else f'<float name="alpha" value="{alpha}"/>'
        self.lines.append(
            f'<bsdf type="twosided" id="{name}"><bsdf type="{kind}"><texture type="bitmap" name="{slot}">'
            f'<string name="filename" value="textures/{file}.exr"/><boolean name="raw" value="true"/>'
            f'<transform name="to_uv"><scale x="{repeat[0]:g}" y="{repeat[1]:g}"/></transform></texture>{coat}</bsdf></bsdf>'
        )

    def shape(self, kind: str, paint: str, transforms: Iterable[str], extra: str = "") -> None:
        self.lines.append(
            f'<shape type="{kind}">{extra}<transform name="to_world">{"".join(transforms)}</transform><ref id="{paint}"/></shape>'
        )

    def box(self, paint: str, centre: Vector, size: Vector, turn: float = 0.0) -> None:
        x, y, z = (s / 2 for s in size)
        spin = [f'<rotate y="1" angle="{turn:g}"/>'] if turn else []
        self.shape("cube", paint, [f'<scale x="{x:g}" y="{y:g}" z="{z:g}"/>', *spin, translate(centre)])

    def ball(self, paint: str, centre: Vector, radius: float) -> None:
        self.shape("sphere", paint, [f'<scale value="{radius:g}"/>', translate(centre)])

    def column(self, paint: str, foot: Vector, height: float, radius: float) -> None:
        """Upright cylinder with a lid."""
        x, y, z = foot
        extra = f'<point name="p0" value="0, 0, 0"/><point name="p1" value="0, {height:g}, 0"/><float name="radius" value="{radius:g}"/>'
        self.shape("cylinder", paint, [translate(foot)], extra)
        lid = [f'<scale value="{radius:g}"/>', '<rotate x="1" angle="-90"/>', translate((x, y + height, z))]
        self.shape("disk", paint, lid)

    def panel(
        self,
        paint: str,
        centre: Vector,
        size: tuple[float, float],
        facing: str,
        emission: str | None = None,
        kind: str = "rectangle",
    ) -> None:
        """Rectangle (width, height) facing one of +x −x +y −y +z −z. emission: an emitter's radiance element, or None."""
        turns = {
            "+z": "", "-z": '<rotate y="1" angle="180"/>', "+x": '<rotate y="1" angle="90"/>',
            "-x": '<rotate y="1" angle="-90"/>', "+y": '<rotate x="1" angle="-90"/>', "-y": '<rotate x="1" angle="90"/>',
        }  # fmt: skip
        light = f'<emitter type="area">{emission}</emitter>' if emission else ""
        scale = f'<scale x="{size[0] / 2:g}" y="{size[1] / 2:g}" z="1"/>'
        self.shape(kind, paint, [scale, turns[facing], translate(centre)], light)

    def mesh(self, paint: str, file: str, emission: str | None = None) -> None:
        light = f'<emitter type="area">{emission}</emitter>' if emission else ""
        extra = f'<string name="filename" value="meshes/{file}.ply"/><boolean name="face_normals" value="true"/>'
        self.shape("ply", paint, [translate((0, 0, 0))], extra + light)

    def write(self, file: Path) -> None:
        file.write_text("\n".join([*self.lines, "</scene>", ""]), encoding="utf-8")


def triple(values: Iterable[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def translate(offset: Vector) -> str:
    return '<translate x="{:g}" y="{:g}" z="{:g}"/>'.format(*offset)


def glow(colour: Colour, weight: float = 1.0) -> str:
    """Constant radiance. weight: how often the integrator picks this emitter, beside the others."""
    return f'<rgb name="radiance" value="{triple(colour)}"/><float name="sampling_weight" value="{weight:g}"/>'


def glass(file: str, weight: float = 1.0) -> str:
    """Radiance from textures/<file>.exr, which holds it in W m⁻² sr⁻¹. weight: as in `glow`."""
    return (
        f'<texture type="bitmap" name="radiance"><string name="filename" value="textures/{file}.exr"/>'
        f'<boolean name="raw" value="true"/></texture><float name="sampling_weight" value="{weight:g}"/>'
    )


def save_texture(file: Path, pixels: NDArray[np.float64]) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels, np.float16)}) as exr:
        exr.write(str(file))


def save_mesh(file: Path, strips: list[NDArray[np.float64]]) -> None:
    """Each strip an (R, C, 3) grid of vertices; flat-shaded, two-sided."""
    positions, faces, start = [], [], 0
    for strip in strips:
        rows, columns = strip.shape[:2]
        i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
        a = start + i * columns + j
        quads = [np.stack([a, a + 1, a + columns + 1], -1), np.stack([a, a + columns + 1, a + columns], -1)]
        faces += [quad.reshape(-1, 3) for quad in quads]
        positions.append(strip.reshape(-1, 3))
        start += rows * columns
    vertices, index = np.concatenate(positions).astype("<f4"), np.concatenate(faces)
    triangles = np.empty(len(index), [("count", "u1"), ("index", "<i4", 3)])
    triangles["count"], triangles["index"] = 3, index
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"element face {len(index)}", "property list uchar int vertex_indices", "end_header\n"]
    file.write_bytes("\n".join(header).encode() + vertices.tobytes() + triangles.tobytes())


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
    cloud = (clouds[i, j] * (1 - t) + clouds[i, j + 1] * t) * (1 - s) + (clouds[i + 1, j] * (1 - t) + clouds[i + 1, j + 1] * t) * s
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


def stained_glass(random: np.random.Generator, radiance: float, round_window: bool) -> NDArray[np.float64]:
    """Radiance of leaded panes: a rose (rings and sectors) or a lancet (lozenges)."""
    glass_colours = np.array(
        [[0.95, 0.10, 0.06], [0.06, 0.14, 0.95], [0.95, 0.62, 0.08], [0.08, 0.62, 0.18], [0.45, 0.08, 0.75], [0.8, 0.8, 0.7]]
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


def office(directory: Path) -> None:
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
    books = [(0.6, 0.08, 0.06), (0.07, 0.2, 0.5), (0.65, 0.5, 0.1), (0.08, 0.35, 0.15), (0.6, 0.58, 0.5), (0.3, 0.1, 0.3), (0.75, 0.3, 0.05)]
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
                    room.box(f"book{random.integers(len(books))}", (edge + thick / 2, y + tall / 2, 3.78), (thick * 0.94, tall, 0.22))
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


def pointed_arch(half_span: float, spring: float, rise: float, steps: int) -> NDArray[np.float64]:
    """(steps, 2) points (across, height) of a two-centred arch from −half_span to +half_span."""
    across = -half_span * np.cos(np.linspace(0, np.pi, steps))
    radius = (half_span**2 + rise**2) / (2 * half_span)  # both arcs pass through their spring point and the apex
    return np.stack([across, spring + np.sqrt(np.maximum(radius**2 - (np.abs(across) + radius - half_span) ** 2, 0))], -1)


def cathedral(directory: Path) -> None:
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
            [np.broadcast_to(arch[:, :1] + centre, shape), np.broadcast_to(arch[:, 1:], shape), np.broadcast_to(depths, shape)], -1
        )

    vaults = [extrude(pointed_arch(4.0, 10.5, 4.6, 33), 0.0, z)]
    vaults += [extrude(pointed_arch(2.0, 6.0, 2.6, 25), side * 6.0, z) for side in (-1, 1)]
    save_mesh(meshes / "vaults.ply", vaults)

    ribs = []
    for depth in pillars:
        for half, spring, rise, centre, deep in [(4.0, 10.5, 4.6, 0, 0.32), (2.0, 6.0, 2.6, -6, 0.2), (2.0, 6.0, 2.6, 6, 0.2)]:
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
                np.stack([np.stack([np.full(len(e), c), e[:, 1], e[:, 0] + start + bay / 2], -1) for e, c in zip(edges, x, strict=True)])
            )
    save_mesh(meshes / "arcade.ply", walls)

    room = Room("Cathedral", "a dark nave with candles, a few small bright lamps and stained glass", (0.3, 1.7, 0), (-1, 3, -6), 7)
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
    room: Room, flames: list[NDArray[np.float64]], random: np.random.Generator, foot: Vector, radius: float, tall: float = 0.1
) -> None:
    x, y, z = foot
    height = tall * (0.7 + 0.6 * random.random())
    room.column("wax", foot, height, radius)
    flames.append(octasphere((x, y + height + 0.045, z), 0.011 + 0.3 * (radius - 0.02), 2.2))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "rooms", help="directory")
    directory = parser.parse_args().output
    for folder in ("textures", "meshes"):
        (directory / folder).mkdir(parents=True, exist_ok=True)
    office(directory)
    cathedral(directory)


if __name__ == "__main__":
    main()
