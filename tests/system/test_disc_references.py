"""`evalsuite reference` and `run` with the targets that decompose the environment, end to end."""

from __future__ import annotations

import json

import numpy as np
import OpenEXR


def mean(path):
    with OpenEXR.File(str(path)) as file:
        return file.parts[0].channels["RGB"].pixels.mean()


def test_settings_of_the_decomposition(evalsuite, tmp_path):
    words = ("reference", "still-life", "--env", "office", "--size", "24x24", "--target-error", "0.1", "--target")
    pictures = {}
    for name, more in {"few": ("discs", "-p", "stop=0.5"), "many": ("discs",), "none": ("discs", "-p", "max_lights=0")}.items():
        done = evalsuite(*words, *more, "-o", f"{name}.exr", cwd=tmp_path)
        assert done.code == 0, done.err
        pictures[name] = mean(tmp_path / f"{name}.exr")
    # What is no light casts no shadow.
    assert pictures["many"] < 0.99 * pictures["none"] and np.isfinite(list(pictures.values())).all()
    for more, said in (
        (("discs", "-p", "stop=-1"), "parameter stop"),
        (("discs", "-p", "stopp=1"), "the parameter 'stopp'"),
        (("direct", "-p", "stop=0.1"), "the parameter 'stop'"),
    ):
        done = evalsuite(*words, *more, "-o", "x.exr", cwd=tmp_path)
        assert done.code == 2 and said in done.err and "Traceback" not in done.err


def test_any_technique_of_light_is_held_against_them(evalsuite, tmp_path):
    words = ("run", "--scene", "sphere", "--env", "sh2", "--size", "32x32", "--target-error", "0.1", "--out", "o", "--json")
    done = evalsuite(*words, "-t", "diffuse-sh9", "-t", "npr-sketch", "--target", "discs-unshadowed", cwd=tmp_path)
    assert done.code == 0, done.err
    cells = {cell["technique"]: cell for cell in json.loads((tmp_path / "o" / "results.json").read_text())["cells"]}
    assert cells["diffuse-sh9"]["status"] == "scored" and cells["npr-sketch"]["status"] == "skipped"
    # A map of low frequencies holds no lights, or next to none: the technique is as good as against `unoccluded`.
    assert abs(cells["diffuse-sh9"]["metrics"]["rel_bias"]["value"]) < 0.05
