"""The page of trends opened from disk and used in a headless Chromium."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from evalsuite.report import trends as report

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
import synthetic_trends as synthetic
from test_page_browser import CHROMIUM, browser  # noqa: F401

pytestmark = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
POINTS, CHANGES = [59, 142, 208], [217, 119, 43]
TORUS = "torus/glossy-mcguire/exponent=12/direct"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("trends with spaces é")
    trends = synthetic.made()
    (directory / "trends.json").write_text(json.dumps(trends), encoding="utf-8")
    report.write(trends, {"title": "Small <b>", "cells": [{"id": TORUS}]}, directory)
    return directory


@pytest.fixture
def open_page(browser, folder):  # noqa: F811
    """open_page(query, …) → the page; at the end no error was logged and nothing but local files was asked for."""
    contexts, problems, requests = [], [], []

    def call(query="", width=1440, scheme="light"):
        contexts.append(
            browser.new_context(viewport={"width": width, "height": 1000}, color_scheme=scheme, reduced_motion="reduce")
        )
        page = contexts[-1].new_page()
        page.set_default_timeout(15_000)
        page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto((folder / "trends.html").as_uri() + query)
        return page

    yield call
    assert all(context.pages[0].evaluate("window.pwned") is None for context in contexts)
    assert problems == [] and requests and [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    for context in contexts:
        context.close()


def plot(page):
    """What the plot shows once it has settled: (H, W, 3) in 0 … 255."""
    page.wait_for_selector("#trend .plot canvas", state="attached")
    before = None
    for _ in range(40):
        page.wait_for_timeout(250)
        now = iio.imread(io.BytesIO(page.locator("#trend .plot").screenshot()))[..., :3].astype(int)
        if before is not None and now.shape == before.shape and (now == before).all() and near(now, POINTS).any():
            return now
        before = now
    pytest.fail("the plot stays empty or never settles")


def near(picture, colour):
    return np.abs(picture - colour).max(-1) < 24


def change_lines(picture):
    """Where upright dashed lines stand: the middles of groups of columns with much of their colour."""
    columns = np.flatnonzero(near(picture, CHANGES).sum(0) > 40)
    return [group.mean() for group in np.split(columns, np.flatnonzero(np.diff(columns) > 3) + 1) if group.size]


def test_changes_come_first_and_are_told(open_page):
    page = open_page()
    names = page.locator("#series .cell-id").all_inner_texts()
    assert [name.split("/")[1] for name in names[:3]] == ["diffuse-sh9", "glossy-mcguire", "glossy-mcguire"] and len(names) == 12
    assert all("llvmpipe" in name for name in names[:3]) and "H100" in names[-1]
    words = " ".join(page.locator("#series tbody tr", has_text=TORUS).first.locator(".said").inner_text().split())
    commits = [check["commit"] for check in synthetic.made()["checks"][15:17]]
    assert words.startswith("rel_rmse rose from 4.") and f"at check 17 (commit {commits[0]} → {commits[1]})" in words
    assert words.endswith("of the mean; verdict: further.")
    assert page.locator("#series a").evaluate_all(
        "links => links.every((a) => /^cells\\/torus.*\\.html$/.test(a.getAttribute('href')))"
    )


def test_the_plot_has_the_step_where_it_is(open_page):
    page = open_page(f"?cell={TORUS} on llvmpipe (LLVM 19.1.7, 256 bits)")
    assert page.locator("#trend-head").inner_text() == TORUS
    picture = plot(page)
    [line] = change_lines(picture)
    rows, columns = np.nonzero(near(picture, POINTS))
    before, after = rows[columns < line - 5], rows[columns > line + 5]
    assert np.median(after) < np.median(before) - 100, "the error rose"
    share = (line - columns.min()) / np.ptp(columns)
    assert share == pytest.approx((16.5 - 1) / 31, abs=0.03)


def test_a_press_shows_another_and_the_address_keeps_it(open_page):
    page = open_page()
    assert len(change_lines(plot(page))) == 1
    page.get_by_role("button", name="Show sphere/glossy-mcguire/exponent=64/unoccluded on llvmpipe").click()
    page.wait_for_function("document.querySelector('#trend .plot').getAttribute('aria-label').includes('exponent=64')")
    page.wait_for_timeout(500)
    assert len(change_lines(plot(page))) == 2 and page.locator("#trend-said li").count() == 2
    assert page.locator("[aria-pressed=true]").count() == 1
    again = open_page("?" + page.url.split("?")[1])
    assert again.locator("#trend-head").inner_text() == "sphere/glossy-mcguire/exponent=64/unoccluded"
    page.locator("#series tbody tr", has_text="bunny").first.locator("button").press("Enter")
    page.wait_for_function("document.querySelector('#trend .plot').getAttribute('aria-label').includes('No change of level')")
    page.wait_for_timeout(500)
    assert change_lines(plot(page)) == []


def test_hover_tells_date_commit_and_verdict(open_page):
    page = open_page(f"?cell={TORUS} on llvmpipe (LLVM 19.1.7, 256 bits)")
    picture = plot(page)
    [line] = change_lines(picture)
    host = page.locator("#trend .plot").bounding_box()
    # The first point after the change: the thickest part of the first mark right of the line.
    marks = near(picture, POINTS)
    first = int(line) + 1 + int(np.argmax(marks[:, int(line) + 1 :].sum(0) > 0))
    centre = first + int(np.argmax(marks[:, first : first + 9].sum(0)))
    rows = np.flatnonzero(marks[:, centre])
    page.mouse.move(host["x"] + centre, host["y"] + rows.mean())
    page.get_by_text("2026-10-17").wait_for()
    text = " ".join(page.locator(".bk-tooltip-row-value").all_inner_texts())
    commit = synthetic.made()["checks"][16]["commit"]
    assert commit in text and "further" in text and "2026-10-17" in text


def test_filter(open_page):
    page = open_page()
    page.fill("#filter", "torus llvmpipe")
    assert page.locator("#series tbody tr:visible").count() == 1 and page.locator("#shown").inner_text() == "1 of 12 rows"
    assert "filter=torus" in page.url
    page.fill("#filter", synthetic.made()["checks"][11]["commit"])
    assert page.locator("#shown").inner_text() == "6 of 12 rows", "a commit finds what was checked at it"


def test_small_drawings_show_the_changes(open_page):
    page = open_page()
    sparks = [iio.imread(io.BytesIO(b.screenshot()))[..., :3].astype(int) for b in page.locator("#series .spark svg").all()[:4]]
    lines = [near(spark, CHANGES).any(0) for spark in sparks]
    groups = [int((np.diff(np.concatenate([[0], line.astype(int)])) == 1).sum()) for line in lines]
    assert groups == [1, 2, 1, 0]


def test_one_check_is_a_page_too(open_page, tmp_path):
    for checks in (0, 1):
        report.write(synthetic.made(checks), {}, tmp_path)
        page = open_page()
        page.goto((tmp_path / "trends.html").as_uri())
        assert page.locator("#series tbody tr").count() == 6 * checks
        assert ("No check has scored a cell yet." in page.locator(".lead").inner_text()) == (checks == 0)
        if checks:
            assert near(plot(page), POINTS).any()


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (390, "dark"), (1440, "light"), (1440, "dark")])
def test_accessible_and_fits(open_page, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = open_page(width=width, scheme=scheme)
    picture = plot(page)
    assert (np.median(picture) > 128) == (scheme == "light")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    found = axe.run(page, options={"preload": False}).response["violations"]
    assert [(v["id"], v["nodes"][0]["html"][:120]) for v in found if v["impact"] in ("serious", "critical")] == []
