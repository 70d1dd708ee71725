"""A small sweep of exponent and frequency, from the report file to the page's envelopes and rankings."""

from __future__ import annotations

import json

import pytest

REPORT = """
title = "A small sweep"
size = [32, 32]
[[group]]
scenes = ["sphere"]
environments = ["band-2", "band-8"]
techniques = ["glossy-boxmip-lod", "glossy-phong-map"]
parameters = { exponent = [10, 200], face_size = 16 }
"""


@pytest.fixture(scope="module")
def swept(evalsuite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "sweep.toml").write_text(REPORT)
    outcome = evalsuite("run", folder / "sweep.toml", "--target-error", "0.03", "--out", folder / "out")
    assert outcome.code == 0, outcome.err
    return folder, json.loads((folder / "out" / "results.json").read_text(encoding="utf-8"))


def test_environments_are_made_on_demand_and_references_shared(swept, cache):
    _, results = swept
    assert [c["status"] for c in results["cells"]] == ["scored"] * 8
    assert len(list((cache / "environments").glob("*/band-*.exr"))) >= 2
    assert len({c["reference_id"] for c in results["cells"]}) == 4, "one a frequency and exponent, for both techniques"
    assert all("--env band-" in c["reproduce"] and "--size 32x32" in c["reproduce"] for c in results["cells"])


def test_results_say_who_is_good_where(swept):
    _, results = swept
    (plane,) = results["envelopes"]["planes"]
    assert (plane["x"], plane["xs"], plane["y"], plane["ys"]) == ("exponent", [10, 200], "frequency", [2, 8])
    assert {p["cost"] for p in results["envelopes"]["pareto"]} == {"gpu_ms", "prepare_ms"}
    for entry in results["envelopes"]["pareto"]:
        assert entry["cells"] == 4 and any(p["on_front"] for p in entry["points"])
        for point in entry["points"]:
            for metric in (point["rel_rmse"], point[entry["cost"]]):
                assert metric["ci95"][0] <= metric["value"] <= metric["ci95"][1]
    for one in results["envelopes"]["crossovers"]:
        assert one["between"][0] <= one["value"] <= one["between"][1]


def test_results_rank_techniques_by_each_metric(swept):
    _, results = swept
    groups = results["rankings"]["groups"]
    assert len(groups) == 4 and all(len(g["cells"]) == 2 and len(g["ranks"]) == 12 for g in groups)
    # A box of MIP texels for a narrow lobe over waves that it resolves is worse than the lobe itself.
    fine = next(g for g in groups if g["shared"]["env"] == "band-8" and g["shared"]["exponent"] == 200)
    assert fine["ranks"]["rel_rmse"] == {"glossy-phong-map": [1, 1], "glossy-boxmip-lod": [2, 2]}
    for one in results["rankings"]["kendall"]:
        assert -1 <= one["ci95"][0] <= one["value"] <= one["ci95"][1] <= 1


def test_the_page_shows_them(swept):
    folder, _ = swept
    html = (folder / "out" / "index.html").read_text(encoding="utf-8")
    assert 'id="envelopes"' in html and "Where metrics disagree" in html
    for name in ("contours-1", "best-1", "pareto-1"):
        assert (folder / "out" / "envelopes" / f"{name}.svg").is_file() and f"envelopes/{name}.png" in html


def test_bad_sizes_and_degrees_are_refused_in_a_line(evalsuite, tmp_path):
    (tmp_path / "bad.toml").write_text(REPORT.replace("[32, 32]", "[32, 0]"))
    outcome = evalsuite("run", tmp_path / "bad.toml", "--dry-run")
    assert outcome.code == 2 and "size: got [32, 0], expected [width, height]" in outcome.err and outcome.err.count("\n") == 1
    (tmp_path / "bad.toml").write_text(REPORT.replace("band-8", "band-80"))
    outcome = evalsuite("run", tmp_path / "bad.toml", "--dry-run")
    assert outcome.code == 2 and "a degree from 1 to 64" in outcome.err and outcome.err.count("\n") == 1
    assert "band-ℓ" in evalsuite("env", "list").out
