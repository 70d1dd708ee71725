"""`evalsuite claims` and `evalsuite list claims`, as typed."""

from __future__ import annotations

import json

from evalsuite.scene.builtin import scenes_directory


def test_claims_on_one_page(evalsuite, tmp_path):
    ids = [row["id"] for row in json.loads(evalsuite("list", "claims", "--json").out)]
    chosen = ["001-cube-ratio", "001-circle", "001-filter-sizes", "004-counts"]
    assert set(chosen) < set(ids)
    done = evalsuite("claims", *chosen, "--out", tmp_path / "claims", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert [one["verdict"] for one in found] == ["holds", "holds within limits", "holds", "cannot be tested here"]
    assert json.loads((tmp_path / "claims" / "claims.json").read_text("utf-8"))["claims"] == found
    page = (tmp_path / "claims" / "claims.html").read_text("utf-8")
    for one in found:
        assert f'id="{one["id"]}"' in page and one["command"] in page
    assert "5.186, stated 5.196" in page and (tmp_path / "claims" / "static" / "claims.css").exists()


def test_a_papers_own_map(evalsuite, tmp_path):
    sky = scenes_directory() / "envmaps" / "overcast.exr"
    (one,) = json.loads(evalsuite("claims", "004-counts", "--env", f"grace={sky}", "--out", tmp_path, "--json").out)
    assert one["verdict"] == "does not hold" and one["numbers"]["lights"] == {"grace": 0}


def test_a_claim_of_rendered_cells(evalsuite, tmp_path):
    """Its own cells alone, in a report beside the page; the claim beside it needs none."""
    out = tmp_path / "claims"
    asked = ("claims", "003-constant", "001-cube-ratio", "--size", "32x32", "--target-error", "0.1", "--json")
    constant, cube = json.loads(evalsuite(*asked, "--out", out).out)
    assert constant["verdict"] == "holds within limits" and cube["verdict"] == "holds" and cube["cells"] == []
    bias = constant["numbers"]["rel_bias"]
    assert abs(bias["diffuse-topmip"]["value"]) < 0.01 and bias["glossy-mcguire, s = 500"]["ci95"][0] > 0.5
    results = json.loads((out / "cells" / "results.json").read_text("utf-8"))
    assert [cell["id"] for cell in results["cells"]] == constant["cells"] and len(constant["cells"]) == 7
    page = (out / "claims.html").read_text("utf-8")
    assert page.count('href="cells/index.html"') == 1 and (out / "cells" / "index.html").exists()


def test_the_page_links_a_figure_that_was_drawn(evalsuite, tmp_path):
    def page():
        evalsuite("claims", "001-circle", "001-paraboloid-ratio", "--out", tmp_path / "claims")
        return (tmp_path / "claims" / "claims.html").read_text("utf-8")

    assert "evalsuite figures 001-fig12" in page()
    evalsuite("figures", "001-fig12", "--out", tmp_path / "figures")
    linked = page()
    assert 'href="../figures/001-fig12.png"' in linked and "evalsuite figures 002-fig3" in linked


def test_bad_choices_are_one_line(evalsuite, tmp_path):
    for arguments in (("001-cubes",), ("001-circle", "--env", "grace=gone.exr"), ("001-circle", "--env", "grace")):
        done = evalsuite("claims", *arguments, "--out", tmp_path / "none")
        assert done.code == 2 and done.err.count("\n") == 1, done.err
    assert not (tmp_path / "none").exists()
