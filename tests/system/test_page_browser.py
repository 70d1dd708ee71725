"""The page opened from disk and used in a headless Chromium."""

from __future__ import annotations

import io
import json
import shutil
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from evalsuite.image import exr
from evalsuite.image.color import tone_map
from evalsuite.report import page as report
from evalsuite.report import pictures
from evalsuite.store.results import slug

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
import synthetic_results as synthetic

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("report with spaces é")
    results = synthetic.results(directory)
    (directory / "results.json").write_text(json.dumps(results), encoding="utf-8")
    report.write(results, directory)
    return directory


@pytest.fixture
def page(browser, folder):
    """The page, open; at the end no error was logged and nothing but local files was asked for."""
    context = browser.new_context(viewport={"width": 1440, "height": 1000})
    page = context.new_page()
    page.set_default_timeout(15_000)
    problems, requests = [], []
    page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto((folder / "index.html").as_uri() + "#?view=table")
    yield page
    assert page.evaluate("window.pwned") is None
    assert problems == []
    assert requests and [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    context.close()


def column(page, index):
    return [" ".join(t.split()) for t in page.locator(f"#summary tbody tr td:nth-child({index})").all_inner_texts()]


def open_cell(page, index=0):
    """Open the cell of a row and wait until FlipBook has drawn every picture."""
    page.locator("#summary tbody tr").nth(index).locator("td").nth(3).click()
    page.wait_for_selector(".cell .book canvas", state="attached")
    page.wait_for_function("document.querySelectorAll('.cell .strip button').length === "
                           "document.querySelectorAll('.cell .book canvas').length")  # fmt: skip


def canvas(page):
    """What FlipBook shows once it has settled: (H, W, 3) in [0, 1]. It draws on a timer, within 100 ms of a change."""
    shown, before = page.locator(".cell .book canvas:visible"), None
    for _ in range(40):
        page.wait_for_timeout(250)
        now = iio.imread(io.BytesIO(shown.screenshot()))[..., :3] / 255
        if before is not None and now.shape == before.shape and np.array_equal(now, before) and now.std() > 0.01:
            return now
        before = now
    pytest.fail("the viewer stays empty or never settles")


def test_table_sorts_and_filters(page):
    scenes = column(page, 2)
    assert len(scenes) == 7 and synthetic.HOSTILE in scenes
    page.get_by_role("button", name="Scene").click()
    assert column(page, 2) == sorted(scenes, key=str.lower)
    page.get_by_role("button", name="rel. RMSE").click()
    ascending = [float(t.split()[0]) for t in column(page, 8)[:4]]
    assert ascending == sorted(ascending)
    assert page.locator("th[aria-sort=ascending]").inner_text() == "rel. RMSE"
    page.get_by_role("button", name="rel. RMSE").click()
    assert "scored" in column(page, 7)[0], "cells without a score stay last"
    page.get_by_role("button", name="GPU ms").click()
    assert column(page, 7)[-3:] != ["scored"] * 3, "columns after a spanning reason still sort by their own values"
    page.fill("#filter", "glossy sphere")
    assert page.locator("#summary tbody tr:visible").count() == 2
    assert page.locator("#shown").inner_text() == "2 of 7 cells"
    page.fill("#filter", "")
    page.select_option("#status", "failed")
    assert page.locator("#summary tbody tr:visible").count() == 1


def test_pictures_and_signs(page):
    open_cell(page)
    image = canvas(page)
    assert image.std() > 0.1, "not one flat colour"
    page.locator(".cell .strip button").nth(2).click()
    error = canvas(page)
    assert np.abs(image[:400, :400].mean((0, 1)) - error[:400, :400].mean((0, 1))).max() > 0.1
    height, width = error.shape[:2]
    patch = slice(int(0.4 * height), int(0.5 * height))
    left = error[patch, int(0.35 * width) : int(0.45 * width)].mean((0, 1))  # too bright there
    right = error[patch, int(0.55 * width) : int(0.65 * width)].mean((0, 1))  # too dark there
    assert left[0] > left[2] + 0.15 and right[2] > right[0] + 0.15
    corner = error[:8, :8].mean((0, 1))
    assert np.ptp(corner) < 0.1 and corner.min() > 0.8, "no error is near white"


def exact(folder, cell):
    """name → the colours that Python gives a cell's pictures, in full size and before any compression."""
    arrays = {n: next(iter(exr.read_parts(folder / path).values())) for n, path in cell["images"].items()}
    mask = arrays.pop("mask") > 0.5
    shown = pictures.Data(arrays, mask).shown
    scales = {p.name: p.scale for p in pictures.prepare(cell, slug(cell["id"]), folder).pictures}
    return {
        name: tone_map(array, cell["exposure"]) if name in ("image", "reference")
        else scales[name].colours(array.mean(-1) if array.ndim == 3 else array)
        for name, array in shown.items()
    }  # fmt: skip


def test_viewer_and_previews_have_the_same_colours(page, folder):
    """One colour scale, three implementations: Python's preview, the legend's CSS and FlipBook's GLSL."""
    open_cell(page)
    colours = exact(folder, json.loads((folder / "results.json").read_text(encoding="utf-8"))["cells"][0])
    for index, name in enumerate(("image", "reference", "error", "relative", "zscore", "flip")):
        page.locator(".cell .strip button").nth(index).click()
        shown, expected = canvas(page), colours[name]
        step = shown.shape[0] / expected.shape[0]
        centres = ((np.arange(10, 80, 5) + 0.5) * step).astype(int)
        found, wanted = shown[np.ix_(centres, centres)], expected[10:80:5, 10:80:5]
        # Whole steps beside float32: near the jump of the scale at z = 2 a pixel may fall on the other side.
        assert np.median(np.abs(found - wanted)) < 0.02 and np.mean(np.abs(found - wanted).max(-1) > 0.06) < 0.06, name
        preview = iio.imread(folder / "cells" / page.locator(".cell .strip img").nth(index).get_attribute("src")) / 255
        blocks = [a.reshape(12, 8, 12, 8, 3).mean((1, 3)) for a in (preview, expected)]
        assert np.abs(blocks[0] - blocks[1]).max() < 0.05, f"preview of {name}"


def test_keyboard(page):
    page.locator("#summary tbody tr").first.focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    page.wait_for_selector(".cell .book canvas", state="attached")
    page.wait_for_timeout(600)
    assert "/cells/" in page.url and "exponent=100" in page.url
    book = page.locator(".cell .book [tabindex='0']").first
    book.focus()
    page.keyboard.press("3")
    page.wait_for_selector(".cell .strip figure:nth-child(3) button[aria-pressed=true]")
    page.keyboard.press("Escape")
    page.wait_for_selector("#overview")
    assert page.evaluate("document.activeElement.dataset.cell").startswith("sphere_glossy-mcguire_exponent=100")
    assert page.locator("[tabindex]:not([tabindex='0']):not([tabindex='-1'])").count() == 0


def test_steps_go_through_all_cells(page):
    order = [row.get_attribute("data-cell") for row in page.locator("#summary tbody tr").all()]
    page.locator("#summary tbody tr td a").first.click()
    assert steps(page) == order
    page.locator("a.back").click()
    page.get_by_role("button", name="rel. RMSE").click()
    page.fill("#filter", "exponent")
    page.select_option("#status", "scored")
    shown = [row.get_attribute("data-cell") for row in page.locator("#summary tbody tr:visible").all()]
    assert len(shown) == 4 and shown != [slug for slug in order if slug in shown]
    page.locator("#summary tbody tr td a:visible").first.click()
    assert steps(page) == shown, "as sorted and filtered"
    page.keyboard.press("Escape")
    page.wait_for_selector("#summary")
    assert page.locator("#summary tbody tr:visible").count() == 4 and page.input_value("#filter") == "exponent"
    assert page.evaluate("document.activeElement.dataset.cell") == shown[-1]


def steps(page):
    """The cells that the link to the next one leads through."""
    seen = []
    while True:
        page.wait_for_selector(".cell")
        seen.append(page.locator(".cell").get_attribute("id"))
        following = page.locator("a[rel=next]")
        if following.is_hidden():
            return seen
        following.click()
        page.wait_for_function("slug => document.querySelector('.cell')?.id !== slug", arg=seen[-1])


def test_without_storage_the_order_is_the_reports(browser, folder):
    context = browser.new_context()
    context.add_init_script("Object.defineProperty(window, 'sessionStorage', { get() { throw new Error('forbidden'); } })")
    page = context.new_page()
    problems = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto((folder / "index.html").as_uri() + "#?view=table")
    page.get_by_role("button", name="rel. RMSE").click()
    order = [cell["id"] for cell in json.loads((folder / "results.json").read_text(encoding="utf-8"))["cells"]]
    page.goto((folder / "cells" / f"{slug(order[0])}.html").as_uri())
    assert steps(page) == [slug(identity) for identity in order] and problems == []
    context.close()


def test_without_scripts_all_links_lead_on(browser, folder):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((folder / "index.html").as_uri() + "#?view=table")
    page.locator("#summary tbody tr td a").nth(3).click()
    assert page.locator(".cell h1").inner_text().startswith(synthetic.HOSTILE)
    assert page.locator(".strip img").first.is_visible() and page.locator(".viewer").is_hidden()
    page.locator("a[rel=prev]").click()
    assert page.locator(".cell h1").inner_text().startswith("torus")
    page.locator("a.back").click()
    assert page.locator("#summary").is_visible()
    context.close()


def test_links_of_old_reports_lead_to_the_cell(page, folder):
    name = page.locator("#summary tbody tr").nth(3).get_attribute("data-cell")
    page.goto("about:blank")
    page.goto((folder / "index.html").as_uri() + "#" + name)
    page.wait_for_url("**/cells/*.html")
    assert page.locator(".cell h1").inner_text().startswith(synthetic.HOSTILE)


def test_cells_without_scores_say_why(page):
    page.select_option("#status", "failed")
    assert synthetic.HOSTILE in page.locator("#summary tbody tr:visible").inner_text()
    page.locator("#summary tbody tr:visible").click()
    page.wait_for_selector(".cell")
    assert synthetic.HOSTILE in page.locator(".cell .verdict").inner_text()
    assert page.locator(".cell .viewer").count() == 0


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1440, "dark")])
def test_fits_small_and_large_screens(browser, folder, width, scheme):
    context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=scheme)
    page = context.new_page()
    page.goto((folder / "index.html").as_uri() + "#?view=table")
    open_cell(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, background[4:-1].split(","))) > 384) == (scheme == "light")
    assert page.evaluate("[...document.images].every((image) => image.alt)")
    context.close()
