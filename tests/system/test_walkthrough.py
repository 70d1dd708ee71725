"""docs/adding-a-technique.md, word by word: its files are written, its commands typed, its texts expected."""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "adding-a-technique.md"
BLOCK = re.compile(r"^```(?P<language>\w+)[ \t]*(?P<name>\S*)\n(?P<text>.*?)^```$", re.M | re.S)


@pytest.fixture(scope="module")
def followed(tmp_path_factory) -> Path:
    """The folder after everything on the page was done; fails at the first thing that is not as the page says."""
    folder = tmp_path_factory.mktemp("walk-through")
    installed, programs = folder / "installed packages", folder / "bin"
    programs.mkdir()
    # What is installed goes to a folder that only these commands see.
    (programs / "pip").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pip "$@" --no-deps --quiet --target "{installed}"\n')
    (programs / "pip").chmod(0o755)
    path = os.pathsep.join([str(programs), str(Path(sys.executable).parent), os.environ["PATH"]])
    cache = {"EVALSUITE_CACHE": str(folder / "cache")}
    environment = os.environ | cache | {"PATH": path, "PYTHONPATH": str(installed), "COLUMNS": "200"}
    said, typed = "", 0
    for block in BLOCK.finditer(PAGE.read_text(encoding="utf-8")):
        language, name, text = block["language"], block["name"], block["text"]
        if language == "sh":
            done = subprocess.run(["bash", "-ec", text], cwd=folder, env=environment, capture_output=True, text=True, timeout=900)
            said = done.stdout + done.stderr
            assert (done.returncode == 2) == (name == "fails") and done.returncode in (0, 2), f"{text}\n{said}"
            typed += 1
        elif language == "text":
            heard = " ".join(said.split())
            missing = [line for line in text.splitlines() if " ".join(line.split()) not in heard]
            assert not missing, f"{missing} not in\n{said}"
        else:
            assert name, f"a block of {language} without a file's name"
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
    assert typed == 4
    return folder


def test_the_page_is_true(followed: Path):
    assert (followed / "one.exr").stat().st_size > 1000
    assert (followed / "my-report" / "index.html").exists()
    assert not (followed / "broken.exr").exists()


def test_the_package_s_shader_is_its_twin(followed: Path, monkeypatch):
    """The walk-through's own technique is held to the same bound as the built-in ones."""
    from evalsuite.gpu import draw

    sys.path.insert(0, str(Path(__file__).parents[1] / "unit"))
    from gpu.helpers import material, noise, scene, visible

    monkeypatch.syspath_prepend(str(followed / "small-map"))
    technique = importlib.import_module("small_map").SmallMap()
    s = scene(noise(), material("diffuse", reflectance=(0.5, 0.6, 0.7)), size=(32, 32))
    picture = draw.draw(s, technique, {}, supersample=1).image
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0
    twin = technique.twin(s.environment, normal, to_view, s.materials[0].parameters, technique.defaults())
    assert np.abs(picture[mask] - twin)[front].max() < technique.twin_bound * twin.mean()


def test_other_mistakes_of_a_shader_s_author(evalsuite, tmp_path: Path):
    shader = tmp_path / "glass bead.glsl"
    good = "uniform float gain = 1.0;\nvec3 shade(Surface s) { return gain * env_radiance(s.normal); }\n"
    for text, about, message in (
        ("vec3 color(Surface s) { return vec3(1.0); }", "", "no function `shade`"),
        (good.replace("1.0;", "pi;"), "", "glass bead.glsl:1: got `uniform float gain = pi;`"),
        ("uniform float exponent;\n" + good, "", "glass bead.glsl:1: got `uniform float exponent;`"),
        (good, 'bsfd = "phong"', "unknown key 'bsfd'"),
        (good, 'bsdf = "glass"', "got 'glass'"),
        (good, "bsdf = ", "glass bead.toml"),
        (good, 'target = "truth"', "truth"),
    ):
        shader.write_text(text)
        shader.with_suffix(".toml").write_text(about)
        done = evalsuite("run", "--scene", "sphere", "-t", str(shader), "--size", "16x16", "--out", str(tmp_path / "out"))
        assert done.code == 2 and message in done.err and "Traceback" not in done.err, done.err
    shutil.copy(shader, tmp_path / "mirror-cube.glsl")
    done = evalsuite("render", "sphere", "-t", str(tmp_path / "mirror-cube.glsl"), "-o", str(tmp_path / "a.exr"))
    assert done.code == 2 and "a name of its own" in done.err


def test_a_shader_against_every_target_bsdf(evalsuite, tmp_path: Path):
    """A mirror-like shader is drawn and scored against each plugin that `bsdf` may name."""
    (tmp_path / "plain.glsl").write_text("vec3 shade(Surface s) { return env_radiance(reflect(-s.to_view, s.normal)); }\n")
    names = ("diffuse", "phong", "blinnphong", "roughconductor", "conductor")
    words = ("-t", "plain.glsl", "--env", "sh2", "--size", "32x32", "--target", "unoccluded", "-p", f"bsdf={','.join(names)}")
    done = evalsuite("run", "--scene", "sphere", *words, "--out", "o", "--json", cwd=tmp_path)
    assert done.code == 0, done.err
    errors = {c["parameters"]["bsdf"]: c["metrics"]["rel_rmse"]["value"] for c in json.loads(done.out)["cells"]}
    assert set(errors) == set(names)
    assert errors["conductor"] < 0.01 < errors["diffuse"]
