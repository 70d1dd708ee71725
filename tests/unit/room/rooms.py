"""Small scenes within small rooms, as files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from evalsuite.scene.model import SceneSource

#: `coloured-cube`'s faces (scenes/generate_environments.py): +x −x +y −y +z −z.
COLOURS = ((1.0, 0.06, 0.06), (0.06, 0.9, 0.9), (1.0, 0.9, 0.06), (0.06, 0.1, 1.0), (0.06, 0.9, 0.1), (0.95, 0.06, 0.9))
_TURNS = ("y -90", "y 90", "x 90", "x -90", "y 180", "y 0")  # that face a rectangle inwards
_PLACES = ("x", "x", "y", "y", "z", "z")

SCENE = """<scene version="3.0.0">
    {room}<default name="object_x" value="0"/>
    <sensor type="perspective"><float name="fov" value="30"/>
        <transform name="to_world"><lookat origin="0.2, 0.3, 0.9" target="0, 0, 0" up="0, 1, 0"/>
            <translate x="$object_x"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film>
    </sensor>
    {emitter}
    <bsdf type="diffuse" id="subject"><rgb name="reflectance" value="0.5, 0.6, 0.7"/></bsdf>
    <shape type="sphere"><float name="radius" value="0.2"/>
        <transform name="to_world"><translate x="$object_x"/></transform><ref id="subject"/></shape>
</scene>
"""
GREY = '<emitter type="constant"><rgb name="radiance" value="1"/></emitter>'


def scene(folder: Path, room: str | None = "room.xml", emitter: str = GREY, **defines: str) -> SceneSource:
    """A diffuse sphere of radius 0.2 at (object_x, 0, 0)."""
    named = f'<default name="room" value="{room}"/>' if room else ""
    path = folder / "scene.xml"
    path.write_text(SCENE.format(room=named, emitter=emitter), encoding="utf-8")
    return SceneSource(path, defines=defines)


def box(half: float, colours=COLOURS, reflectances: Sequence[float] = (0.0,) * 6, extra: str = "") -> str:
    """Six walls at ±half that shine in `colours` and reflect `reflectances`, both in the order of the colours."""
    walls = []
    for face, (colour, reflectance) in enumerate(zip(colours, reflectances, strict=True)):
        (turned, angle), offset = _TURNS[face].split(), half * (1 - 2 * (face % 2))
        transform = f'<scale value="{half}"/><rotate {turned}="1" angle="{angle}"/><translate {_PLACES[face]}="{offset}"/>'
        light = f'<emitter type="area"><rgb name="radiance" value="{",".join(map(str, colour))}"/></emitter>'
        walls.append(
            f'<shape type="rectangle"><transform name="to_world">{transform}</transform><bsdf type="diffuse">'
            f'<rgb name="reflectance" value="{reflectance}"/></bsdf>{light if max(colour) > 0 else ""}</shape>'
        )
    return f'<scene version="3.0.0">{"".join(walls)}{extra}</scene>'


def write_room(folder: Path, xml: str, name: str = "room.xml") -> None:
    (folder / name).write_text(xml, encoding="utf-8")
