"""Cells' pages opened from disk in a headless Chromium, and what stands on their screen."""

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
from evalsuite.image.rounding import significant
from evalsuite.report import page as report
from evalsuite.store.results import slug

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "report"))
import synthetic_results as synthetic

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
marks = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
SIZE = 96
LIGHT = {"direction": [0.6, 0.0, 0.8], "angular_radius_deg": 12.0, "solid_angle": 0.137, "radiance": [9.0, 8.0, 7.0],
         "irradiance": [1.2, 1.1, 1.0], "share": 0.4}  # fmt: skip


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        )
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def report_folder(tmp_path_factory):
    """A report of seven cells, the second with all that a cell can have; (folder, results)."""
    directory = tmp_path_factory.mktemp("cells é")
    results = synthetic.results(directory)
    _complete(directory, results["cells"][1])
    (directory / "results.json").write_text(json.dumps(results), encoding="utf-8")
    report.write(results, directory)
    return directory, results


def _complete(directory: Path, cell: dict) -> None:
    """A ledger with another truth and a rung, and an environment with a light."""
    folder = f"images/{slug(cell['id'])}"
    reference = exr.read(directory / cell["images"]["reference"])
    image = exr.read(directory / cell["images"]["image"])
    rung = {"value": 1.0, "ci95": [1.0, 1.0], "rel_rmse": {"value": 0.1, "ci95": [0.09, 0.11]},
            "rel_bias": {"value": 0.0, "ci95": [-0.01, 0.01]}}  # fmt: skip
    cell["ledger"] = [
        {"rung": "visibility", "from": "unoccluded", "to": "direct", "fraction": 0.75, "fraction_ci95": [0.7, 0.8], **rung},
        {"rung": "lobe", "from": "direct", "to": "image", "fraction": 0.25, "fraction_ci95": [0.2, 0.3],
         "other_order": {"fraction": 0.2}, **rung},
    ]  # fmt: skip
    cell |= {"ledger_total": 1.0, "ledger_closure": 0.0, "truths": {"direct": "0123456789abcdef"}}
    cell |= {"environment_id": "fedcba9876543210", "lights": [LIGHT]}
    environment = np.full((64, 128, 3), 0.2)
    environment[:32] = [0.1, 0.2, 0.6]
    pictures = {"target-direct": 0.5 * reference, "rung-0": (0.5 * reference - reference).mean(2),
                "rung-1": (image - 0.5 * reference).mean(2), "environment": environment}  # fmt: skip
    for name, picture in pictures.items():
        exr.write(directory / folder / f"{name}.exr", significant(picture, 14))
        cell["images"][name] = f"{folder}/{name}.exr"


@pytest.fixture
def open_cell(browser, report_folder):
    """open_cell(index, address, **context) → page whose viewer has drawn; at the end no error was logged and nothing but local
    files was asked for."""
    directory, results = report_folder
    contexts, problems, requests = [], [], []

    def open_it(index: int = 1, address: str = "", **options):
        context = browser.new_context(**{"viewport": {"width": 1440, "height": 1000}, **options})
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(15_000)
        page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto((directory / "cells" / f"{slug(results['cells'][index]['id'])}.html").as_uri() + address)
        ready(page)
        return page

    yield open_it
    assert problems == [], problems
    remote = [url for url in requests if not url.startswith(("file:", "data:", "blob:"))]
    assert remote == [], remote
    for context in contexts:
        context.close()


def ready(page) -> None:
    page.wait_for_selector(".tools:not([hidden])")
    screen(page)


def original(report_folder, name: str, index: int = 1) -> np.ndarray:
    """A cell's picture as its EXR has it."""
    directory, results = report_folder
    return next(iter(exr.read_parts(directory / results["cells"][index]["images"][name]).values()))


def screen(page) -> np.ndarray:
    """What the viewer's frame shows once it has come to rest, (H, W, 3) in [0, 1]. FlipBook draws within 100 ms of a change."""
    page.evaluate("book.frame().scrollIntoView({ block: 'center' })")
    box = page.evaluate(
        "(() => { const b = book.frame().getBoundingClientRect(); return [b.x + scrollX, b.y + scrollY, b.width, b.height]; })()"
    )
    before = None
    for _ in range(40):
        page.wait_for_timeout(220)
        x, y = box[0] - page.evaluate("scrollX"), box[1] - page.evaluate("scrollY")
        shot = page.screenshot(clip={"x": x, "y": y, "width": box[2], "height": box[3]})
        now = iio.imread(io.BytesIO(shot))[..., :3] / 255
        if before is not None and np.array_equal(now, before) and now.std() > 0.01:
            return now
        before = now
    pytest.fail("the viewer stays empty or never settles")


def sampled(shown: np.ndarray, zoom: float = 1.0, at: tuple[float, float] = (0.5, 0.5)) -> tuple[np.ndarray, ...]:
    """Colours of the picture's pixels that lie in the frame, by geometry alone: (their x, their y, colours (N, 3)). Pixels of the
    frame's rim, where buttons and labels are, are left out."""
    height, width = shown.shape[:2]
    scale = zoom * min(width, height) / SIZE
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    sx = ((x + 0.5 - at[0] * SIZE) * scale + width / 2).astype(int)
    sy = ((y + 0.5 - at[1] * SIZE) * scale + height / 2).astype(int)
    inside = (sx > 4) & (sy > 60) & (sx < width - 4) & (sy < height - 60)
    return x[inside], y[inside], shown[sy[inside], sx[inside]]


def where_is(page, x: int, y: int) -> tuple[float, float]:
    """Where a pixel of the whole, fitted picture is on the screen."""
    box = page.evaluate("(() => { const b = book.frame().getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()")
    scale = min(box[2], box[3]) / SIZE
    return box[0] + box[2] / 2 + (x + 0.5 - SIZE / 2) * scale, box[1] + box[3] / 2 + (y + 0.5 - SIZE / 2) * scale


def decoded(encoded: np.ndarray) -> np.ndarray:
    """Linear from sRGB."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encoded(linear: np.ndarray) -> np.ndarray:
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
