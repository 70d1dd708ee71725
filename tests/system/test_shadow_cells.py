"""Shadow techniques through the program: cells, their chain of truths, and the scene whose caster deforms."""

from __future__ import annotations

import json

import lamp_and_box
import numpy as np
import pytest
import schema
from scipy import ndimage

from evalsuite.image import exr


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("one light, one box")
    lamp_and_box.write(place, 96, (0.5, 0.8, 0.4), 128)
    return place


def run(evalsuite, folder, *words):
    done = evalsuite("run", "--scene", folder / "box.xml", "--out", folder / "out", *words)
    assert done.code == 0, done.err
    results = json.loads((folder / "out" / "results.json").read_text())
    schema.validate(results)
    return results["cells"]


def test_one_light_one_box_is_what_the_wedges_are_to_compute(evalsuite, folder):
    """Against Mitsuba shading from the light's centre: the penumbra within 3 %, the umbra dark, nothing that stands out."""
    (cell,) = run(evalsuite, folder, "-t", "shadow-wedges", "--target", "discs-centre", "--target-error", "0.004")
    assert cell["status"] == "scored" and cell["metrics"]["rel_rmse"]["value"] < 0.01
    names = ("image", "reference", "standard_error", "mask")
    image, truth, noise, mask = (exr.read(folder / "out" / cell["images"][n])[..., :3].mean(-1) for n in names)
    inside = mask > 0.5
    dark, bright = truth[inside].min(), np.median(truth[inside])
    penumbra = inside & (truth > dark + 0.03 * (bright - dark)) & (truth < bright - 0.03 * (bright - dark))
    assert penumbra.sum() > 150
    error = image - truth
    square = max(float((error[penumbra] ** 2 - noise[penumbra] ** 2).mean()), 0.0)
    assert np.sqrt(square) / truth[penumbra].mean() < 0.03
    # Where two faces of the box meet, the 4 × 4 grid of sub-samples places their edge to an eighth of a pixel; unshadowed light
    # shows where that is.
    done = evalsuite("reference", folder / "box.xml", "--target", "discs-unshadowed", "-o", folder / "unshadowed.exr")
    assert done.code == 0, done.err
    plain = exr.read(folder / "unshadowed.exr")[..., :3].mean(-1)
    crease = ndimage.maximum_filter(plain, 3) > 1.2 * ndimage.minimum_filter(plain, 3)
    stands_out = inside & ~crease & (np.abs(error) > 0.05 * bright + 4.0 * noise)
    assert (inside & ~crease).sum() > 3000 and ndimage.label(stands_out)[1] == 0


def test_the_error_is_split_by_cause(evalsuite, folder):
    (cell,) = run(evalsuite, folder, "-t", "shadow-wedges", "--target", "direct")
    rungs = cell["ledger"]
    assert [r["rung"] for r in rungs] == [
        "decomposition",
        "missing ambient shadow",
        "centre-direction shading",
        "wedge algorithm",
    ]
    assert rungs[0]["from"] == "direct" and rungs[-1]["to"] == "shadow-wedges"
    assert sum(r["fraction"] for r in rungs) == pytest.approx(1.0) and cell["ledger_closure"] < 1e-6
    assert sum(r["value"] for r in rungs) == pytest.approx(cell["metrics"]["mse"]["value"], rel=0.05)
    assert all(r["ci95"][0] <= r["value"] <= r["ci95"][1] for r in rungs)
    differences = [exr.read(folder / "out" / cell["images"][f"rung-{k}"])[..., 0] for k in range(4)]
    names = ("reference", "standard_error", "image", "mask")
    reference, sigma, image, mask = (exr.read(folder / "out" / cell["images"][name]).mean(-1) for name in names)
    # As they are kept: each rung in steps of a 32nd of its largest at most, the pictures to a part of the standard error.
    steps = sum(np.percentile(np.abs(one), 99.9) / 32 for one in differences)
    off = np.abs(np.sum(differences, axis=0) - (image - reference))
    assert (off <= 0.1 * sigma + steps / 2)[mask > 0.5].all() and np.abs(image - reference).max() > 10 * steps
    (page,) = [page.read_text() for page in (folder / "out" / "cells").glob("*.html")]
    assert "Where the error comes from" in page and "missing ambient shadow" in page


def test_each_frame_of_the_dancer_has_its_own_shadow(evalsuite, tmp_path):
    pictures = []
    for frame in (0, 4):
        file = tmp_path / f"{frame}.exr"
        done = evalsuite("render", "dancer", "-t", "shadow-wedges", "-p", f"frame={frame}", "--size", "96x96", "-o", file)
        assert done.code == 0, done.err
        pictures.append(exr.read(file))
    assert np.abs(pictures[0] - pictures[1]).max() > 0.1 * pictures[0].mean()
