"""`evalsuite figures` and `evalsuite list figures`, as typed."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
from PIL import Image


def test_figures_are_drawn_with_their_numbers(evalsuite, tmp_path):
    listed = json.loads(evalsuite("list", "figures", "--json").out)
    ids = [row["id"] for row in listed]
    assert {"001-fig4", "002-fig3"} <= set(ids)
    assert "002-fig3" in evalsuite("list", "figures").out

    done = evalsuite("figures", "--out", tmp_path / "my figüres")
    assert done.code == 0, done.err
    for name in ids:
        png, pdf, numbers = (tmp_path / "my figüres" / f"{name}.{kind}" for kind in ("png", "pdf", "json"))
        assert str(png) in done.out.replace("\n", "")
        picture = np.asarray(Image.open(png).convert("L"), float)
        assert min(picture.shape) > 400 and picture.std() > 10
        assert pdf.read_bytes().startswith(b"%PDF") and pdf.stat().st_size > 5000
        assert json.loads(numbers.read_text("utf-8"))["id"] == name


def test_one_figure_as_json(evalsuite, tmp_path):
    done = evalsuite("figures", "002-fig3", "--out", tmp_path, "--json")
    (numbers,) = json.loads(done.out)
    assert abs(numbers["ratio_centre_to_rim"] - 4) < 0.03
    assert sorted(path.name for path in tmp_path.iterdir()) == ["002-fig3.json", "002-fig3.pdf", "002-fig3.png"]


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
