"""How large a report is: on disk, and until its overview can be used."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from evalsuite.report import page as report

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
import many_cells
from test_page_browser import CHROMIUM, browser  # noqa: F401

#: When the page is there and its scripts have run, how long a filter then takes to be seen [ms], and what it leaves.
USABLE = """() => {
  const [navigation] = performance.getEntriesByType("navigation");
  const [paint] = performance.getEntriesByName("first-contentful-paint");
  const started = performance.now(), field = document.getElementById("filter");
  field.value = "technique-1";
  field.dispatchEvent(new Event("input"));
  document.body.getBoundingClientRect();
  return [Math.max(navigation.domContentLoadedEventEnd, paint.startTime), performance.now() - started,
          document.getElementById("shown").textContent];
}"""


def size(paths):
    return sum(path.stat().st_size for path in paths if path.is_file())


def made(tmp_path, count):
    """A folder of that many cells, and how long its page took [s]."""
    results = many_cells.write(tmp_path / "out", tmp_path / "store", count)
    started = time.perf_counter()
    report.write(results, tmp_path / "out")
    return tmp_path / "out", time.perf_counter() - started


def test_what_a_cell_and_a_reference_cost(tmp_path):
    """Three cells of one reference, at 256²."""
    out, seconds = made(tmp_path, 3)
    shared = size(out.glob("images/references/*/*")) + size(out.glob("cells/references/*"))
    own = (size(out.glob("images/*-*/*")) + size(out.glob("cells/*-*")) + size(out.glob("cells/*-*/*"))) / 3
    assert shared < 560_000 and own < 670_000, f"{shared} bytes a reference, {own:.0f} a cell"
    assert len(list(out.glob("images/references/*"))) == len(list(out.glob("cells/references/*"))) == 1
    assert seconds < 10


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_three_hundred_cells(tmp_path, browser):  # noqa: F811
    out, _ = made(tmp_path, 300)
    assert size(out.rglob("*")) < 250e6
    times = []
    for _ in range(3):
        context = browser.new_context(viewport={"width": 1440, "height": 1000})
        page, asked = context.new_page(), []
        page.on("request", lambda request, asked=asked: asked.append(request.url))
        page.goto((out / "index.html").as_uri())
        ready, filtered, shown = page.evaluate(USABLE)
        assert shown == "100 of 300 cells"
        times.append(ready + filtered)
        page.get_by_role("tab", name="All cells").click()
        page.wait_for_timeout(1500)
        files = {Path(unquote(urlsplit(url).path)) for url in asked if url.startswith("file:")}
        assert size(files) < 3e6 and len(files) > 20
        context.close()
    assert min(times) < 1000, f"usable after {times} ms"
