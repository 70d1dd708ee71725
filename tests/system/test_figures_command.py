"""`evalsuite figures` and `evalsuite list figures`, as typed."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
from PIL import Image

from evalsuite.report.figures import FIGURES
from evalsuite.scene.builtin import reports_directory, scenes_directory

#: What is computed alone, and what is quickest of what is rendered.
QUICK = ("001-fig1", "001-fig4", "001-fig6", "001-fig12", "002-fig3", "headroom-mcguire")


def test_figures_are_drawn_with_their_numbers(evalsuite, tmp_path):
    listed = json.loads(evalsuite("list", "figures", "--json").out)
    assert set(QUICK) < {row["id"] for row in listed}
    assert "002-fig3" in evalsuite("list", "figures").out

    done = evalsuite("figures", *QUICK, "--out", tmp_path / "my figüres")
    assert done.code == 0, done.err
    for name in QUICK:
        png, pdf, numbers = (tmp_path / "my figüres" / f"{name}.{kind}" for kind in ("png", "pdf", "json"))
        assert str(png) in done.out.replace("\n", "")
        picture = np.asarray(Image.open(png).convert("L"), float)
        assert min(picture.shape) > 400 and picture.std() > 10
        assert pdf.read_bytes().startswith(b"%PDF") and pdf.stat().st_size > 5000
        assert json.loads(numbers.read_text("utf-8"))["id"] == name


def test_a_figure_of_rendered_cells(evalsuite, tmp_path):
    """Every panel, the numbers behind them, what stands in for the paper's, and the same figure from the user's own map."""
    asked = ("figures", "000-fig5", "--size", "48x48", "--target-error", "0.1", "--json")
    done = evalsuite(*asked, "--out", tmp_path / "stand-in")
    assert done.code == 0, done.err
    (numbers,) = json.loads(done.out)
    assert numbers["stand_ins"] == {"the bunny": "organic", "the Uffizi gallery": "office"}
    phong, box, best = (one["rel_rmse"] for one in numbers["cells"].values())
    assert phong["value"] < 0.2 < box["value"], "N = 225 is not b = 2.25 on such a curved thing"
    assert best["ci95"][1] < box["ci95"][0], "the bias that the search finds is nearer"
    results = json.loads((tmp_path / "stand-in" / "cells" / "results.json").read_text("utf-8"))
    assert set(numbers["cells"]) == {cell["id"] for cell in results["cells"]}
    page = (tmp_path / "stand-in" / "000-fig5.html").read_text("utf-8")
    assert page.count("data:image/png") == 9 and "organic for the bunny" in page and "N = 225, b = 2.25" in page
    latex = tmp_path / "stand-in" / "latex" / "000-fig5"
    assert len(list(latex.glob("*.png"))) == 9 and r"\begin{tikzpicture}" in (latex / "000-fig5.tex").read_text("utf-8")

    done = evalsuite(*asked, "--env", f"uffizi={scenes_directory() / 'envmaps' / 'overcast.exr'}", "--out", tmp_path / "own")
    (numbers,) = json.loads(done.out)
    assert numbers["stand_ins"] == {"the bunny": "organic"} and all("overcast.exr" in name for name in numbers["cells"])
    done = evalsuite(*asked, "--env", "ufizi=a.exr", "--out", tmp_path / "none")
    assert done.code == 2 and done.err.count("\n") == 1 and "uffizi" in done.err and not (tmp_path / "none").exists()


def test_a_mesh_of_ones_own_and_whether_it_comes_out_again(evalsuite, tmp_path):
    """The lock of a figure with the user's mesh; made again it reproduces; with another number in the lock it does not."""
    asked = ("figures", "000-fig4", "--size", "32x32", "--target-error", "0.1")
    mesh = tmp_path / "mine.ply"
    mesh.write_bytes((scenes_directory() / "meshes" / "sphere72.ply").read_bytes())
    done = evalsuite(*asked, "--mesh", f"bunny={mesh}", "--out", tmp_path, "--json")
    assert done.code == 0, done.err
    (numbers,) = json.loads(done.out)
    assert numbers["stand_ins"] == {"the Uffizi gallery": "office"} and all(
        name.startswith("bunny/") for name in numbers["cells"]
    )
    page = (tmp_path / "index.html").read_text("utf-8")
    assert 'id="000-fig4"' in page and "office for the Uffizi gallery" in page and 'href="latex/000-fig4/000-fig4.tex"' in page

    again = evalsuite("figures", "--verify", "--out", tmp_path, "--json")
    assert again.code == 0, again.err
    assert [(one["id"], one["verdict"]) for one in json.loads(again.out)] == [("000-fig4", "reproduces")]
    lock = tmp_path / "figures.lock.json"
    locked = json.loads(lock.read_text("utf-8"))
    row = next(row for name, row in locked["figures"]["000-fig4"]["numbers"].items() if name.endswith("rel_rmse"))
    row["value"], row["ci95"] = 2 * row["value"], [2 * end for end in row["ci95"]]
    lock.write_text(json.dumps(locked))
    moved = evalsuite("figures", "--verify", "--out", tmp_path)
    assert moved.code == 1 and "no longer reproduces" in moved.out and "rel_rmse" in moved.out
    mesh.write_bytes(mesh.read_bytes() + b" ")
    changed = evalsuite("figures", "--verify", "--out", tmp_path)
    assert changed.code == 2 and "which was changed" in changed.err
    wrong = [("figures", "--verify", "002-fig3", "--out", tmp_path), (*asked, "--mesh", f"hare={mesh}"),
             (*asked, "--mesh", "bunny=gone.ply")]  # fmt: skip
    for words in wrong:
        done = evalsuite(*words)
        assert done.code == 2 and done.err.count("\n") == 1, done.err


def test_area_lights_under_four_maps(evalsuite, tmp_path):
    """One run serves teaser and table; the paper's own maps take the stand-ins' places in figures without cells too."""
    envmaps = scenes_directory() / "envmaps"
    asked = ("figures", "004-teaser", "004-fig2", "004-table1", "--size", "48x48", "--target-error", "0.1", "--json")
    done = evalsuite(*asked, "--env", f"st-peters={envmaps / 'sunsky.exr'}", "--out", tmp_path / "a")
    assert done.code == 0, done.err
    teaser, found, table = json.loads(done.out)
    results = json.loads((tmp_path / "a" / "cells" / "results.json").read_text("utf-8"))
    assert len(results["cells"]) == 8 and set(table["cells"]) > set(teaser["cells"])
    expected = {"Galileo's tomb": "chapel", "Grace Cathedral": "cathedral", "the kitchen": "office"}
    assert found["stand_ins"] == table["stand_ins"] == expected
    counts = {role: len(one["lights"]) for role, one in found["maps"].items()}
    assert counts == {role: row["lights"] for role, row in table["rows"].items()} and counts["st-peters"] == 1, "the sun"
    of_cell = {(c["environment"], c["scene"]): c["cost"]["gpu_ms"] for c in results["cells"]}
    for row in table["rows"].values():
        for scene, fps in row["fps"].items():
            low, high = fps["ci95"]
            assert fps["value"] == 1e3 / of_cell[row["environment"].rpartition("/")[-1], scene]
            assert low < fps["value"] and (high is None or fps["value"] < high)
    assert (tmp_path / "a" / "004-teaser.html").read_text("utf-8").count("data:image/png") == 5
    assert r"\begin{tabular}" in (tmp_path / "a" / "latex" / "004-table1" / "004-table1.tex").read_text("utf-8")

    other = tmp_path / "other" / "sunsky.exr"
    other.parent.mkdir()
    other.write_bytes((envmaps / "overcast.exr").read_bytes())
    same = ("--env", f"grace={envmaps / 'sunsky.exr'}", "--env", f"kitchen={other}")
    done = evalsuite("figures", "004-fig3", *same, "--out", tmp_path / "b")
    assert done.code == 2 and done.err.count("\n") == 1 and "another name" in done.err and not (tmp_path / "b").exists()


def test_the_shipped_lock_has_every_figure_and_its_numbers_come_out(evalsuite, tmp_path):
    """Where a folder has no lock. Those that are computed alone come out on any machine."""
    shipped = json.loads((reports_directory() / "figures" / "figures.lock.json").read_text("utf-8"))
    assert set(shipped["figures"]) == set(FIGURES)
    assert all(row["behind"] for one in shipped["figures"].values() for row in one["numbers"].values())
    done = evalsuite("figures", "--verify", "001-fig12", "002-fig3", "001-fig13", "--out", tmp_path / "none", "--json")
    assert done.code == 0, done.err
    assert all(one["verdict"] in ("reproduces", "within noise") for one in json.loads(done.out))


def test_one_figure_as_json(evalsuite, tmp_path):
    done = evalsuite("figures", "002-fig3", "--out", tmp_path, "--json")
    (numbers,) = json.loads(done.out)
    assert abs(numbers["ratio_centre_to_rim"] - 4) < 0.03
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "002-fig3.json", "002-fig3.pdf", "002-fig3.png", "figures.lock.json", "index.html", "static",
    ]  # fmt: skip


def test_an_unknown_figure_is_one_line_on_stderr(evalsuite, tmp_path):
    done = evalsuite("figures", "002-fig33", "--out", tmp_path / "none")
    assert done.code == 2 and done.err.count("\n") == 1 and "did you mean '002-fig3'" in done.err
    assert not (tmp_path / "none").exists()
    (tmp_path / "file").write_text("")
    done = evalsuite("figures", "002-fig3", "--out", tmp_path / "file" / "below")
    assert done.code == 2 and "a folder that can be written" in done.err


def test_help_does_not_wait_for_matplotlib():
    code = "import sys, evalsuite.cli, evalsuite.report.figures as f; assert f.FIGURES and 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
