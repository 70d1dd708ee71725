"""Mitsuba XML, textures and meshes in the making, for the modelled rooms."""

from __future__ import annotations

from collections.abc import Callable, Iterable
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
        self._bsdf(name, lambda slot: f'<rgb name="{slot}" value="{triple(colour)}"/>', alpha)

    def picture(self, name: str, file: str, repeat: tuple[float, float] = (1, 1), alpha: float | None = None) -> None:
        """A BSDF as `paint`, with its colour from textures/<file>.exr."""
        to_uv = f'<transform name="to_uv"><scale x="{repeat[0]:g}" y="{repeat[1]:g}"/></transform>'
        self._bsdf(name, lambda slot: bitmap(slot, file, to_uv), alpha)

    def _bsdf(self, name: str, colour: Callable[[str], str], alpha: float | None) -> None:
        kind, slot = ("diffuse", "reflectance") if alpha is None else ("roughplastic", "diffuse_reflectance")
        coat = "" if alpha is None else f'<float name="alpha" value="{alpha}"/>'
        self.lines.append(f'<bsdf type="twosided" id="{name}"><bsdf type="{kind}">{colour(slot)}{coat}</bsdf></bsdf>')

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
        ends = f'<point name="p0" value="0, 0, 0"/><point name="p1" value="0, {height:g}, 0"/>'
        extra = f'{ends}<float name="radius" value="{radius:g}"/>'
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
    return f'{bitmap("radiance", file)}<float name="sampling_weight" value="{weight:g}"/>'


def bitmap(slot: str, file: str, to_uv: str = "") -> str:
    """A texture element whose linear values stand in textures/<file>.exr."""
    return (
        f'<texture type="bitmap" name="{slot}"><string name="filename" value="textures/{file}.exr"/>'
        f'<boolean name="raw" value="true"/>{to_uv}</texture>'
    )


def panes(radiance: float, columns: int = 3, rows: int = 6) -> NDArray[np.float64]:
    """Radiance of a window, brightest at its top, behind dark bars: (192, 96, 3)."""
    v, u = (np.mgrid[0:192, 0:96] + 0.5) / np.array([192, 96])[:, None, None]
    bars = (np.abs(u * columns % 1 - 0.5) > 0.46) | (np.abs(v * rows % 1 - 0.5) > 0.47)
    sky = np.array([0.92, 0.98, 1.1]) * (0.6 + 0.4 * v)[..., None]  # v grows upwards on a rectangle
    return radiance * np.where(bars[..., None], 0.01, sky)


def barrel(radius: float, spring: float, near: float, far: float, outer: float | None = None) -> NDArray[np.float64]:
    """Strip of a barrel vault over x = ±radius from z = near to far; with `outer` an arch of rectangular section below one of
    that radius."""
    angle = np.linspace(0, np.pi, 33)[:, None]
    section = [(radius, near), (radius, far)] if outer is None else [(outer, near), (radius, near), (radius, far), (outer, far)]
    radii, depths = np.array(section).T
    return np.stack(np.broadcast_arrays(-radii * np.cos(angle), spring + radii * np.sin(angle), depths), -1)


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
