"""Scenes and maps that the tests of loading write."""

from pathlib import Path

import numpy as np
import OpenEXR

from evalsuite.scene.model import SceneSource

SENSOR = """<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film></sensor>
"""
BALL = '<shape type="sphere" id="ball"><bsdf type="diffuse" id="subject"/></shape>\n'
SKY = '<emitter type="constant"><float name="radiance" value="2"/></emitter>\n'


def write(folder, body, name="scene.xml"):
    path = Path(folder) / name
    path.write_text(f'<scene version="3.0.0">\n{body}</scene>\n', encoding="utf-8")
    return SceneSource(path)


def write_map(path, texels):
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.ascontiguousarray(texels, np.float32)}) as file:
        file.write(str(path))
    return path


def noise(height=8, width=16):
    return np.random.default_rng(0).random((height, width, 3), dtype=np.float32)


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n"
