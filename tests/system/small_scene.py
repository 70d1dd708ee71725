"""A small scene of one object, as XML, and a room for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.image import exr
from evalsuite.math.sphere import latlong_directions

SCENE = """<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="1.5, 1, 3.5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <float name="fov" value="32"/>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="40"/></film>
    </sensor>
    {emitter}
    <bsdf type="{plugin}" id="{material}">{parameters}</bsdf>
    <shape type="{shape}">{shape_parameters}<ref id="{material}"/></shape>
    {extra}
</scene>
"""


def scene_xml(
    emitter: str = '<emitter type="constant"><rgb name="radiance" value="1"/></emitter>',
    plugin: str = "diffuse",
    material: str = "clay",
    parameters: str = '<rgb name="reflectance" value="0.5"/>',
    shape: str = "sphere",
    shape_parameters: str = "",
    extra: str = "",
) -> str:
    """A small scene of one object."""
    return SCENE.format(
        emitter=emitter,
        plugin=plugin,
        material=material,
        parameters=parameters,
        shape=shape,
        shape_parameters=shape_parameters,
        extra=extra,
    )


def write_ball_under_a_lamp(folder: Path) -> None:
    """ball.xml, a diffuse sphere, and map.exr: noise and a small lamp, under which diffuse techniques differ by little."""
    texels = np.random.default_rng(1).uniform(0.2, 2.0, (16, 32, 3)).astype(np.float32)
    texels[4:6, 5:7] = 30.0
    exr.write(folder / "map.exr", texels)
    lamp = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'
    (folder / "ball.xml").write_text(scene_xml(lamp), encoding="utf-8")


def shining(directions: np.ndarray) -> np.ndarray:
    """A radiance with all symmetries of the cube, brightest in the middles of its faces, (..., 3)."""
    fourth = (np.asarray(directions, np.float64) ** 4).sum(-1, keepdims=True)  # 1/3 in the corners, 1 in the middles
    return (0.02 + fourth ** np.array([4.0, 6.0, 8.0])).astype(np.float32)


def write_cube_room(folder: Path, name: str, half: float) -> None:
    """A room of six black walls at ±half that shine as `shining` does from the origin, and map.exr: the same at infinity."""
    exr.write(folder / "map.exr", shining(latlong_directions(257, 512)))
    c = (np.arange(256) + 0.5) / 128 - 1
    x, y = np.meshgrid(c, c)
    wall = np.stack([x, y, np.ones_like(x)], -1)
    exr.write(folder / "wall.exr", shining(wall / np.linalg.norm(wall, axis=-1, keepdims=True)))
    walls = []
    for face, turn in enumerate(("y -90", "y 90", "x 90", "x -90", "y 180", "y 0")):
        (axis, angle), place = turn.split(), half * (1 - 2 * (face % 2))
        walls.append(
            f'<shape type="rectangle"><transform name="to_world"><scale value="{half}"/><rotate {axis}="1" angle="{angle}"/>'
            f'<translate {"xyz"[face // 2]}="{place}"/></transform>'
            f'<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
            f'<emitter type="area"><texture type="bitmap" name="radiance"><string name="filename" value="wall.exr"/>'
            f'<string name="wrap_mode" value="clamp"/><boolean name="raw" value="true"/></texture></emitter></shape>'
        )
    (folder / name).write_text(f'<scene version="3.0.0">{"".join(walls)}</scene>')
