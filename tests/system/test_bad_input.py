"""Bad input: exit 2 and one clear line that names the file; odd but meaningful input: fine."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from small_scene import scene_xml

from evalsuite.image import exr

NOISE = np.random.default_rng(2).uniform(0.1, 1.0, (16, 32, 3)).astype(np.float32)


def envmap(name: str) -> str:
    return f'<emitter type="envmap"><string name="filename" value="{name}"/></emitter>'


def _map(change) -> np.ndarray:
    array = NOISE.copy()
    change(array)
    return array


def _files(folder: Path) -> None:
    exr.write(folder / "good.exr", NOISE)
    data = (folder / "good.exr").read_bytes()
    (folder / "truncated.exr").write_bytes(data[: len(data) // 2])
    (folder / "junk.exr").write_bytes(b"\x00\xff" * 500)
    (folder / "empty.exr").write_bytes(b"")
    (folder / "junk.hdr").write_bytes(b"not radiance at all" * 10)
    header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n"
    (folder / "truncated.hdr").write_bytes(header + bytes(16 * 32 * 2))
    exr.write(folder / "nan.exr", _map(lambda a: a.__setitem__((3, 4, 1), np.nan)))
    exr.write(folder / "inf.exr", _map(lambda a: a.__setitem__((5, 6, 0), np.inf)))
    (folder / "notes.txt").write_text("x")
    (folder / "dir.exr").mkdir()


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bad input")
    _files(folder)
    return folder


def check_one_line(outcome, *names: str) -> None:
    assert outcome.code == 2, (outcome.code, outcome.err)
    lines = [line for line in outcome.err.splitlines() if line.strip()]
    assert len(lines) == 1, outcome.err
    assert lines[0].startswith("error: ") and "Traceback" not in outcome.err
    for name in names:
        assert name in lines[0], lines[0]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("truncated.exr", ()),
        ("junk.exr", ()),
        ("empty.exr", ()),
        ("junk.hdr", ()),
        ("truncated.hdr", ()),
        ("nan.exr", ("--repair-env",)),
        ("inf.exr", ()),
        ("missing.exr", ()),
        ("notes.txt", ()),
        ("dir.exr", ()),
    ],
)
def test_bad_map(evalsuite, folder, name, words):
    (folder / "plain.xml").write_text(scene_xml())
    outcome = evalsuite("run", "--scene", "plain.xml", "-t", "diffuse-sh9", "--env", name, "--out", f"o-{name}", cwd=folder)
    check_one_line(outcome, name, *words)


@pytest.mark.parametrize(
    ("label", "xml", "names"),
    [
        ("missing-mesh", scene_xml(shape="ply", shape_parameters='<string name="filename" value="gone.ply"/>'), ("gone.ply",)),
        ("missing-map", scene_xml(envmap("gone.exr")), ("gone.exr",)),
        ("nan-map", scene_xml(envmap("nan.exr")), ("nan.exr", "--repair-env")),
        ("unknown-plugin", scene_xml(plugin="velvet", parameters=""), ("velvet", "line 9")),
        ("unknown-property", scene_xml(parameters='<float name="shine" value="3"/>'), ("shine",)),
        ("dielectric", scene_xml(plugin="dielectric", parameters=""), ("dielectric", "clay", "line 9")),
        ("broken-xml", scene_xml()[:-20], ("broken-xml.xml", "line")),
        ("bad-reference", scene_xml(extra='<shape type="sphere"><ref id="nobody"/></shape>'), ("nobody",)),
        ("point-light", scene_xml(extra='<emitter type="point"/>'), ("point", "line 11")),
        ("not-xml", "hello", ("not-xml.xml",)),
        ("no-environment", scene_xml(emitter=""), ("no-environment.xml",)),
    ],
)
def test_bad_scene(evalsuite, folder, label, xml, names):
    (folder / f"{label}.xml").write_text(xml)
    outcome = evalsuite("run", "--scene", f"{label}.xml", "-t", "diffuse-sh9", "--out", f"o-{label}", cwd=folder)
    check_one_line(outcome, *names)


def test_folder_without_write_permission(evalsuite, folder):
    blocked = Path("/proc/evalsuite") if os.geteuid() == 0 else folder / "closed"
    if os.geteuid() != 0:
        blocked.mkdir(exist_ok=True)
        blocked.chmod(0o500)
    (folder / "plain.xml").write_text(scene_xml())
    check_one_line(evalsuite("run", "--scene", "plain.xml", "-t", "diffuse-sh9", "--out", blocked, cwd=folder), str(blocked))
    (folder / "a-file").write_text("")
    check_one_line(evalsuite("run", "--scene", "plain.xml", "-t", "diffuse-sh9", "--out", "a-file", cwd=folder), "a-file")
    check_one_line(
        evalsuite(
            "run", "--scene", "plain.xml", "-t", "diffuse-sh9", "--out", "ok", cwd=folder, EVALSUITE_CACHE=str(folder / "a-file")
        ),
        "a-file",
    )
    check_one_line(evalsuite("render", "plain.xml", "-t", "diffuse-sh9", "-o", "nowhere/a.exr", cwd=folder), "nowhere")


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (("run", "accurcy"), ("accurcy", "accuracy")),
        (("run", "-t", "glossy-mcgire"), ("glossy-mcgire", "glossy-mcguire")),
        (("run", "--scene", "tours"), ("tours", "torus")),
        (("run", "--env", "ofice"), ("ofice", "office")),
        (("run", "--target", "paths"), ("paths",)),
        (("run", "-p", "exponent"), ("exponent",)),
        (("run", "-p", "exponnent=3"), ("exponnent", "exponent")),
        (("run", "-t", "glossy-mcguire", "-p", "exponent=shiny"), ("exponent", "shiny")),
        (("run", "--size", "big"), ("--size",)),
        (("run", "--target-error", "0"), ("--target-error",)),
        (("run", "--quality", "best"), ("best",)),
        (("run", "--frobnicate"), ("--frobnicate",)),
        (("compare", "nan.exr", "good.exr"), ("nan.exr",)),
        (("compare", "truncated.exr", "good.exr"), ("truncated.exr",)),
        (("env", "info", "junk.exr"), ("junk.exr",)),
    ],
)
def test_bad_words(evalsuite, folder, words, names):
    check_one_line(evalsuite(*words, cwd=folder), *names)


@pytest.mark.parametrize(
    ("name", "array", "warning"),
    [
        ("one-texel", np.full((1, 1, 3), 0.7, np.float32), None),
        ("two-rows", NOISE[:2, :1], None),
        ("zero", np.zeros((8, 16, 3), np.float32), None),
        ("negative", _map(lambda a: a.__setitem__((2, slice(0, 5), 0), -0.25)), "-0.25"),
        ("repaired", _map(lambda a: a.__setitem__((3, 4, 1), np.nan)), "NaN"),
    ],
)
def test_odd_maps_are_fine(evalsuite, folder, name, array, warning):
    exr.write(folder / f"odd-{name}.exr", array)
    (folder / "plain.xml").write_text(scene_xml())
    outcome = evalsuite(
        "run",
        "--scene",
        "plain.xml",
        "-t",
        "diffuse-sh9",
        "--env",
        f"odd-{name}.exr",
        "--out",
        f"o-{name}",
        "--json",
        "--target",
        "unoccluded",
        *(("--repair-env",) if name == "repaired" else ()),
        cwd=folder,
    )
    assert outcome.code == 0, outcome.err
    (cell,) = json.loads(outcome.out)["cells"]
    assert cell["status"] == "scored", cell["message"]
    assert cell["metrics"]["rel_bias"]["value"] == pytest.approx(0, abs=0.05)
    if name == "one-texel":
        assert cell["mean_image"] == pytest.approx(0.35, rel=2e-3) and cell["mean_reference"] == pytest.approx(0.35, rel=0.01)
    if name == "zero":
        assert cell["mean_image"] == cell["mean_reference"] == 0
    if warning:
        assert warning in outcome.err and outcome.err.startswith("warning: ")
        assert any(warning in w for w in cell["warnings"])
