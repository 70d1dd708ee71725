"""A cell's view in its address: restored elsewhere, carried to the next cell, safe against nonsense."""

from __future__ import annotations

import numpy as np
import pytest
from cell_pages import browser, marks, open_cell, ready, report_folder, sampled, screen, where_is  # noqa: F401

from evalsuite.store.results import slug

pytestmark = marks


def test_an_address_shows_the_same_elsewhere(open_cell):  # noqa: F811
    page = open_cell()
    before = screen(page)
    page.keyboard.press("4")
    page.keyboard.press("E")
    page.keyboard.press("s")
    page.keyboard.press("[")
    page.mouse.click(*where_is(page, 30, 40))
    for _ in range(3):
        page.locator("button[name=nearer]").click()
    page.mouse.move(5, 5)
    page.select_option("#histogram-region", label="grazing")
    shown, address = screen(page), page.url
    assert np.abs(shown - before).mean() > 0.05
    for word in ("picture=error", "ev=", "swipe=reference", "split=48", "pixel=30%2C40", "zoom=1.95", "at=", "region=grazing"):
        assert word in address, word
    other = open_cell(address="#" + address.split("#")[1])
    np.testing.assert_array_equal(screen(other), shown)
    assert other.locator(".inspector").inner_text() == page.locator(".inspector").inner_text()
    assert other.input_value("#histogram-region") == page.input_value("#histogram-region") != "0"
    assert other.url.split("#")[1] == address.split("#")[1], "what is restored is not rewritten"
    # Pasted into a page that is open already, and taken away again.
    other.evaluate("location.hash = '#?picture=flip'")
    other.wait_for_selector(".strip figure:nth-child(7) button[aria-pressed=true]")
    other.evaluate("location.hash = ''")
    np.testing.assert_array_equal(screen(other), before)


def test_the_usual_view_leaves_no_address(open_cell):  # noqa: F811
    page = open_cell()
    page.keyboard.press("3")
    page.keyboard.press("+")
    screen(page)
    assert "#?" in page.url
    page.keyboard.press("r")
    page.keyboard.press("1")
    screen(page)
    assert "#" not in page.url


@pytest.mark.parametrize("storage", [True, False])
def test_the_next_cell_is_seen_alike(open_cell, report_folder, storage):  # noqa: F811
    page = open_cell(index=0)
    if not storage:
        page.add_init_script("Object.defineProperty(window, 'sessionStorage', { get() { throw new Error('forbidden'); } })")
        page.reload()
        ready(page)
    page.keyboard.press("2")
    page.evaluate("book.look({ zoom: 2.5, x: 0.45, y: 0.6 })")
    page.fill("#ev", "-1")
    page.keyboard.press("Enter")
    page.mouse.click(*where_is(page, 40, 50))
    page.mouse.move(5, 5)
    screen(page)
    place = page.evaluate("[book.view(), book.selected]")
    page.locator("h1").click()
    page.keyboard.press("n")
    page.wait_for_function("slug => document.querySelector('.cell')?.id === slug", arg=slug(report_folder[1]["cells"][1]["id"]))
    ready(page)
    found = page.evaluate("[book.view(), book.selected, document.getElementById('ev').value, view.get('pixel')]")
    assert [found[0][k] for k in "xy"] == [pytest.approx(place[0][k], abs=1e-3) for k in "xy"] and found[1:] == [1, "-1", ""]
    assert found[0]["zoom"] == pytest.approx(2.5, rel=1e-3)
    # Without storage, order and view must come from the links alone; the same pixels, as both references show the same sphere.
    there = {(x, y): colour for x, y, colour in zip(*sampled(screen(page), 2.5, (0.45, 0.6)), strict=True)}
    page.keyboard.press("p")
    page.wait_for_function("slug => document.querySelector('.cell')?.id === slug", arg=slug(report_folder[1]["cells"][0]["id"]))
    ready(page)
    here = {(x, y): colour for x, y, colour in zip(*sampled(screen(page), 2.5, (0.45, 0.6)), strict=True)}
    both = [pixel for pixel in here if pixel in there]
    assert len(both) > 500 and np.mean([np.abs(there[pixel] - here[pixel]) for pixel in both]) < 0.03


NONSENSE = (
    "#?zoom=abc&at=x&pixel=9999,-3&picture=%3Cscript%3E&split=foo&ev=zzz&swipe=nothing&region=none&colours=maybe",
    "#?zoom=1e12&at=1e9,-1e9&pixel=1.5,a&ev=1e400&split=-40&swipe=reference",
    "#?" + "&".join(f"picture=image{k}" for k in range(300)),
)


@pytest.mark.parametrize("address", NONSENSE)
def test_nonsense_is_survived(open_cell, address):  # noqa: F811
    page = open_cell(address=address)
    screen(page)
    page.keyboard.press("r")
    if not page.evaluate("document.querySelector('.split').hidden"):
        page.keyboard.press("s")
    assert len(sampled(screen(page))[0]) > 6000 and page.evaluate("book.selected") == 0
    assert page.locator(".inspector tbody tr").count() == 4
