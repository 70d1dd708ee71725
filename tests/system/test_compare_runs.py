"""`evalsuite compare RUN_A RUN_B`: what the terminal says, and the page in a headless Chromium, judged by its pixels."""

from __future__ import annotations

import io
import json
import shutil
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
import two_runs as two

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
browser_only = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
VERDICTS = ["further from truth", "closer to truth", "undecided", "unchanged"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, evalsuite):
    """(what the command said, the folder of the comparison)."""
    parent = tmp_path_factory.mktemp("two runs é")
    a, b = two.pair(parent)
    return evalsuite("compare", a, b, "-o", parent / "compared"), parent / "compared"


def test_terminal_says_what_changed(folder):
    said, directory = folder
    assert said.code == 0, said.err
    assert "Of 4 cells in both runs: 1 further from truth, 1 closer to truth, 1 undecided, 1 unchanged." in said.out
    assert "1 only in A, 1 only in B." in said.out and str(directory / "index.html") in said.out
    lines = {line.split("/")[0].split()[-1]: line for line in said.out.splitlines() if "glossy-mcguire" in line}
    assert lines["better"].startswith("✓ closer") and lines["worse"].startswith("✗ further")
    assert lines["noisy"].startswith("≈ undecided") and "same" not in lines
    data = json.loads((directory / "comparison.json").read_text(encoding="utf-8"))
    assert data["schema"] == "evalsuite.comparison/1" and data["counts"]["closer"] == 1


def test_json_and_results_files(folder, evalsuite):
    _, directory = folder
    a, b = (directory.parent / side / "results.json" for side in "ab")
    said = evalsuite("compare", a, b, "--json")
    assert said.code == 0 and json.loads(said.out)["cells"] == json.loads((directory / "comparison.json").read_text())["cells"]


@pytest.mark.parametrize(("words", "expected"), [
    (["a", "nowhere"], "the folders of two runs"),
    (["a", "b", "--mask", "m.exr"], "two runs alone"),
    (["a", "b", "-o", "a"], "a folder of its own"),
    (["a", "compared"], "results.json: got no such file"),
])  # fmt: skip
def test_bad_input_is_one_line_and_exit_code_2(folder, evalsuite, words, expected):
    said = evalsuite("compare", *words, cwd=folder[1].parent)
    assert said.code == 2 and said.err.count("\n") == 1 and said.err.startswith("error: ") and expected in said.err


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


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
    page.goto((folder[1] / "index.html").as_uri())
    yield page
    assert page.evaluate("window.pwned") is None and page.locator("main script").count() == 0
    assert problems == []
    assert requests and [url for url in requests if not url.startswith(("file:", "data:"))] == []
    context.close()


def verdicts(page):
    return [text.strip()[2:] for text in page.locator("#changes tbody tr:visible .verdict-mark").all_inner_texts()]


def shown(page, scene: str, number: int) -> np.ndarray:
    """Pixels of a cell's picture on the screen, (H, W, 3) in [0, 1]."""
    image = page.locator(f"article[id^={scene}] img").nth(number)
    image.scroll_into_view_if_needed()
    page.wait_for_function("e => e.complete && e.naturalWidth > 0", arg=image.element_handle())
    return iio.imread(io.BytesIO(image.screenshot()))[..., :3] / 255


class TestPage:
    pytestmark = browser_only

    def test_map_is_blue_where_closer_and_red_where_further(self, page):
        for scene, sign in (("better", 1), ("worse", -1)):
            colours = shown(page, scene, 3)
            height, width = colours.shape[:2]
            middle = colours[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3].mean((0, 1))
            assert sign * (middle[2] - middle[0]) > 0.2
            assert np.ptp(colours[2:10, 2:10].mean((0, 1))) < 0.03, "nothing is said off the object"
        colours = shown(page, "noisy", 3)
        assert 0.02 < np.abs(colours[..., 0] - colours[..., 2]).mean() < 0.15, "noise: both colours, neither of them all over"

    def test_pictures_side_by_side(self, page):
        """A has twice the step at the middle that B has; the reference has none."""
        steps = []
        for number in range(3):
            picture = shown(page, "better", number)
            height, width = picture.shape[:2]
            row = picture[int(0.7 * height) : int(0.9 * height), :, 2].mean(0)
            steps.append(row[width // 2 - 20 : width // 2 - 6].mean() - row[width // 2 + 6 : width // 2 + 20].mean())
        assert steps[0] > 1.5 * steps[1] > 2.5 * abs(steps[2])
        tops = {page.locator("article[id^=better] img").nth(i).bounding_box()["y"] for i in range(4)}
        assert len(tops) == 1, "in one row"

    def test_sorts(self, page):
        assert verdicts(page) == VERDICTS
        page.get_by_role("button", name="Δ squared error").click()
        assert verdicts(page) == ["closer to truth", "unchanged", "undecided", "further from truth"]
        page.get_by_role("button", name="Δ squared error").click()
        assert verdicts(page)[0] == "further from truth"
        assert page.locator("th[aria-sort=descending]").inner_text() == "Δ squared error"
        page.get_by_role("button", name="Verdict").click()
        assert verdicts(page) == VERDICTS
        page.get_by_role("button", name="Cell").click()
        assert page.locator("#changes tbody tr .cell-id").first.inner_text().startswith("better")

    def test_filters_and_keeps_the_view_in_the_address(self, page):
        page.select_option("#verdict", "closer")
        assert verdicts(page) == ["closer to truth"] and page.locator("#shown").inner_text() == "1 of 4 cells"
        assert page.locator("article:visible").count() == 1
        page.get_by_role("button", name="Cell").click()
        address = page.url
        page.goto("about:blank")
        page.goto(address)
        assert verdicts(page) == ["closer to truth"] and page.locator("th[aria-sort=ascending]").inner_text() == "Cell"
        page.select_option("#verdict", "")
        page.fill("#filter", "noisy mcguire")
        assert verdicts(page) == ["undecided"]
        page.fill("#filter", "")
        assert len(verdicts(page)) == 4 and page.locator("article:visible").count() == 3

    def test_keyboard_reaches_everything(self, page):
        page.locator("#filter").focus()
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.id") == "verdict"
        page.locator("#changes a").first.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("Math.abs(document.querySelector('article').getBoundingClientRect().top) < 400")
        assert "#worse" in page.url

    @pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (1440, "dark"), (390, "light"), (390, "dark")])
    def test_accessible_and_fits(self, browser, folder, width, scheme):
        from axe_playwright_python.sync_playwright import Axe

        context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=scheme)
        page = context.new_page()
        page.goto((folder[1] / "index.html").as_uri())
        found = Axe().run(page).response["violations"]
        assert [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")] == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        background = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, background[4:-1].split(","))) > 384) == (scheme == "light")
        assert page.evaluate("[...document.images].every((image) => image.alt)")
        context.close()

    def test_names_stay_text(self, page):
        assert "<script>window.pwned=1</script>" in page.locator("dl.facts").inner_text()
        page.locator("details.alone").nth(1).locator("summary").click()
        assert "<script>window.pwned=1</script>/glossy-mcguire" in page.locator("details.alone").nth(1).inner_text()
