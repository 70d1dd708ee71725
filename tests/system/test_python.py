"""The Python interface, as README shows it, and the plugins in any Mitsuba."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import evalsuite as es


@pytest.fixture(autouse=True)
def own_store(cache, monkeypatch):
    monkeypatch.setenv("EVALSUITE_CACHE", str(cache))


def test_load_render_reference_compare():
    scene = es.load_scene("torus", envmap="sh2", size=(48, 48))
    image = es.render(scene, "glossy-mcguire", exponent=64)
    reference = es.reference(scene, "unoccluded", target_error=0.02)
    result = es.compare(image, reference)
    assert image.shape == (48, 48, 3) and image.dtype == np.float32
    assert reference.reached_error <= 0.02 and not reference.capped and reference.mask.sum() > 500
    np.testing.assert_allclose((reference.halves[0] + reference.halves[1]) / 2, reference.mean, rtol=1e-5)
    for shown, words in ((scene, "torus"), (reference, "relative standard error"), (result, "relative RMSE")):
        assert words in shown._repr_html_() and "<script" not in shown._repr_html_() and len(repr(shown)) < 200
    low, high = result.metrics["relmse"].ci95
    assert 0 < low <= result.metrics["relmse"].value <= high
    # The reference renders what the picture was drawn with: the published BRDF is darker than the formula, by its albedo.
    assert 0.3 < result.metrics["rel_bias"].value < 3
    other = es.render(scene, "diffuse-sh9")
    again = es.compare(other, es.reference(scene, "unoccluded"))
    assert abs(again.metrics["rel_bias"].value) < 0.01


@pytest.mark.parametrize(("call", "words"), [
    (lambda: es.load_scene("nowhere.xml"), "nowhere.xml"),
    (lambda: es.render(es.load_scene("torus"), "glossy-mcgire"), "glossy-mcguire"),
    (lambda: es.render(es.load_scene("torus"), "diffuse-sh9", exponent=3), "exponent"),
    (lambda: es.reference(es.load_scene("torus"), "paths"), "paths"),
])  # fmt: skip
def test_mistakes_are_named(call, words):
    with pytest.raises(es.EvalsuiteError, match=words):
        call()


@pytest.mark.parametrize("order", [
    "import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); import evalsuite",
    "import evalsuite; import mitsuba as mi; mi.set_variant('llvm_ad_rgb')",
    "import mitsuba as mi; import evalsuite; mi.set_variant('llvm_ad_rgb'); evalsuite.register()",
])  # fmt: skip
def test_plugins_are_known_to_mitsuba(order):
    code = f"{order}; print(mi.load_dict({{'type': 'blinnphong', 'exponent': 20.0}}), mi.load_dict({{'type': 'phong'}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "blinnphong[exponent=20" in done.stdout and "phong[exponent=50" in done.stdout
