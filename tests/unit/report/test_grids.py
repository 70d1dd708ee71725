"""Figures of pictures: every panel stands where it was put, in PNG, HTML and LaTeX alike."""

from __future__ import annotations

import io

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.report.figures import grids, rendered
from evalsuite.report.latex import escape

RED, GREEN, BLUE = (np.full((32, 32, 3), c, np.uint8) for c in ((250, 0, 0), (0, 250, 0), (0, 0, 250)))


@pytest.fixture
def grid():
    rows = [[grids.Panel(RED, "12 % [11 … 13]"), grids.Panel(GREEN)], [grids.Panel(BLUE), None]]
    return grids.Grid([grids.Block(rows, "A & B", ("f_λ = 0.1", "<i>"), ("one", "two"))], note="Stand-ins: a for b_c.")


def test_panels_stand_in_their_places(grid):
    out = io.BytesIO()
    grids.draw(grid).savefig(out, format="png", dpi=100)
    import imageio.v3 as iio

    picture = iio.imread(out.getvalue())[..., :3].astype(int)
    centres = {}
    for name, k in (("red", 0), ("green", 1), ("blue", 2)):
        others = [c for c in range(3) if c != k]
        y, x = np.nonzero((picture[..., k] > 200) & (picture[..., others].max(-1) < 60))
        assert len(y) > 5000
        centres[name] = (x.mean(), y.mean())
    assert centres["red"][0] < centres["green"][0] and abs(centres["red"][1] - centres["green"][1]) < 3
    assert centres["blue"][1] > centres["red"][1] and abs(centres["blue"][0] - centres["red"][0]) < 3


def test_words_stay_words(grid, tmp_path):
    grids.write(grid, tmp_path / "a.html")
    page = (tmp_path / "a.html").read_text("utf-8")
    assert "&lt;i&gt;" in page and "<i>" not in page and "A &amp; B" in page and "a for b_c." in page
    grids.write(grid, tmp_path / "a.tex")
    latex = (tmp_path / "a.tex").read_text("utf-8")
    assert r"f\_$\lambda$ = 0.1" in latex and r"12 \% [11 \ldots{} 13]" in latex and r"A \& B" in latex
    assert escape("v₀ = 10⁻⁵") == "v$_{0}$ = 10$^{-}$$^{5}$"
    assert escape("a\\b^2~{x}") == r"a\textbackslash{}b\textasciicircum{}2\textasciitilde{}\{x\}"


def test_crops_are_enlarged_and_marked():
    pixels = np.zeros((32, 32, 3), np.uint8)
    pixels[8:16, 4:12] = 200
    panel = grids.Panel(pixels).marked((4, 8, 8, 8))
    crop = panel.crop((4, 8, 8, 8), 0)
    assert crop.pixels.shape == (32, 32, 3) and (crop.pixels == 200).all() and crop.frame == 0
    drawn = grids.draw(grids.Grid([grids.Block([[panel, crop]])]))
    (mark,) = drawn.axes[0].patches
    assert mark.get_bbox().bounds == (3.5, 7.5, 8, 8)


def test_a_figure_without_its_cell_says_which(tmp_path):
    cells = [
        {"id": "s/t/a=1/u", "scene": "s", "technique": "t", "parameters": {"a": 1}, "status": "failed", "message": "out of luck"},
        {"id": "s/t/a=2/u", "scene": "s", "technique": "t", "parameters": {"a": 2}, "status": "scored", "message": ""},
    ]
    found = rendered.Rendered(tmp_path, cells, {"the bunny": "organic"})
    assert found.cell(a=2)["id"] == "s/t/a=2/u" and found.values("a") == [1, 2]
    assert found.note("Text.") == "Text. Brackets: 95 %. Stand-ins: organic for the bunny."
    with pytest.raises(EvalsuiteError, match="out of luck"):
        found.cell(a=1)
    with pytest.raises(LookupError):
        found.cell(scene="s")
