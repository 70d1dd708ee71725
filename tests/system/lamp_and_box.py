"""A box on the floor and one lamp in a dim environment: shadows with an umbra and a penumbra."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.image import exr
from evalsuite.math.sphere import latlong_directions

BOX = """<scene version="3.0.0">
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="3, 4, 5" target="0, 0.3, 0" up="0, 1, 0"/></transform>
        <float name="fov" value="36"/>
        <film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/></film>
    </sensor>
    <emitter type="envmap"><string name="filename" value="lamp.exr"/></emitter>
    <bsdf type="diffuse" id="subject"><rgb name="reflectance" value="0.5"/></bsdf>
    <shape type="rectangle">
        <transform name="to_world"><scale value="2.6"/><rotate x="1" angle="-90"/></transform><ref id="subject"/>
    </shape>
    <shape type="cube">
        <transform name="to_world"><scale x="0.4" y="0.6" z="0.4"/><rotate y="1" angle="20"/><translate y="0.6"/></transform>
        <ref id="subject"/>
    </shape>
</scene>
"""


def write(place: Path, size: int, lamp: tuple[float, float, float], rows: int) -> Path:
    """The scene of `size`² pixels in a folder. lamp: towards its centre, of 8° about it. rows: of the environment map."""
    radiance = np.full((rows, 2 * rows, 3), 0.02, np.float32)
    radiance[latlong_directions(rows, 2 * rows) @ (lamp / np.linalg.norm(lamp)) > np.cos(np.radians(8.0))] = (20.0, 18.0, 15.0)
    exr.write(place / "lamp.exr", radiance)
    (place / "box.xml").write_text(BOX.format(size=size))
    return place / "box.xml"
