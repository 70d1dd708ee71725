"""Scenes from Mitsuba XML: paths, and every failure in one line with its place."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.reference.variants import activate
from evalsuite.scene.load import load
from evalsuite.scene.model import SceneSource
from tests.unit.scene.written import BALL, PLY, SENSOR, SKY, noise, write, write_map

activate()


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("cwd", ["elsewhere", "beside"])
def test_files_beside_the_scene_in_folders_with_odd_names(tmp_path, monkeypatch, absolute, cwd):
    folder = tmp_path / "Szene mit Ärger №1 日本"
    (folder / "sub folder").mkdir(parents=True)
    (folder / "sub folder" / "tetra ö.ply").write_text(PLY)
    write_map(folder / "sub folder" / "hülle.exr", noise())
    prefix = f"{folder}/" if absolute else ""
    source = write(
        folder,
        SENSOR
        + f'<shape type="ply"><string name="filename" value="{prefix}sub folder/tetra ö.ply"/></shape>\n'
        + f'<emitter type="envmap"><string name="filename" value="{prefix}sub folder/hülle.exr"/></emitter>\n',
    )
    monkeypatch.chdir(folder if cwd == "beside" else tmp_path)
    scene = load(replace(source, path=Path(os.path.relpath(source.path)))).scene
    assert len(scene.meshes[0].faces) == 4
    assert np.array_equal(scene.environment.radiance, noise())


def test_an_included_file_is_found_beside_the_scene(tmp_path, monkeypatch):
    write(tmp_path, BALL, "part.xml")
    monkeypatch.chdir("/")
    assert load(write(tmp_path, SENSOR + SKY + '<include filename="part.xml"/>\n')).scene.meshes[0].name == "ball"


FAILURES = {
    "unknown BSDF": ('<shape type="sphere"><bsdf type="fong"/></shape>', r"line 2, col \d+.*fong.*spelling"),
    "unknown shape": ('<shape type="blob"/>', r"line 2.*blob"),
    "unknown property": ('<shape type="sphere"><float name="radios" value="2"/></shape>', r"line 2.*radios"),
    "missing mesh": ('<shape type="ply"><string name="filename" value="no.ply"/></shape>', r"line 2.*no file 'no\.ply'"),
    "missing map": ('<emitter type="envmap"><string name="filename" value="no.exr"/></emitter>', r"line 2.*no file 'no\.exr'"),
    "missing texture": (
        '<bsdf type="diffuse"><texture name="reflectance" type="bitmap">'
        '<string name="filename" value="no.png"/></texture></bsdf>',
        r"line 2.*no file 'no\.png'",
    ),
    "missing reference": ('<shape type="cube"><ref id="nobody"/></shape>', r"line 2.*nobody"),
    "bad number": ('<shape type="sphere"><float name="radius" value="wide"/></shape>', r"line 2.*wide"),
    "undefined parameter": ('<shape type="sphere"><float name="radius" value="$r"/></shape>', r"line 2.*\$r"),
    "default without value": ('<default name="r"/>', r"line 2.*value"),
    "bad XML": ('<shape type="sphere">', r"broken XML.*line"),
    "duplicate id": ('<bsdf type="diffuse" id="a"/><bsdf type="diffuse" id="a"/>', r'line 2.*duplicate.*"a"'),
    "negative exponent": ('<bsdf type="phong"><float name="exponent" value="-1"/></bsdf>', r"line 2.*exponent -1.*≥ 0"),
    "too bright": ('<bsdf type="phong"><rgb name="specular_reflectance" value="3"/></bsdf>', r"line 2.*\[0, 1\]"),
    "two environments": (SKY.strip(), r"second environment"),
    "scaled map": (
        '<emitter type="envmap"><string name="filename" value="no.exr"/>'
        '<transform name="to_world"><scale value="2"/></transform></emitter>',
        r"line 2.*scales",
    ),
}


@pytest.mark.parametrize("name", list(FAILURES))
def test_failures_name_file_and_line(tmp_path, name, capfd):
    body, pattern = FAILURES[name]
    rest = SENSOR + BALL + (SKY if name == "two environments" or "envmap" not in body else "")
    with pytest.raises(EvalsuiteError, match=pattern) as caught:
        load(write(tmp_path, body + "\n" + rest))
    message = str(caught.value)
    assert "scene.xml" in message and "\n" not in message and "expected" in message and len(message) < 500
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("content", "pattern"),
    [
        ("", "broken XML"),
        ("junk", "broken XML"),
        ('<shape version="3.0.0" type="cube"/>', "root"),
        ("<scene></scene>", "version"),
    ],
)
def test_not_a_scene(tmp_path, content, pattern):
    (tmp_path / "scene.xml").write_text(content)
    with pytest.raises(EvalsuiteError, match=pattern):
        load(SceneSource(tmp_path / "scene.xml"))


def test_no_file_no_sensor_no_shape(tmp_path):
    for source, pattern in (
        (SceneSource(tmp_path / "none.xml"), "no such file"),
        (SceneSource(tmp_path), "folder"),
        (write(tmp_path, BALL, "a.xml"), "no sensor"),
        (write(tmp_path, SENSOR, "b.xml"), "no shapes"),
    ):
        with pytest.raises(EvalsuiteError, match=pattern):
            load(source)


def test_a_truncated_mesh(tmp_path):
    head = PLY.split("end_header")[0].replace("ascii", "binary_little_endian")
    (tmp_path / "cut.ply").write_bytes((head + "end_header\n").encode() + b"\0" * 20)
    with pytest.raises(EvalsuiteError, match=r"line 2.*cut\.ply"):
        load(write(tmp_path, '<shape type="ply"><string name="filename" value="cut.ply"/></shape>\n' + SENSOR))
