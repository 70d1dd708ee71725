"""A cell's page for all: axe-core, the keyboard alone, both colour schemes, a phone."""

from __future__ import annotations

import io

import imageio.v3 as iio
import pytest
from cell_pages import browser, marks, open_cell, report_folder  # noqa: F401

pytestmark = marks


def through(page):
    """Scroll through the page, so that its plots are drawn."""
    height = page.evaluate("document.documentElement.scrollHeight")
    for y in range(0, height, 500):
        page.evaluate("y => scrollTo(0, y)", y)
        page.wait_for_timeout(120)
    page.wait_for_timeout(700)


@pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (1440, "dark"), (390, "light")])
def test_axe_finds_nothing_serious(open_cell, width, scheme):  # noqa: F811
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = open_cell(address="#?swipe=reference&pixel=30,40", viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    through(page)
    found = axe.run(page, options={"preload": False}).response["violations"]
    grave = [
        (v["id"], v["help"], n["target"], n["html"][:160])
        for v in found
        if v["impact"] in ("serious", "critical")
        for n in v["nodes"]
    ]
    assert grave == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone(open_cell, scheme):  # noqa: F811
    page = open_cell(address="#?picture=error&pixel=30,40", viewport={"width": 390, "height": 800}, color_scheme=scheme)
    through(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.evaluate("[...document.images].every((image) => image.alt)")
    for name in ("ev", "colours", "swipe", "split", "histogram-region"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= 390, name


def test_every_control_is_reached_by_tab(open_cell):  # noqa: F811
    page = open_cell(viewport={"width": 1440, "height": 900})
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("(e => e.id || e.name || e.className || e.textContent)(document.activeElement)"))
    assert {"ev", "colours", "swipe", "darker", "brighter", "nearer", "farther", "fit", "copy"} <= reached
    assert page.locator("[tabindex]:not([tabindex='0']):not([tabindex='-1'])").count() == 0


def test_plots_follow_the_colour_scheme(open_cell):  # noqa: F811
    page = open_cell()
    through(page)
    paper = {"light": [251, 251, 249], "dark": [20, 22, 23]}

    def corners():
        plots = page.locator(".plot").all()
        assert len(plots) == 4
        return [iio.imread(io.BytesIO(plot.screenshot()))[4, 4, :3].tolist() for plot in plots]

    assert corners() == [paper["light"]] * 4
    page.emulate_media(color_scheme="dark")
    page.wait_for_timeout(1500)
    assert corners() == [paper["dark"]] * 4
