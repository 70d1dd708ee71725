"""What a run keeps of its environments, and of other truths."""

from __future__ import annotations

import json

import numpy as np
import pytest
from test_shadow_cells import folder  # noqa: F401

from evalsuite.image import exr


@pytest.fixture(scope="module")
def cells(evalsuite, folder):  # noqa: F811
    words = ("-t", "shadow-pcss", "-t", "diffuse-sh9", "--target", "direct", "--size", "48x48", "--target-error", "0.05")
    done = evalsuite("run", "--scene", folder / "box.xml", "--out", folder / "kept", *words)
    assert done.code == 0, done.err
    return folder / "kept", {
        cell["technique"]: cell for cell in json.loads((folder / "kept" / "results.json").read_text())["cells"]
    }


def test_lights_are_those_of_the_decomposition(evalsuite, folder, cells):  # noqa: F811
    _, by_technique = cells
    done = evalsuite("decompose", folder / "lamp.exr", "--output", folder / "apart")
    assert done.code == 0, done.err
    lights = json.loads((folder / "apart" / "lights.json").read_text())
    assert len(lights) >= 1 and by_technique["shadow-pcss"]["lights"] == lights
    assert by_technique["diffuse-sh9"]["lights"] == []


def test_an_environment_is_kept_once(cells):
    out, by_technique = cells
    kept = list((out / "images" / "environments").glob("*/*.exr"))
    assert len(kept) == 1 and {out / cell["images"]["environment"] for cell in by_technique.values()} == set(kept)
    small = exr.read(kept[0])
    assert small.shape[:2] == (128, 256) and small.max() == pytest.approx(20.0, rel=1e-3)
    assert small.min() == pytest.approx(0.02, rel=1e-3)
    pages = [p.read_text(encoding="utf-8") for p in (out / "cells").glob("*.html")]
    assert len(pages) == 2 and all("environments/" in html for html in pages)
    assert sorted('viewBox="0 0 360 180"' in html for html in pages) == [False, True]


def test_other_truths_are_kept_and_shared(cells):
    out, by_technique = cells
    truths = by_technique["diffuse-sh9"]["truths"]
    assert set(truths) == {"unoccluded"}
    path = by_technique["diffuse-sh9"]["images"]["target-unoccluded"]
    assert path == f"images/references/{truths['unoccluded']}/reference.exr"
    mask = exr.read(out / by_technique["diffuse-sh9"]["images"]["mask"])[..., 0] > 0.5
    unoccluded, direct = (exr.read(out / p)[..., :3] for p in (path, by_technique["diffuse-sh9"]["images"]["reference"]))
    shadow = mask & (unoccluded.mean(-1) > 1.5 * direct.mean(-1))
    assert shadow.sum() > 10, "it has no shadow of the box"
    rung = next(iter(exr.read_parts(out / by_technique["diffuse-sh9"]["images"]["rung-0"]).values()))
    difference = (unoccluded - direct).mean(-1)
    assert np.abs(rung - difference)[mask].max() < 0.05 * np.abs(difference[mask]).max(), "what is kept is rounded"
    assert np.corrcoef(rung[mask], difference[mask])[0, 1] > 0.99
