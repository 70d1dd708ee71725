"""The page from a server, as a single file, and with names that want to be more than text, in a headless Chromium."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
import threading
from collections import Counter
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.report import page as report
from evalsuite.report import serving, single
from evalsuite.store.results import slug

sys.path.insert(0, str(Path(__file__).resolve().parent))
from test_page_browser import browser, canvas, folder, open_cell, pytestmark, synthetic  # noqa: F401

BAD = "window.pwned=1"
NAMES = [
    f"<script>{BAD}</script>", f"</title></style></script><script>{BAD}</script>", f"<img src=x onerror={BAD}>",
    f"\"><svg onload='{BAD}'>", f"' onmouseover='{BAD}' autofocus onfocus='{BAD}", "../../../outside", "..", "/etc/passwd",
    f"javascript:{BAD}", "{{ 7 * 7 }}{% raw %}", "é 漢字 \U0001f4a5 \u202etxt", "a\nb\tc", f"<!--<script>{BAD}", "\\..\\x",
    "x" * 300, "&lt;b&gt;",
]  # fmt: skip


@pytest.fixture
def tab(browser):  # noqa: F811
    """A tab of a browser of its own: no dialog, no error, and what it asked for."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    tab = context.new_page()
    tab.set_default_timeout(15_000)
    tab.problems, tab.requests = [], []
    tab.on("dialog", lambda dialog: (tab.problems.append(f"dialog {dialog.message}"), dialog.dismiss()))
    tab.on("console", lambda message: tab.problems.append(message.text) if message.type == "error" else None)
    tab.on("pageerror", lambda error: tab.problems.append(str(error)))
    tab.on("request", lambda request: tab.requests.append(request.url))
    yield tab
    assert tab.problems == [] and tab.evaluate("window.pwned") is None
    context.close()


def drawn(tab):
    """Wait until FlipBook has drawn every picture; the reference, once it has come to rest."""
    # Counted in the page: counted here, the page before could still be the one that answers.
    tab.wait_for_function("""() => {
        const [buttons, canvases] = [".cell .strip button", ".cell .book canvas"].map((s) => document.querySelectorAll(s).length);
        return buttons > 0 && canvases === buttons;
    }""")
    tab.locator(".cell .strip button").nth(1).click()
    tab.wait_for_selector(".strip figure:nth-child(2) button[aria-pressed=true]")
    return canvas(tab)


def alike(a, b):
    """Whether two screenshots show the same, but for a pixel's shift by where the viewer happens to stand."""
    return a.shape == b.shape and np.abs(a - b).mean() < 0.01


def test_the_same_from_a_server(tab, folder):  # noqa: F811
    server = serving.server(folder, 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    origin = f"http://127.0.0.1:{server.server_port}/"
    try:
        tab.goto(origin + "#?view=table")
        tab.get_by_role("button", name="rel. RMSE").click()
        open_cell(tab)
        served = drawn(tab)
        name = tab.locator(".cell").get_attribute("id")
        assert tab.url == f"{origin}cells/{name}.html#?picture=reference"
        assert {url for url in tab.requests if not url.startswith((origin, "data:", "blob:"))} == set()
        tab.locator("a[rel=next]").click()
        drawn(tab)
        tab.keyboard.press("Escape")
        tab.wait_for_selector("#summary")
        assert tab.locator("th[aria-sort=ascending]").inner_text() == "rel. RMSE"
        tab.goto((folder / "cells" / f"{name}.html").as_uri())
        assert alike(drawn(tab), served)
    finally:
        server.shutdown()
        server.server_close()


def test_a_single_file_of_one_cell(tab, folder, tmp_path):  # noqa: F811
    (identity,) = single.write(folder, ["*exponent=10/*"], tmp_path / "one é.html")
    tab.goto((folder / "cells" / f"{slug(identity)}.html").as_uri())
    on_its_page = drawn(tab)
    tab.locator(".strip button").nth(2).click()
    error_on_its_page = canvas(tab)
    tab.requests.clear()
    tab.goto((tmp_path / "one é.html").as_uri())
    assert alike(drawn(tab), on_its_page)
    tab.keyboard.press("3")
    assert alike(canvas(tab), error_on_its_page) and not alike(error_on_its_page, on_its_page)
    assert len([url for url in tab.requests if not url.startswith(("data:", "blob:"))]) == 1, "the file itself"
    assert all(tab.locator(f"a[{which}]").is_hidden() for which in ("rel=prev", "rel=next", "class=back"))
    assert tab.evaluate("[...document.images].every((image) => image.complete && image.naturalWidth > 8)")
    tab.locator("#histogram").scroll_into_view_if_needed()
    tab.wait_for_timeout(2000)
    plot = iio.imread(io.BytesIO(tab.locator("#histogram").screenshot()))[..., :3].astype(int)
    assert (plot[..., 2] - plot[..., 0] > 60).sum() > 500 < (plot[..., 0] - plot[..., 2] > 60).sum(), "blue and orange bars"


def test_a_single_file_of_several_cells(tab, folder, tmp_path):  # noqa: F811
    # Beside the report itself, whose order must not lead out of the file.
    target = folder / "several.html"
    tab.goto((folder / "index.html").as_uri())
    done = single.write(folder, ["sphere/*", "torus/*", "teapot/brute*"], target)
    assert len(done) == 4
    tab.goto(target.as_uri())
    assert tab.locator("main li").all_inner_texts() == done
    tab.locator("main li a").first.click()
    drawn(tab)
    seen = [tab.locator(".cell").get_attribute("id")]
    while tab.locator("a[rel=next]").is_visible():
        tab.locator("a[rel=next]").click()
        tab.wait_for_function("slug => document.querySelector('.cell')?.id !== slug", arg=seen[-1])
        seen.append(tab.locator(".cell").get_attribute("id"))
    assert seen == [slug(identity) for identity in done]
    assert "got a dead process" in tab.locator(".verdict").inner_text(), "a cell without pictures shows why"
    tab.keyboard.press("Escape")
    tab.wait_for_selector("main li")
    after = tab.requests[tab.requests.index(target.as_uri()) :]
    assert {url.split("?")[0] for url in after if not url.startswith(("data:", "blob:"))} == {target.as_uri()}
    target.unlink()


def test_what_a_single_file_cannot_be_made_of(folder, tmp_path):  # noqa: F811
    with pytest.raises(EvalsuiteError, match="no cell of that name"):
        single.write(folder, ["nothing*"], tmp_path / "x.html")
    broken = shutil.copytree(folder, tmp_path / "broken")
    page = next((broken / "cells").glob("sphere*=10_*.html"))
    (tmp_path / "secret.txt").write_text("not for others")
    page.write_text(
        page.read_text(encoding="utf-8").replace('src="../cells', 'src="../../secret.txt" alt="../cells', 1), encoding="utf-8"
    )
    with pytest.raises(EvalsuiteError, match="out of the report"):
        single.write(broken, ["sphere*=10/*"], tmp_path / "x.html")
    page.unlink()
    with pytest.raises(EvalsuiteError, match="a file that does not read"):
        single.write(broken, ["sphere*=10/*"], tmp_path / "x.html")
    assert not (tmp_path / "x.html").exists()


def named(directory, names):
    """A report whose every free text is one of the names; the text of its first two cells and the overview."""
    results = synthetic.results(directory)
    cell = next(c for c in results["cells"] if c["status"] == "scored")
    cells = []
    for k, name in enumerate(names):
        own = json.loads(json.dumps(cell))
        own |= {
            "scene": name,
            "environment": name,
            "technique": name,
            "target": name,
            "title": name,
            "message": name,
            "scene_file": name,
        }
        own |= {
            "id": f"{k}{name}/{name}/{name}/{name}",
            "notes": [name],
            "warnings": [name],
            "reproduce": name,
            "looked_up": name,
        }
        own["parameters"] = own["all_parameters"] = {name: name, "env": name}
        own["mapping"] = [{"material": name, "plugin": name, "technique": name + "x", "text": name}]
        own["technique_info"] = {"title": name, "paper": name, "equations": name, "assumptions": [name]}
        own["fit"] = {name: name}
        interval = {"value": 0.1, "ci95": [0.0, 0.2]}
        rung = {"rung": name, "from": name, "to": name, "fraction": 0.5, "fraction_ci95": [0.4, 0.6], "rel_rmse": interval,
                "rel_bias": interval, "other_order": None}  # fmt: skip
        own |= {"ledger": [rung], "ledger_closure": 0.0, "images": own["images"] | {"rung-0": own["images"]["error"]}}
        cells.append(own)
    results |= {"cells": cells, "title": names[0], "description": names[0], "report": names[0], "host": {"cpu": names[0]}}
    (directory / "results.json").write_text(json.dumps(results), encoding="utf-8")
    report.write(results, directory)
    return results


def elements(tab):
    """How many there are of each kind, without what FlipBook makes, and boxes that can be reached by keys if a long name makes
    them scroll."""
    kind = "(e) => `${e.tagName} ${e.getAttributeNames().sort()}`"
    ours = "(e) => !e.closest('.viewer') && !e.matches('.scroll')"
    return Counter(tab.evaluate(f"[...document.querySelectorAll('body *')].filter({ours}).map({kind})"))


def settled(tab):
    """Wait until a cell's scripts have made what they make."""
    if tab.locator(".cell .viewer").count():
        tab.wait_for_selector(".tools:not([hidden])")
    tab.wait_for_timeout(100)


def test_names_stay_text_and_inside(tab, tmp_path):
    root = tmp_path / "a" / "b" / "c"
    plain, wild = root / "plain", root / "wild"
    named(plain, ["name"] * 1 + [f"name {k}" for k in range(1, len(NAMES))])
    before = set(tmp_path.rglob("*"))
    results = named(wild, NAMES)
    made = set(tmp_path.rglob("*")) - before
    assert all(path.is_relative_to(wild) for path in made)
    assert all(re.fullmatch(r"[A-Za-z0-9._=+-]+", path.name) for path in made)
    assert max(len(path.name) for path in made) < 120
    pages = []
    for directory in (plain, wild):
        cells = json.loads((directory / "results.json").read_text(encoding="utf-8"))["cells"]
        pages.append([directory / "index.html", *(directory / "cells" / f"{slug(c['id'])}.html" for c in cells)])
    for benign, hostile in zip(*pages, strict=True):
        tab.goto(benign.as_uri())
        settled(tab)
        expected = elements(tab)
        tab.goto(hostile.as_uri())
        settled(tab)
        assert elements(tab) == expected, hostile.name
    tab.goto(pages[1][0].as_uri())
    shown = tab.locator("#summary tbody tr td:nth-child(2)").all_text_contents()
    assert shown == NAMES, "as they are, to the letter"
    for index in (0, 4):
        tab.goto(pages[1][1 + index].as_uri())
        drawn(tab)
        assert NAMES[index] in tab.locator("h1").text_content() and NAMES[index] == tab.locator(".command code").text_content()
    single.write(wild, [], wild / "all.html")
    tab.goto((wild / "all.html").as_uri())
    assert tab.locator("main li").all_text_contents() == [cell["id"] for cell in results["cells"]]
    tab.locator("main li a").nth(1).click()
    drawn(tab)
    assert NAMES[1] in tab.locator("h1").text_content()
