"""The page as files: complete, escaped, stable; and its colour scales."""

from __future__ import annotations

import json
import re
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from evalsuite.image import exr
from evalsuite.report import page, pictures, scales
from evalsuite.report.table import results_table

sys.path.insert(0, str(Path(__file__).parent))
import synthetic_results as synthetic
from unpacking import unpack


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    directory = tmp_path_factory.mktemp("a page é")
    results = synthetic.results(directory)
    page.write(results, directory)
    return directory, results


class Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.scripts, self.references = [], []

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag == "script":
            self.scripts.append(attributes.get("src"))
        self.references += [attributes[k] for k in ("src", "href") if attributes.get(k)]


def test_everything_named_is_there_and_nothing_is_remote(written):
    directory, _ = written
    names = ("visit", "view", "scores", "overview", "matrix", "plots", "sweeps")
    scripts = {"index.html": [*(f"static/{name}.js" for name in names), None, None]}  # the last two are data
    pages = [directory / "index.html", *(directory / "cells").glob("*.html")]
    assert len(pages) == 1 + 7
    for file in pages:
        tags = Tags()
        tags.feed(file.read_text(encoding="utf-8"))
        of_cell = page.CELL_SCRIPTS if 'class="viewer"' in file.read_text(encoding="utf-8") else page.PLAIN_SCRIPTS
        of_cell = [f"../static/{name}" for name in of_cell] + [None, None] * (of_cell is page.CELL_SCRIPTS)  # two of data
        assert tags.scripts == scripts.get(file.name, of_cell), "no script but ours"
        files = [r for r in tags.references if not r.startswith(("#", "data:"))]
        assert len(files) >= 5 and all((file.parent / r).is_file() for r in files)
    assert "MIT License" in (directory / "static" / "flipbook.LICENSE.txt").read_text()


def test_names_stay_text(written):
    directory, _ = written
    html = (directory / "index.html").read_text(encoding="utf-8") + synthetic.cell_pages(directory)
    assert synthetic.HOSTILE not in html and html.count("&lt;script&gt;window.pwned=1&lt;/script&gt;") >= 5
    assert pictures.js_json("</script>\u2028<!--&") == '"\\u003c/script\\u003e\\u2028\\u003c!--\\u0026"'
    assert json.loads(pictures.js_json({"a": "</script>\u2028é"})) == {"a": "</script>\u2028é"}


def received(path):
    """(name, content) of a file of data."""
    found = re.fullmatch(r'pixels\.receive\("([^"]+)", (\{.*\})\);\n', path.read_text(encoding="utf-8"))
    return found[1], json.loads(found[2])


def test_data_keeps_sign_and_value(written):
    directory, results = written
    cell = results["cells"][0]
    script = next((directory / "cells").glob("sphere_glossy-mcguire_exponent=10_*.js"))
    name, content = received(script)
    assert name == script.stem
    assert [p["name"] for p in content["pictures"]] == [title for title, _ in pictures.TITLES.values()]
    html = script.with_suffix(".html").read_text(encoding="utf-8")
    (own, shared) = re.search(r'data-files="([^"]+)"', html)[1].split()
    assert own == script.name and received(directory / "cells" / shared)[0] == shared
    packed = received(directory / "cells" / shared)[1]["packed"] | content["packed"]
    read = {name: unpack(one, content["height"], content["width"]) for name, one in packed.items()}
    assert set(read) == {"image", "flip", "reference", "sigma", "where"}, "all else follows from these"
    originals = {n: next(iter(exr.read_parts(directory / path).values())) for n, path in cell["images"].items()}
    sigma = originals["standard_error"]
    for name in ("image", "reference"):
        assert (np.abs(read[name] - originals[name]) < 0.26 * sigma).all()
    error = (read["image"] - read["reference"]).mean(-1)
    assert (np.abs(error - originals["error"].mean(-1)) < 0.4 * sigma.mean(-1)).all()
    assert np.abs(error - originals["error"].mean(-1)).mean() < 0.15 * sigma.mean()
    assert error.min() < -0.05 < 0.05 < error.max()
    np.testing.assert_allclose(read["sigma"], sigma, rtol=0.02)
    np.testing.assert_array_equal(read["where"], originals["mask"])
    np.testing.assert_allclose(read["flip"], originals["flip"], atol=1 / 512 + 1e-6)
    settings = content["pictures"][2]["tmo"]
    assert settings["min"] == -settings["max"] < 0


def test_a_second_run_leaves_the_data_alone(written):
    directory, results = written
    before = {p: p.stat().st_mtime_ns for p in (directory / "cells").rglob("*") if p.is_file()}
    started = time.process_time()
    page.write(results, directory)
    assert time.process_time() - started < 2.0
    assert {p: p.stat().st_mtime_ns for p in (directory / "cells").rglob("*") if p.is_file()} == before


def test_a_changed_picture_is_taken_up_and_a_gone_cell_removed(tmp_path):
    results = synthetic.results(tmp_path)
    results["cells"] = results["cells"][:2]
    page.write(results, tmp_path)
    scripts = sorted((tmp_path / "cells").glob("*.js"))
    path = tmp_path / results["cells"][0]["images"]["image"]
    exr.write(path, exr.read(path) * 2)
    changed = next(s for s in scripts if s.stem == path.parent.name)
    before = changed.read_bytes()
    page.write({**results, "cells": results["cells"][:1]}, tmp_path)
    assert changed.read_bytes() != before
    assert sorted((tmp_path / "cells").glob("*.js")) == [changed]


def test_unreadable_and_missing_pictures_are_named(tmp_path):
    results = synthetic.results(tmp_path)
    results["cells"] = results["cells"][:1]
    (tmp_path / results["cells"][0]["images"]["flip"]).unlink()
    (tmp_path / results["cells"][0]["images"]["error"]).write_bytes(b"junk")
    page.write(results, tmp_path)
    html = synthetic.cell_pages(tmp_path)
    assert "FLIP cannot be shown" in html and "Signed difference cannot be shown" in html


def test_bare_results(tmp_path):
    page.write({"schema": "evalsuite.results/1", "cells": []}, tmp_path)
    bare = {"id": "a/b/c/d", "scene": "a", "technique": "b", "target": "d", "status": "failed", "message": "no"}
    page.write({"schema": "evalsuite.results/1", "cells": [bare]}, tmp_path)
    assert "no scores" not in (tmp_path / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.0123456, "%", "1.23 %"), (-0.5, "", "−0.500"), (0, "", "0"), (None, "", "—"), (1234.5, "", "1234"),
     (1e-7, "", "1.00e-07"), (-0.0, "", "0"), (99.96, "", "100.0")],
)  # fmt: skip
def test_numbers(value, unit, text):
    assert page.number(value, unit) == text


def test_intervals():
    assert page.interval({"ci95": [0.010661, 0.010744]}, "%") == "1.066 … 1.074"
    assert page.interval({"ci95": [30.0, None]}, "dB") == "30.0 … ∞"
    assert page.interval({"ci95": [1.0, 1.0]}) == "no interval"
    assert page.interval(None) == ""


class TestScales:
    def test_signs_have_their_own_colours(self):
        scale = scales.diverging(2.0, "")
        (red, grey, blue) = scale.colours(np.array([1.5, 0.0, -1.5]))
        assert red[0] > red[2] + 0.3 and blue[2] > blue[0] + 0.3 and np.ptp(grey) < 0.02
        np.testing.assert_array_equal(scale.colours(np.array([9.0])), scale.colours(np.array([2.0])))

    def test_noise_is_grey(self):
        colours = scales.standard_errors().colours(np.array([0.0, 1.9, 2.1, 8.0]))
        assert np.ptp(colours[:2], axis=1).max() < 0.03 and np.ptp(colours[2:], axis=1).min() > 0.3

    @pytest.mark.parametrize(("top", "limit"), [(0.9, 1.0), (1.0, 1.0), (1.2, 2.0), (0.033, 0.05), (7e-5, 1e-4), (0.0, 1e-12)])
    def test_nice_limits(self, top, limit):
        assert scales.nice_limit(np.full(100, -top), 0.0) == pytest.approx(limit)


def test_terminal_table(written):
    console = Console(width=200, record=True, file=open("/dev/null", "w"))
    console.print(results_table(written[1]))
    text = console.export_text()
    assert "skipped: no score" in text and "<script>" in text and "10.7 %" in text


def test_inconclusive_orders_are_marked(tmp_path):
    results = synthetic.results(tmp_path)
    console = Console(width=200, record=True, force_terminal=False)
    console.print(results_table(results))
    page.write(results, tmp_path)
    assert "≈" not in console.export_text() and "≈" not in (tmp_path / "index.html").read_text(encoding="utf-8")
    scored = [cell for cell in results["cells"] if cell["status"] == "scored"]
    scored[0]["decided"], scored[1]["decided"] = False, True
    console.print(results_table(results))
    text = console.export_text()
    assert text.count("≈ ") == 2 and "≈ inconclusive" in text  # the cell's, and the legend's
    page.write(results, tmp_path)
    html = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert html.count(">≈</abbr>") == 1 and "--until-decided" in html
