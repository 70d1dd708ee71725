"""The viewer of a cell's page: flipping, exposure, false colour, zoom, swipe; judged by what is on the screen."""

from __future__ import annotations

import io

import imageio.v3 as iio
import numpy as np
import pytest
from cell_pages import SIZE, browser, decoded, encoded, marks, open_cell, original, report_folder, sampled, screen, where_is  # noqa: F401

from evalsuite.compare import regions
from evalsuite.report import scales
from evalsuite.store.results import slug

pytestmark = marks
NAMES = ("image", "reference", "target-direct", "error", "relative", "zscore", "flip", "rung-0", "rung-1", "regions")


@pytest.fixture(scope="module")
def ev(report_folder):  # noqa: F811
    return round(float(np.log2(report_folder[1]["cells"][1]["exposure"])), 3)


def radiance(report_folder, name, ev):  # noqa: F811
    return encoded(2.0**ev * original(report_folder, name))


def close(found, wanted, tolerance=0.02):
    return np.median(np.abs(found - wanted)) < tolerance and np.mean(np.abs(found - wanted).max(-1) > 0.06) < 0.06


def test_keys_flip_between_the_pictures(open_cell, report_folder, ev):  # noqa: F811
    page = open_cell()
    pictures = {}
    for index, name in enumerate(NAMES):
        page.keyboard.press(str((index + 1) % 10))  # 0 is the tenth
        pictures[name] = screen(page)
        assert page.locator(".strip button[aria-pressed=true]").get_attribute("data-index") == str(index)
    assert all(np.abs(pictures[a] - pictures[b]).mean() > 1e-3 for a in NAMES for b in NAMES if a < b)
    for name in ("image", "reference", "target-direct"):
        x, y, colours = sampled(pictures[name])
        assert close(colours, radiance(report_folder, name, ev)[y, x]), name
    x, y, colours = sampled(pictures["regions"])
    numbers = regions.first(original(report_folder, "regions"))
    assert (numbers[y, x] == regions.OUTLINE).sum() > 50 < (numbers[y, x] == 1).sum() + (numbers[y, x] == 6).sum()
    off = np.abs(colours - scales.regions(()).colours(numbers)[y, x]).max(-1)
    assert np.mean(off > 0.03) < 0.005
    page.keyboard.press("ArrowRight")
    np.testing.assert_array_equal(screen(page), pictures["image"], "after the last comes the first")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    np.testing.assert_array_equal(screen(page), pictures["rung-1"])
    page.locator("#ev").focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("book.selected") == 8, "keys that a field wants for itself do not flip"


def test_one_stop_doubles_all_radiance(open_cell, report_folder, ev):  # noqa: F811
    page = open_cell(address=f"#?ev={ev - 2}")
    before = {}
    for key, name in (("1", "image"), ("2", "reference"), ("4", "error")):
        page.keyboard.press(key)
        before[name] = screen(page)
    legend = page.locator(".viewer-scale .ticks span").all_inner_texts()
    page.locator("button[name=brighter]").click()
    page.keyboard.press("e")
    assert float(page.input_value("#ev")) == pytest.approx(ev - 1, abs=0.01)
    for key, name in (("1", "image"), ("2", "reference")):
        page.keyboard.press(key)
        _, _, dark = sampled(before[name])
        _, _, bright = sampled(screen(page))
        dark, bright = decoded(dark), decoded(bright)
        use = (bright > 0.1) & (bright < 0.95)
        assert use.sum() > 3000 and np.median(bright[use] / dark[use]) == pytest.approx(2.0, rel=0.02)
        assert np.abs(bright[use] / dark[use] - 2.0).max() < 0.2, "8 bits a channel allow no more"
    page.keyboard.press("4")
    x, y, colours = sampled(screen(page))
    ends = page.locator(".viewer-scale .ticks span").all_inner_texts()
    limit = float(ends[-1].removeprefix("+"))
    assert limit == pytest.approx(float(legend[-1].removeprefix("+")) / 2, rel=0.01), "the scale says so"
    wanted = scales.diverging(limit, "").colours(original(report_folder, "error").mean(-1))
    assert close(colours, wanted[y, x])
    page.keyboard.press("Shift+E")
    assert float(page.input_value("#ev")) == pytest.approx(ev - 1.5, abs=0.01)


def test_false_colour_is_that_of_its_scale(open_cell, report_folder, ev):  # noqa: F811
    page = open_cell()
    page.locator("#colours").check()
    x, y, colours = sampled(screen(page))
    luminance = original(report_folder, "image") @ [0.2126, 0.7152, 0.0722]
    wanted = scales.false_colour().colours(np.log2(luminance * 2.0**ev))
    assert close(colours, wanted[y, x])
    texts = page.locator(".viewer-scale .ticks span").all_inner_texts()
    assert [float(t) for t in texts] == pytest.approx([2.0 ** (stops - ev) for stops in (-8, -4, 0, 4)], rel=0.01)
    page.keyboard.press("f")
    _, _, plain = sampled(screen(page))
    assert not page.is_checked("#colours") and close(plain, radiance(report_folder, "image", ev)[y, x])


def test_the_swipe_shows_two_pictures(open_cell, report_folder, ev):  # noqa: F811
    page = open_cell()
    halves = {}
    for key, name in (("2", "reference"), ("1", "image")):
        page.keyboard.press(key)
        halves[name] = screen(page)
    page.keyboard.press("s")
    middle = halves["image"].shape[1] // 2

    def holds(split, left, right):
        found = screen(page)[60:-60]
        at = round(split * found.shape[1])
        np.testing.assert_array_equal(found[:, : at - 15], left[60:-60, : at - 15])
        np.testing.assert_array_equal(found[:, at + 15 :], right[60:-60, at + 15 :])
        assert not np.array_equal(left[60:-60, middle : middle + 200], right[60:-60, middle : middle + 200])

    holds(0.5, halves["image"], halves["reference"])
    for _ in range(5):
        page.keyboard.press("[")
    holds(0.4, halves["image"], halves["reference"])
    page.locator("#split").focus()
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    holds(0.6, halves["image"], halves["reference"])
    assert page.evaluate("book.selected") == 0, "arrows on the slider move the slider"
    # The line itself, by the pointer.
    line = page.locator(".split").bounding_box()
    frame = page.evaluate("(() => { const b = book.frame().getBoundingClientRect(); return [b.x, b.width]; })()")
    page.mouse.move(line["x"] + line["width"] / 2, line["y"] + 300)
    page.mouse.down()
    page.mouse.move(frame[0] + 0.3 * frame[1], line["y"] + 310, steps=4)
    page.mouse.up()
    page.mouse.move(5, 5)
    holds(0.3, halves["image"], halves["reference"])
    # Any two: what is shown on the left, what is chosen on the right; exposure in step.
    page.select_option("#swipe", "target-direct")
    page.keyboard.press("2")
    page.locator("h1").click()
    page.keyboard.press("e")
    found = screen(page)
    x, y, colours = sampled(found)
    column = (x + 0.5 - 48) * min(found.shape[:2]) / 96 + found.shape[1] / 2
    for name, use in (("reference", column < 0.3 * found.shape[1] - 15), ("target-direct", column > 0.3 * found.shape[1] + 15)):
        assert use.sum() > 500 and close(colours[use], radiance(report_folder, name, ev + 0.5)[y[use], x[use]])
    page.keyboard.press("s")
    assert page.locator(".split").is_hidden() and page.locator("#split").is_disabled()


def test_zoom_shows_what_geometry_says(open_cell, report_folder, ev):  # noqa: F811
    page = open_cell(address="#?zoom=3&at=0.4,0.55")
    x, y, colours = sampled(screen(page), 3.0, (0.4, 0.55))
    assert 500 < len(x) < 3000 and close(colours, radiance(report_folder, "image", ev)[y, x])
    page.keyboard.press("-")
    _, _, colours = sampled(screen(page), 2.4, (0.4, 0.55))
    x, y, _ = sampled(screen(page), 2.4, (0.4, 0.55))
    assert close(colours, radiance(report_folder, "image", ev)[y, x])
    page.locator("button[name=fit]").click()
    x, y, colours = sampled(screen(page))
    assert len(x) > 6000 and close(colours, radiance(report_folder, "image", ev)[y, x])
    # About the chosen pixel, which stays where it is; and by Ctrl and the wheel, and a drag.
    page.mouse.click(*where_is(page, 30, 40))
    place = page.locator(".pixel-mark").bounding_box()
    page.locator("button[name=nearer]").click()
    screen(page)
    moved = page.locator(".pixel-mark").bounding_box()
    assert moved["width"] == pytest.approx(1.25 * place["width"], rel=0.02)
    assert moved["x"] + moved["width"] / 2 == pytest.approx(place["x"] + place["width"] / 2, abs=1.5)
    page.mouse.move(*where_is(page, 48, 48))
    page.keyboard.down("Control")
    page.mouse.wheel(0, -100)
    page.keyboard.up("Control")
    before = page.evaluate("book.view()")
    assert before["zoom"] > 1.5
    page.mouse.down()
    page.mouse.move(*[c + 60 for c in where_is(page, 48, 48)], steps=6)
    page.mouse.up()
    after = page.evaluate("book.view()")
    assert after["x"] < before["x"] - 0.02 and after["zoom"] == pytest.approx(before["zoom"])
    page.keyboard.press("r")
    x, y, colours = sampled(screen(page))
    assert close(colours, radiance(report_folder, "image", ev)[y, x])


def test_keys_are_listed(open_cell):  # noqa: F811
    page = open_cell(viewport={"width": 600, "height": 900})
    assert not page.locator(".keys dl").is_visible()
    page.keyboard.press("?")
    assert page.locator(".keys dl").is_visible() and "half a stop" in page.locator(".keys").inner_text()


NO_WEBGL = """const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return /webgl/.test(kind) ? null : get.call(this, kind, ...rest);
};"""


def test_without_webgl_the_previews_stand_in(browser, report_folder):  # noqa: F811
    directory, results = report_folder
    name = slug(results["cells"][1]["id"])
    page = browser.new_page(viewport={"width": 1440, "height": 1000})
    page.add_init_script(NO_WEBGL)
    page.goto((directory / "cells" / f"{name}.html").as_uri())
    for index in (1, 3, 0):
        page.locator(".strip button").nth(index).click()
        assert page.locator(".strip button[aria-pressed=true]").get_attribute("data-index") == str(index)
        page.locator(".still").evaluate("still => still.decode()")
        shot = iio.imread(io.BytesIO(page.locator(".still").screenshot()))[..., :3] / 255
        height, width = shot.shape[:2]
        middles = ((np.arange(SIZE) + 0.5 - SIZE / 2) * min(width, height) / SIZE).astype(int)
        seen = shot[np.ix_(height // 2 + middles, width // 2 + middles)]
        wanted = iio.imread(directory / "cells" / name / f"{NAMES[index]}.webp")[..., :3] / 255
        assert np.median(np.abs(seen - wanted)) < 0.01 and np.mean(np.abs(seen - wanted).max(-1) > 0.1) < 0.05
    assert "no WebGL 2" in page.locator(".loading").inner_text() and page.locator(".tools").is_hidden()
    page.close()
