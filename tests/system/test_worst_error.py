"""`--worst-error`: a run and a picture whose pixels differ in their samples, and without it nothing of the kind."""

from __future__ import annotations

import json

import numpy as np
import pytest
from schema import validate
from small_scene import scene_xml

from evalsuite.image import exr

EMITTER = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("adaptive")
    texels = np.full((16, 32, 3), 0.3, np.float32)
    texels[4, 5] = 200.0
    exr.write(folder / "map.exr", texels)
    (folder / "ball.xml").write_text(scene_xml(EMITTER), encoding="utf-8")
    return folder


def run(evalsuite, scene, *words):
    words = ("--target", "direct", "-t", "diffuse-sh9", "--target-error", "0.1", "--size", "32x32", "--no-ledger", *words)
    done = evalsuite("run", "--scene", scene / "ball.xml", "--out", scene / "out", *words, "--json")
    assert done.code == 0, done.err
    results = json.loads(done.out)
    validate(results)
    return results


def test_a_run_says_what_it_asked_for_and_reached(evalsuite, scene):
    results = run(evalsuite, scene, "--worst-error", "0.1")
    (cell,) = results["cells"]
    assert results["run"]["worst_error"] == cell["worst_error"] == 0.1
    assert 0 < cell["reached_worst_error"] and cell["reached_error"] <= 0.1
    assert (cell["reached_worst_error"] > 0.1) == any("worst pixel" in warning for warning in cell["warnings"])
    assert "--worst-error 0.1" in cell["reproduce"]
    samples = exr.read(scene / "out" / cell["images"]["spp"])[..., 0]
    assert samples.max() == cell["cost"]["reference_spp_max"] > samples.min() >= 64
    assert round(float(samples.mean())) == pytest.approx(cell["cost"]["reference_spp"], abs=1)
    assert len(list(scene.glob("out/cells/*/spp.webp"))) == 1
    plain = run(evalsuite, scene)
    (cell,) = plain["cells"]
    assert "worst_error" not in plain["run"] and not {"worst_error", "reached_worst_error"} & set(cell)
    assert "spp" not in cell["images"] and "reference_spp_max" not in cell["cost"] and "worst" not in cell["reproduce"]


def test_a_picture_has_its_samples_beside_it(evalsuite, scene):
    words = ("reference", scene / "ball.xml", "--size", "32x32", "--target-error", "0.1", "--worst-error", "0.1")
    done = evalsuite(*words, "-o", scene / "truth.exr")
    assert done.code == 0, done.err
    assert "of the worst pixel" in done.out and "asked for 10.00%" in done.out
    parts = exr.read_parts(scene / "truth.exr")
    assert parts["samples"].shape == (32, 32) and len(np.unique(parts["samples"])) > 1


@pytest.mark.parametrize("value", ["0", "1.5", "-0.1"])
def test_no_usable_value(evalsuite, scene, value):
    done = evalsuite("run", "--scene", scene / "ball.xml", f"--worst-error={value}", "--out", scene / "bad")
    assert done.code == 2 and "--worst-error" in done.err and "Traceback" not in done.err
