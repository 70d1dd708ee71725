"""What Mitsuba's own readers would crash on is refused before; what they are given instead is the same."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import drjit as dr
import numpy as np
import OpenEXR
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.reference import variants
from evalsuite.scene.load import load
from evalsuite.scene.mesh_files import mesh_problem
from evalsuite.scene.model import SceneSource

HEAD = (
    "ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
)


def ply(vertices: int = 3, faces: int = 1, corners=(0, 1, 2), count: int = 3, order: str = "little") -> bytes:
    mark = "<" if order == "little" else ">"
    points = struct.pack(mark + "9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    return HEAD.format(order, vertices, faces).encode() + points + struct.pack(mark + "B3i", count, *corners)


def serialized(vertices: int = 3, triangles: int = 1, corners=(0, 1, 2), normals: bool = True) -> bytes:
    body = struct.pack("<I", 0x1001 if normals else 0x1000) + b"name\0" + struct.pack("<QQ", vertices, triangles)
    body += bytes(36 * (1 + normals)) + struct.pack("<3I", *corners)
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(body) + struct.pack("<QI", 0, 1)


@pytest.mark.parametrize("data", [ply(), ply(order="big"), serialized(), serialized(normals=False)])
def test_good_meshes(tmp_path, data):
    path = tmp_path / "a"
    path.write_bytes(data)
    assert mesh_problem(path, "ply" if data.startswith(b"ply") else "serialized") is None


@pytest.mark.parametrize(
    ("plugin", "data", "words"),
    [
        ("ply", ply(vertices=10**12), "more than the file holds"),
        ("ply", ply(faces=2**32 + 1), "more than the file holds"),
        ("ply", ply(corners=(0, 1, 3)), "vertex 3 of 3"),
        ("ply", ply(corners=(0, 1, -1)), "vertex -1 of 3"),
        ("ply", ply(corners=(0, 1, 3), order="big"), "vertex 3 of 3"),
        ("ply", ply(count=4), "three corners"),
        ("ply", ply().replace(b"property float y\n", b"property float x\n"), "twice"),
        ("ply", ply().replace(b"float y", b"gloat y"), "header line"),
        ("ply", b"ply\n", "no PLY header"),
        ("ply", ply().replace(b"binary_little_endian", b"ascii"), "more than the file holds"),
        ("serialized", serialized(corners=(0, 1, 3)), "vertex 3 of 3"),
        ("serialized", serialized(vertices=10**12), "header that says"),
        ("serialized", serialized(triangles=100), "truncated"),
        ("serialized", serialized()[:-12], "no header"),
        ("serialized", b"", "truncated"),
    ],
)
def test_bad_meshes(tmp_path, plugin, data, words):
    (tmp_path / "a").write_bytes(data)
    assert words in mesh_problem(tmp_path / "a", plugin)


def test_a_bitmap_without_a_file(tmp_path):
    """Mitsuba ends the process."""
    variants.activate()
    scene = (
        '<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere"><bsdf type="diffuse">{}</bsdf></shape></scene>'
    )
    (tmp_path / "a.xml").write_text(scene.format('<texture type="bitmap" name="reflectance"/>'))
    with pytest.raises(EvalsuiteError, match=r"a\.xml \(line 1.*bitmap without a filename"):
        load(SceneSource(tmp_path / "a.xml"))


@pytest.mark.parametrize("channels", ["RGB", "RGBA", "Y"])
@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_texels_of_openexr_bitmaps_are_mitsubas(tmp_path, channels, kind):
    mi = variants.activate()
    shape = (5, 7) if channels == "Y" else (5, 7, len(channels))
    texels = np.random.default_rng(1).uniform(0.1, 0.9, shape).astype(kind)
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {channels: texels}) as file:
        file.write(str(tmp_path / "a.exr"))
    texture = '<texture type="bitmap" name="reflectance"><string name="filename" value="a.exr"/></texture>'
    (tmp_path / "a.xml").write_text(
        f'<scene version="3.0.0"><sensor type="perspective"/><shape type="rectangle"><bsdf type="diffuse">{texture}</bsdf>'
        "</shape></scene>"
    )
    ours = load(SceneSource(tmp_path / "a.xml")).scene.materials[0].textures["reflectance"].texels
    theirs = mi.load_dict({"type": "bitmap", "filename": str(Path(tmp_path / "a.exr"))})
    x, y = np.meshgrid((np.arange(7) + 0.5) / 7, (np.arange(5) + 0.5) / 5)
    si = dr.zeros(mi.SurfaceInteraction3f, 35)
    si.uv = mi.Point2f(x.ravel(), y.ravel())
    expected = np.broadcast_to(np.array(theirs.eval(si)), (3, 35)).T.reshape(5, 7, 3)
    np.testing.assert_array_equal(ours, expected)
