"""The non-photorealistic maps end to end: GPU pictures beside Mitsuba's exact look-up, and which truth suits whom."""

from __future__ import annotations

import json

import pytest

REPORT = """
[[group]]
scenes = ["sphere", "teapot", "organic"]
techniques = ["npr-sketch", "npr-cool-warm", "npr-hatching"]
parameters = { viewer = "local", filter = "finest" }

[[group]]
scenes = ["sphere", "teapot", "organic"]
techniques = ["npr-silhouette"]
parameters = { viewer = "local", hierarchy = ["equal", "box"] }
"""

#: rel_rmse allowed without MIP levels: 4 × 4 sub-samples against a hundred, of a blurred map and of maps with sharp edges.
BOUNDS = {"npr-cool-warm": 0.01, "npr-sketch": 0.05, "npr-hatching": 0.08}


@pytest.fixture(scope="module")
def cells(evalsuite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("npr")
    (folder / "npr.toml").write_text(REPORT)
    done = evalsuite("run", folder / "npr.toml", "--size", "96x96", "--target-error", "0.03", "--out", folder / "out", "--json")
    assert done.code == 0, done.err
    return json.loads(done.out)["cells"]


def test_pictures_agree_with_mitsubas_lookup(cells):
    assert len(cells) == 15 and {cell["target"] for cell in cells} == {"lookup"}
    for cell in cells:
        assert cell["status"] == "scored" and cell["certificate"]["passed"], cell["message"]
        if cell["technique"] in BOUNDS:
            metrics = cell["metrics"]
            assert 0 < metrics["rel_rmse"]["value"] < BOUNDS[cell["technique"]], (cell["id"], metrics)
            assert abs(metrics["rel_bias"]["value"]) < 0.004, (cell["id"], metrics)


def test_the_equal_hierarchy_is_nearer_to_the_truth_than_a_box_filtered_one(cells):
    """Both are held against the same picture of Mitsuba's. What is curved most loses its silhouettes to box filtering."""
    for scene, share in (("sphere", 0.95), ("teapot", 0.5), ("organic", 0.4)):
        error = {
            cell["parameters"]["hierarchy"]: cell["metrics"]["rel_rmse"]["value"]
            for cell in cells
            if cell["scene"] == scene and cell["technique"] == "npr-silhouette"
        }
        assert 0.03 < error["equal"] < share * error["box"], (scene, error)


def test_each_technique_has_its_own_truth(evalsuite, tmp_path):
    refused = evalsuite(
        "run", "--scene", "sphere", "-t", "npr-sketch", "--target", "direct", "--size", "32x32", "--out", tmp_path / "a"
    )
    assert refused.code == 2 and "'direct' is no truth for it; its target is lookup" in refused.err.replace("\n", " ")
    refused = evalsuite(
        "run", "--scene", "sphere", "-t", "diffuse-sh9", "--target", "lookup", "--size", "32x32", "--out", tmp_path / "b"
    )
    assert refused.code == 2 and "no light reaches" in refused.err
    assert "lookup" in [row["name"] for row in json.loads(evalsuite("list", "targets", "--json").out)]
    refused = evalsuite("reference", "sphere", "--target", "lookup", "-o", tmp_path / "none.exr", "--size", "16x16")
    assert refused.code == 2 and "without an `npr` material" in refused.err
