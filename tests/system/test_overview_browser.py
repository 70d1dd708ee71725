"""The overview opened from disk in a headless Chromium: its controls, judged by what is drawn."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
import time
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from evalsuite.compare import ranking
from evalsuite.compare.causes import causes
from evalsuite.compare.findings import findings
from evalsuite.report import page as report
from evalsuite.report.numbers import interval, number

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "compare"))
import synthetic_results as synthetic
from test_envelopes import sweep

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


def scored(scene, technique, environment, value, exponent=None, target="unoccluded", ms=10.0, reference=None, bias=0.0):
    """A cell with numbers and no pictures."""
    parameters = {"env": environment} | ({"exponent": exponent} if exponent else {})
    identity = f"{scene}/{technique}/{environment},{exponent}/{target}"
    metric = {"value": value, "ci95": [0.9 * value, 1.1 * value]}
    flip = {"value": 0.5 - value, "ci95": [0.45 - value, 0.55 - value]}
    signed = {"value": bias, "ci95": [bias - 0.01, bias + 0.01]}
    metrics = {"rel_rmse": metric, "mse": metric, "flip": flip, "rel_bias": signed, "rel_rmse_full": metric}
    metrics |= dict.fromkeys(("relmse", "smape", "mae", "max_abs", "p99_abs", "delta_e2000"), metric)
    regional = {"rel_rmse": {"value": 2 * value, "ci95": [value, 3 * value]}, "rel_bias": signed}
    region = {"grazing": {"pixels": 9, "share": metric, "metrics": regional}}
    rung = {"from": "truth", "to": "picture", "value": value, "ci95": [value, value], "rel_rmse": metric, "rel_bias": signed}
    ledger = [{"rung": "lobe", "fraction": 0.7, "fraction_ci95": [0.6, 0.8], **rung},
              {"rung": "filter kernel", "fraction": 0.3, "fraction_ci95": [0.2, 0.4], **rung}]  # fmt: skip
    return {"id": identity, "scene": scene, "environment": environment, "technique": technique, "parameters": parameters,
            "target": target, "status": "scored", "message": "", "certificate": None, "metrics": metrics, "regions": region,
            "images": {}, "reference_id": reference or identity, "cost": {"gpu_ms": ms}, "ledger": ledger,
            "ledger_total": value, "ledger_closure": 0.0}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("an overview é")
    cells = [
        *(scored("ball", "blur", "office", 0.01 * k, exponent=s, ms=5.0, bias=-0.2) for k, s in ((1, 10), (4, 100), (16, 1000))),
        scored("ball", "sharp", "office", 0.05, exponent=10, ms=8.0, bias=0.2),
        scored("ring", "blur", "office", 0.3, exponent=10, ms=5.0, reference="ring"),
        scored("ring", "sharp", "office", 0.31, exponent=10, ms=9.0, reference="ring"),
        scored("ring", "quick", "office", 0.9, exponent=10, ms=1.0, reference="ring"),
        scored("ring", "sharp", "office", 0.2, exponent=10, target="path"),
        scored(synthetic.HOSTILE, synthetic.HOSTILE, synthetic.HOSTILE, 0.001),
        {**scored("ring", "broken", "office", 0.1), "status": "failed", "metrics": {}, "ledger": [], "message": "no picture"},
    ]
    results = {"schema": "evalsuite.results/1", "cells": cells, "host": {}, "causes": causes(cells)}
    ranked = [ranking.rank(group) for group in ranking.groups(cells)]
    results["rankings"] = {"kendall": ranking.kendall(ranked), "groups": ranked, "flips": []}
    report.write(json.loads(json.dumps(results)), directory)
    return directory


@pytest.fixture
def open_page(browser, folder):
    """open_page(hash, **context) → page; at the end nothing was logged as an error and nothing remote was asked for."""
    contexts, problems, requests = [], [], []

    def call(fragment="", where=folder, **options):
        context = browser.new_context(**({"viewport": {"width": 1440, "height": 1000}} | options))
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(15_000)
        page.on("console", lambda message: problems.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto((where / "index.html").as_uri() + fragment)
        return page

    yield call
    for context in contexts:
        assert all(page.evaluate("window.pwned") is None for page in context.pages)
        context.close()
    assert problems == [] and [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []


def picture(locator):
    """What an element shows: (H, W, 3) in 0 … 255."""
    return iio.imread(io.BytesIO(locator.screenshot()))[..., :3].astype(int)


def entry(page, technique, scene):
    """The matrix's entry in the technique's own row."""
    heads = [h.split("\n")[0] for h in page.locator("#matrix thead th").all_inner_texts()]
    return page.locator("#matrix tr.lead").filter(has_text=technique).locator("th, td").nth(heads.index(scene))


def ground(locator):
    """The colour of an entry's ground, off its words: near its left lower corner."""
    shown = picture(locator)
    return shown[-5:-3, 4:6].reshape(-1, 3).mean(0)


def settled(page, locator):
    """A plot once it is drawn and stays as it is."""
    locator.scroll_into_view_if_needed()
    before = None
    for _ in range(40):
        page.wait_for_timeout(200)
        now = picture(locator)
        if before is not None and now.shape == before.shape and (now == before).all() and now.std() > 1:
            return now
        before = now
    pytest.fail("the plot stays empty or never settles")


def magma(t):
    """Nine equidistant stops, as the legend's gradient has them."""
    from evalsuite.report import scales

    codes = np.array([code for _, code in scales.flip().stops], float)
    return np.array([np.interp(8 * t, np.arange(9), codes[:, k]) for k in range(3)])


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_an_entrys_colour_is_its_values_on_the_scale(open_page, scheme):
    page = open_page(color_scheme=scheme)
    low, high = 0.001, 1.0  # 1, 2, 5 × 10ⁿ about the values
    for technique, scene, value in (("sharp", "ball", 0.05), ("blur", "ring", 0.3), ("quick", "ring", 0.9)):
        t = np.log(value / low) / np.log(high / low)
        expected = magma(t if scheme == "dark" else 1 - t)
        assert np.abs(ground(entry(page, technique, scene)) - expected).max() <= 2, (technique, scene)
        # … and the legend has that colour at that place.
        bar = picture(page.locator("#legend .bar"))
        assert np.abs(bar[bar.shape[0] // 2, round(t * (bar.shape[1] - 1))] - expected).max() <= 6
    assert page.locator("#legend .ticks").inner_text().split("\n")[0].strip() == "0.1 %"


def test_words_are_legible_on_every_colour(open_page):
    for scheme in ("light", "dark"):
        page = open_page(color_scheme=scheme)
        page.locator("#expand").click()
        for style in page.locator("#matrix td[data-value]").evaluate_all(
            "all => all.map((e) => [getComputedStyle(e).backgroundColor, getComputedStyle(e).color])"
        ):
            back, ink = (np.array([int(v) for v in re.findall(r"\d+", c)[:3]]) / 255 for c in style)
            lums = sorted(
                float(np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])
                for c in (back, ink)
            )
            assert (lums[1] + 0.05) / (lums[0] + 0.05) >= 4.5


def test_metric_region_and_target_change_what_is_drawn(open_page):
    page = open_page()
    table = page.locator("#matrix")
    assert entry(page, "sharp", "ball").inner_text().split("\n") == ["5.00 %", "4.50 … 5.50"]
    before = picture(table)
    page.select_option("#metric", "flip")
    after = picture(table)
    assert before.shape != after.shape or np.abs(before - after).mean() > 3
    assert entry(page, "sharp", "ball").inner_text().startswith("0.450")
    page.select_option("#metric", "rel_bias")  # its own colours: red too bright, blue too dark
    red, blue = ground(entry(page, "sharp", "ball")), ground(entry(page, "blur", "ball"))
    assert red[0] > red[2] + 60 and blue[2] > blue[0] + 60
    page.select_option("#metric", "rel_rmse")
    page.select_option("#region", "grazing")
    assert entry(page, "sharp", "ball").inner_text().split("\n") == ["10.0 %", "5.00 … 15.0"]
    page.select_option("#target", "path")
    assert page.locator("#matrix tbody tr").count() == 1 and "40.0 %" in table.inner_text()


def test_intervals_and_inconclusive_marks(open_page):
    page = open_page()
    assert entry(page, "sharp", "ring").inner_text().startswith("≈ 31.0 %"), "overlaps blur's interval of the same reference"
    assert "≈" not in entry(page, "quick", "ring").inner_text() and "≈" not in entry(page, "sharp", "ball").inner_text()
    assert "failed" in entry(page, "broken", "ring").inner_text()
    assert page.locator("#matrix abbr").first.get_attribute("title").startswith("inconclusive")


def test_settings_unfold_and_lead_to_their_cells(open_page):
    page = open_page()
    lead = entry(page, "blur", "ball")
    assert lead.inner_text().split("\n") == ["16.0 %", "14.4 … 17.6", "worst of 3"]
    page.locator("#matrix .fold").click()
    rows = page.locator("#matrix tr.setting")
    assert [r.split("\t")[0].strip() for r in rows.all_inner_texts()] == ["exponent 10", "exponent 100", "exponent 1000"]
    assert page.evaluate("document.activeElement.textContent").startswith("blur")
    page.locator("#matrix .fold").click()
    assert rows.count() == 0
    page.locator("#expand").click()
    assert rows.count() == 3
    rows.nth(1).locator("a").first.click()
    page.wait_for_url("**/cells/ball_blur_*")
    page.go_back()
    page.wait_for_selector("#matrix tr.setting", state="attached")


def test_columns_sort_and_names_too(open_page):
    page = open_page()

    def order():
        return [t.split("\n")[0].strip() for t in page.locator("#matrix tr.lead th").all_inner_texts()]

    page.locator("#matrix thead").get_by_role("button", name="ring").click()
    assert order()[:3] == ["blur", "sharp", "quick"], "by error; what has none comes last"
    page.locator("#matrix thead").get_by_role("button", name="ring").click()
    assert order()[:3] == ["quick", "sharp", "blur"]
    assert page.locator("#matrix th[aria-sort=descending]").inner_text().startswith("ring")
    page.locator("#matrix thead button").first.focus()
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.textContent") == "Technique", "the focus stays"
    assert order() == sorted(order(), key=str.lower) and len(order()) == 5


def test_the_filter_is_shared(open_page):
    page = open_page()
    page.fill("#filter", "sharp ball")
    assert page.locator("#matrix tr.lead").count() == 1 and page.locator("#shown").inner_text() == "1 of 10 cells"
    page.get_by_role("tab", name="All cells").click()
    assert page.locator("#summary tbody tr:visible").count() == 1 and page.locator("#matrix").is_hidden()
    page.fill("#filter", "")
    page.select_option("#status", "failed")
    page.get_by_role("tab", name="Matrix").click()
    assert page.locator("#matrix tr.lead th").all_inner_texts() == ["broken"]
    page.select_option("#status", "")
    page.fill("#filter", "no such thing")
    assert page.locator("#nothing").is_visible()


def test_the_address_holds_the_view(open_page):
    page = open_page()
    page.select_option("#metric", "flip")
    page.select_option("#target", "path")
    page.fill("#filter", "sharp")
    page.locator("#matrix thead").get_by_role("button", name="ring").click()
    address = page.url
    other = open_page("#" + address.split("#")[1])
    for control, value in (("#metric", "flip"), ("#target", "path"), ("#filter", "sharp")):
        assert other.input_value(control) == value
    assert other.locator("#matrix th[aria-sort=ascending]").inner_text().startswith("ring")
    assert other.locator("#matrix").inner_text() == page.locator("#matrix").inner_text()
    assert open_page().url.endswith("index.html"), "the report's own view has a bare address"
    broken = open_page("#?metric=nonsense&region=%3Cb%3E&target=x&by=nowhere&view=odd")
    assert broken.input_value("#metric") == "rel_rmse" and broken.locator("#matrix tr.lead").count() == 5


def test_arrows_go_from_entry_to_entry(open_page):
    page = open_page()
    entry(page, "blur", "ball").locator("a").focus()
    page.keyboard.press("ArrowRight")
    assert "30.0 %" in page.evaluate("document.activeElement.textContent")
    page.keyboard.press("ArrowDown")
    assert "31.0 %" in page.evaluate("document.activeElement.textContent")
    page.keyboard.press("Enter")
    page.wait_for_url("**/cells/ring_sharp_*")


def test_findings_lead_to_cells_and_sections(open_page, folder):
    page = open_page()
    largest = page.locator(".findings li").filter(has_text="Largest error")
    assert "relative RMSE 90.0 % [81.0 … 99.0]" in largest.inner_text().replace("\xa0", " ")
    for link in page.locator(".findings a").all():
        target = link.get_attribute("href")
        assert page.locator(target).count() == 1 if target.startswith("#") else (folder / target).is_file()
    largest.locator("a").click()
    page.wait_for_url("**/cells/ring_quick_*")


def test_a_sweep_opens_with_axes(open_page):
    page = open_page()
    row = page.locator("#sweeps tbody tr")
    assert row.count() == 1 and "exponent" in row.inner_text()
    small = picture(row.locator("svg"))
    inked = np.argwhere(np.abs(small - small[0, 0]).max(-1) > 60)
    first, last = inked[inked[:, 1] < 12], inked[inked[:, 1] > small.shape[1] - 12]
    assert first[:, 0].mean() > last[:, 0].mean() + 15, "the error rises with the exponent, so the curve does"
    assert "16.0 % (14.4 … 17.6) at exponent 1000" in row.locator("svg").get_attribute("aria-label")
    row.locator("button").click()
    plot = settled(page, page.locator("#sweep .plot"))
    assert (np.abs(plot - [59, 142, 208]).max(-1) < 12).sum() > 60, "points of the first colour"
    assert page.locator("#sweep tbody tr").count() == 3
    page.keyboard.press("Escape")
    assert page.locator("#sweep").is_hidden()


def test_plots_load_when_looked_at_and_follow_dark_and_light(open_page):
    page = open_page()
    assert page.evaluate("typeof Bokeh") == "undefined", "the library waits until a plot comes into view"
    plot = page.locator("#pareto-plot")
    light = settled(page, plot)
    assert plot.get_attribute("role") == "group"
    assert "On the front: quick" in plot.get_attribute("aria-label") and "GPU time" in plot.get_attribute("aria-label")
    page.emulate_media(color_scheme="dark")
    dark = settled(page, plot)
    assert np.median(light) > 240 and np.median(dark) < 40, "without loading anew"
    front = page.locator("#front").inner_text()
    assert "quick" in front and "90.0 % [81.0 … 99.0] at 1.00 ms" in front and "blur" in front and "sharp" not in front
    page.select_option("#metric", "flip")
    page.wait_for_function("document.querySelector('#front').textContent.includes('blur') === false")
    assert np.abs(settled(page, plot) - dark).mean() > 0.3


def test_ledger_bars(open_page):
    page = open_page("", color_scheme="dark")
    plot = page.locator("[data-figure=ledger]")
    shown = settled(page, plot)
    lobe, kernel = (np.abs(shown - code).max(-1) < 3 for code in ([213, 94, 0], [0, 114, 178]))
    assert 2.0 < lobe.sum() / kernel.sum() < 2.7, "70 % beside 30 %"
    assert plot.get_attribute("aria-label").count("lobe costs most, 70%") == 4
    box = plot.bounding_box()
    y, x = np.argwhere(lobe)[len(np.argwhere(lobe)) // 2]
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.wait_for_timeout(500)
    hovered = picture(plot)
    assert np.abs(hovered - shown).max(-1).astype(bool).sum() > 2000, "hovering tells the share"


def test_envelopes_are_plots(open_page, tmp_path):
    cells = [
        *sweep("rising", lambda n, f, w: 0.01 * (n / 10) ** 0.5, 0.02, face_sizes=(8, 32)),
        *sweep("falling", lambda n, f, w: 0.04 * (n / 10) ** -0.5, 0.02, reference="own-{n:g}-{f}"),
    ]
    for k, cell in enumerate(cells):
        cell |= {"id": f"cell {k}", "status": "failed", "images": {}, "certificate": None, "message": ""}
    results = {"schema": "evalsuite.results/1", "cells": cells, "host": {}}
    report.write(results | findings([(c, {}) for c in cells]), tmp_path)
    page = open_page(where=tmp_path)
    rising, _, falling = (settled(page, page.locator(f"[data-figure=contours-1-{k}]")) for k in (1, 2, 3))
    yellow, dark = [253, 231, 60], [0, 34, 78]  # from the least error to the most
    assert (np.abs(falling - yellow).max(-1) < 40).sum() > 2000 and (np.abs(rising - dark).max(-1) < 40).sum() > 2000
    assert (np.abs(rising - yellow).max(-1) < 40).sum() < 50, "only the falling one gets so good"
    settled(page, page.locator("[data-figure=pareto-1-gpu_ms]"))


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (390, "dark"), (1440, "light"), (1440, "dark")])
def test_nothing_serious_for_axe(open_page, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page = open_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    settled(page, page.locator("#pareto-plot"))
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for tab in ("Matrix", "All cells"):
        page.get_by_role("tab", name=tab).click()
        found = axe.Axe().run(page, options={"preload": False}).response["violations"]
        serious = [(v["id"], [n["html"][:120] for n in v["nodes"][:3]]) for v in found if v["impact"] in ("serious", "critical")]
        assert serious == []


def test_numbers_read_as_in_the_tables(open_page):
    """Two implementations, one way to write a figure."""
    page = open_page()
    random = np.random.default_rng(1)
    values = [
        0.0,
        -0.0,
        1e-7,
        99.96,
        1234.6,
        -0.5,
        1e-3,
        99999.0,
        123456.0,
        *(10 ** random.uniform(-9, 7, 200) * random.choice([-1, 1], 200)),
    ]
    for unit in ("", "%", "dB"):
        said = page.evaluate("([values, unit]) => values.map((v) => scores.number(v, unit))", [values, unit])
        assert said == [number(v, unit) for v in values]
        ends = [{"low": v, "high": v + abs(v) * w} for v, w in zip(values, random.uniform(0, 2, len(values)), strict=True)]
        ends += [{"low": None, "high": 1.0}, {"low": 2.0, "high": None}]
        said = page.evaluate("([ends, unit]) => ends.map((e) => scores.interval(e, unit))", [ends, unit])
        assert said == [interval({"ci95": [e["low"], e["high"]]}, unit) for e in ends]


def test_three_hundred_cells_are_usable_within_a_second(open_page, tmp_path):
    metrics = [name for name, *_ in report.METRICS]
    numbers = np.random.default_rng(0).uniform(0.01, 0.9, (300, len(metrics), 2))
    cells = []
    for k, rows in enumerate(numbers):
        one = scored(f"scene {k % 12}", f"technique-{k % 25}", "office", 0.1, exponent=10 + k // 25, reference=f"r{k % 12}")
        scores = {n: {"value": v, "ci95": [v * 0.98765, v * 1.0123]} for n, (v, _) in zip(metrics, rows, strict=True)}
        one["metrics"] = scores | {
            f"{n}_full": {"value": w, "ci95": [w * 0.9, w * 1.1]} for n, (_, w) in zip(metrics, rows, strict=True)
        }
        regional = {n: scores[n] for n in ("mse", "rmse", "rel_rmse", "relmse", "mae", "smape", "bias", "rel_bias")}
        one["regions"] = {
            r: {"pixels": 5, "share": scores["mse"], "metrics": regional}
            for r in ("grazing", "silhouette", "highlight", "face-edge", "face-corner", "face-centre")
        }
        one["ledger"] = []
        cells.append(one)
    report.write({"schema": "evalsuite.results/1", "cells": cells, "host": {}}, tmp_path)
    started = time.perf_counter()
    page = open_page(where=tmp_path)
    page.wait_for_selector("#matrix td[data-value]")
    assert page.locator("#matrix td[data-value]").count() >= 100
    loaded = time.perf_counter() - started
    spent = page.evaluate("() => { const e = performance.getEntriesByType('navigation')[0]; return e.domContentLoadedEventEnd; }")
    assert spent < 1000 and loaded < 3, (spent, loaded)
    for name in metrics:  # every kind of scale
        page.select_option("#metric", name)
        assert "NaN" not in page.locator("#legend").inner_html() + page.locator("#matrix").inner_html()
        assert len(set(page.locator("#matrix td[data-value]").evaluate_all("all => all.map((e) => e.style.background)"))) > 20
    files = [tmp_path / "index.html", *(f for f in (tmp_path / "static").iterdir() if f.name not in ("flipbook.js", "cell.js"))]
    assert sum(f.stat().st_size for f in files) < 3e6
