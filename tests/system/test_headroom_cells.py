"""`evalsuite run --headroom`, as typed: the search's result in results.json and on the page, and nothing done twice."""

from __future__ import annotations

import json

import pytest
import schema


@pytest.fixture(scope="module")
def run(evalsuite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("headroom")

    def call(*words):
        done = evalsuite("run", "--scene", "sphere", "--size", "48x48", "--headroom", "--out", folder, *words)
        assert done.code == 0, done.err
        results = json.loads((folder / "results.json").read_text())
        schema.validate(results)
        return results, "".join(page.read_text() for page in folder.glob("cells/*.html"))

    return call


def test_a_level_is_searched_and_kept(run, evalsuite):
    results, page = run("--env", "overcast", "-t", "glossy-boxmip-lod", "-p", "exponent=20")
    (cell,) = results["cells"]
    (found,) = cell["headroom"]
    assert found["parameter"] == "lod_offset" and found["published"] == 0.0 and found["unit"] == "levels"
    assert found["published_rel_rmse"]["value"] == pytest.approx(cell["metrics"]["rel_rmse"]["value"], rel=1e-4)
    lo, hi = found["best_ci95"]
    assert lo < found["best"] < hi and not found["at_bound"]
    assert found["best_rel_rmse"]["value"] <= found["published_rel_rmse"]["value"]
    gain = found["published_rel_rmse"]["value"] - found["best_rel_rmse"]["value"]
    assert found["regret"]["value"] == pytest.approx(gain, abs=1e-6)
    assert found["regret"]["ci95"][0] <= gain <= found["regret"]["ci95"][1]
    assert found["per_pixel_rel_rmse"]["ci95"][0] <= found["best_rel_rmse"]["value"]
    assert "--headroom" in cell["reproduce"] and 8 <= len(found["drawn"]) <= 20
    assert "<h3>Headroom</h3>" in page and "lod_offset" in page
    (pool,) = results["headroom_summary"]["pools"]
    assert pool["cells"] == 1 and results["headroom_summary"]["sentence"] is None
    before = json.loads(evalsuite("cache", "info", "--json").out)["kinds"]
    again, _ = run("--env", "overcast", "-t", "glossy-boxmip-lod", "-p", "exponent=20")
    assert again["cells"][0]["headroom"] == cell["headroom"]
    assert json.loads(evalsuite("cache", "info", "--json").out)["kinds"] == before


def test_whole_numbers_and_techniques_without_a_free_parameter(run):
    results, _ = run("--env", "sh2", "-t", "diffuse-sh9", "-t", "mirror-cube")
    cells = {cell["technique"]: cell for cell in results["cells"]}
    (found,) = cells["diffuse-sh9"]["headroom"]
    assert [point["value"] for point in found["drawn"]] == [0.0, 1.0, 2.0]
    assert found["best"] == 2 and found["regret"]["value"] == 0.0  # a map of degree 2 needs all three
    assert cells["mirror-cube"]["headroom"] == []
    assert any("no parameter that is free" in note for note in cells["mirror-cube"]["notes"])


def test_a_report_asks_for_it_by_a_key(evalsuite, tmp_path):
    report = tmp_path / "mine.toml"
    text = 'title = "t"\n[[group]]\nscenes = ["sphere"]\ntechniques = ["diffuse-sh9"]\nheadroom = {}\n'
    report.write_text(text.format('"yes"'))
    done = evalsuite("run", report, "--dry-run")
    assert done.code == 2 and "headroom" in done.err and "true or false" in done.err and done.err.count("\n") == 1
    report.write_text(text.format("true"))
    assert evalsuite("run", report, "--dry-run").code == 0
