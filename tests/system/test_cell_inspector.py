"""What a cell's page says of a pixel, and how it draws its errors' distribution, its curves and its environment."""

from __future__ import annotations

import io

import imageio.v3 as iio
import numpy as np
import pytest
from cell_pages import LIGHT, SIZE, browser, marks, open_cell, original, report_folder, where_is  # noqa: F401
from scipy.special import ndtr

from evalsuite.compare import regions

pytestmark = marks
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def table(page):
    """Channel → texts of its row."""
    rows = page.locator(".inspector tbody tr").all()
    return {row.locator("th").inner_text(): row.locator("td").all_text_contents() for row in rows}


def parsed(text):
    return [float(part.replace("−", "-").replace("+", "")) for part in text.split(" ± ")]


def check(page, report_folder, x, y):  # noqa: F811
    """All numbers of a pixel against the EXRs. Radiance is rounded to what the page says, which is less than the noise."""
    step, soft = page.evaluate("inspector.rounding")
    assert page.locator(".kept").inner_text().startswith(f"±{50 * step:.2g}")
    assert page.locator(".inspector input").nth(0).input_value() == str(x)
    assert page.locator(".inspector input").nth(1).input_value() == str(y)
    image, reference, sigma = (original(report_folder, n)[y, x].astype(float) for n in ("image", "reference", "standard_error"))
    found = table(page)
    assert list(found) == ["R", "G", "B", "luminance"]
    for k, (name, texts) in enumerate(found.items()):
        a, b, s = (v[k] if k < 3 else v @ WEIGHTS for v in (image, reference, sigma))
        near = step / 2 * (abs(b) + abs(a - b) + soft) + 1e-4 * b
        assert near < 0.3 * s
        assert parsed(texts[0])[0] == pytest.approx(a, abs=near), name
        assert parsed(texts[1]) == [pytest.approx(b, abs=near), pytest.approx(s, rel=0.06)]
        error, half = parsed(texts[2])
        assert error == pytest.approx(a - b, abs=2 * near) and half == pytest.approx(1.96 * s, rel=0.06)
        assert parsed(texts[3])[0] == pytest.approx(abs(error) / s, rel=0.06, abs=0.05)
        digits = texts[0].replace("−", "").replace(".", "").lstrip("0")
        assert len(digits) == 4, "four significant digits"


def test_numbers_are_those_of_the_files(open_cell, report_folder):  # noqa: F811
    page = open_cell()
    for x, y in ((30, 40), (60, 50), (2, 3), (93, 92)):
        page.mouse.click(*where_is(page, x, y))
        page.mouse.move(5, 5)
        check(page, report_folder, x, y)
    page.mouse.move(*where_is(page, 20, 55))
    check(page, report_folder, 20, 55)
    page.mouse.move(5, 5)
    check(page, report_folder, 93, 92), "back at the one that was clicked"
    page.keyboard.press("Shift+ArrowLeft")
    page.keyboard.press("Shift+ArrowUp")
    check(page, report_folder, 92, 91)
    page.locator(".inspector input").first.fill("17")
    page.keyboard.press("Tab")
    check(page, report_folder, 17, 91)
    page.locator(".inspector input").first.fill("1000")
    page.keyboard.press("Enter")
    check(page, report_folder, SIZE - 1, 91)


def test_the_frame_stands_about_the_pixel(open_cell):  # noqa: F811
    page = open_cell(address="#?pixel=30,40")
    x, y = where_is(page, 30, 40)
    box = page.locator(".pixel-mark").bounding_box()
    assert (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2) == (pytest.approx(x, abs=1), pytest.approx(y, abs=1))
    clip = {"x": x - 30, "y": y - 30, "width": 60, "height": 60}
    shot = iio.imread(io.BytesIO(page.screenshot(clip=clip)))[..., :3].astype(int)
    assert (np.abs(shot - [255, 225, 77]).max(-1) < 30).sum() > 20, "in yellow"


def test_regions_are_named(open_cell, report_folder):  # noqa: F811
    page = open_cell()
    sets = original(report_folder, "regions").astype(int)
    mask = original(report_folder, "mask") > 0.5
    several = np.argwhere([[bin(int(v) & 511).count("1") > 1 for v in row] for row in sets])
    for y, x in (several[0], several[len(several) // 2]):
        page.evaluate("([x, y]) => view.set({ pixel: `${x},${y}` })", [int(x), int(y)])
        expected = [name for k, name in enumerate(regions.ORDER) if sets[y, x] >> k & 1]
        assert len(expected) > 1 and page.locator(".places").inner_text() == ", ".join(expected)
    y, x = np.argwhere(~mask)[0]
    page.evaluate("([x, y]) => view.set({ pixel: `${x},${y}` })", [int(x), int(y)])
    assert page.locator(".places").inner_text() == "not on the scored object"


def test_a_finger_chooses(open_cell, report_folder):  # noqa: F811
    page = open_cell(viewport={"width": 390, "height": 800}, has_touch=True, is_mobile=True)
    page.evaluate("book.frame().scrollIntoView({ block: 'center' })")
    page.touchscreen.tap(*where_is(page, 40, 30))
    check(page, report_folder, 40, 30)


def relative(report_folder, index=1):  # noqa: F811
    image, reference, sigma = (original(report_folder, n, index).astype(float) for n in ("image", "reference", "standard_error"))
    mask = original(report_folder, "mask", index) > 0.5
    below = np.maximum(reference @ WEIGHTS, 0) + 0.01 * reference[mask].mean()
    return (image @ WEIGHTS - reference @ WEIGHTS) / below, sigma @ WEIGHTS / below, mask


@pytest.mark.parametrize("region", ["the whole object", "grazing"])
def test_the_histogram_counts_the_pixels_errors(open_cell, report_folder, region):  # noqa: F811
    page = open_cell()
    page.locator("#histogram").scroll_into_view_if_needed()
    if region == "grazing":
        page.select_option("#histogram-region", label="grazing")
        assert "region=grazing" in page.url
    wanted = 0 if region == "the whole object" else regions.ORDER.index(region) + 1
    page.wait_for_function("n => histogram.drawn?.region === n", arg=wanted)
    drawn = page.evaluate("histogram.drawn")
    error, noise, mask = relative(report_folder)
    if region == "grazing":
        mask &= (original(report_folder, "regions").astype(int) >> regions.ORDER.index(region) & 1) > 0
        assert mask.sum() == report_folder[1]["cells"][1]["regions"]["grazing"]["pixels"]
    counts, _ = np.histogram(error[mask], drawn["edges"])
    np.testing.assert_allclose(np.cumsum(drawn["errors"]), np.cumsum(counts) / mask.sum(), atol=0.02)
    assert sum(drawn["errors"]) + sum(drawn["out"]) == pytest.approx(1.0)
    edges = np.array(drawn["edges"])[:, None]
    alone = np.diff(ndtr(edges / noise[mask]), axis=0).mean(1)
    np.testing.assert_allclose(drawn["noise"], alone, atol=2e-3)
    surely = 100 * np.mean(np.abs(error[mask]) > 1.96 * noise[mask])
    said = page.locator("#histogram-says").inner_text()
    assert f"{mask.sum()} pixels" in said and abs(float(said.split("; ")[1].split(" %")[0]) - surely) < 1.5


def colours_of(page, selector, colour, tolerance=12):
    """(row, column) of a plot's pixels of one colour, and the plot's size, once it is drawn."""
    page.locator(selector).scroll_into_view_if_needed()
    page.wait_for_selector(f"{selector} .bk-Figure, {selector} > div")
    for _ in range(30):
        page.wait_for_timeout(300)
        shot = iio.imread(io.BytesIO(page.locator(selector).screenshot()))[..., :3].astype(int)
        found = np.argwhere(np.abs(shot - colour).max(-1) < tolerance)
        if len(found) > 100:
            return found, shot.shape
    pytest.fail(f"nothing of the colour {colour} in {selector}")


def test_plots_are_drawn(open_cell, report_folder):  # noqa: F811
    page = open_cell()
    more, less = [217, 119, 43], [59, 142, 208]
    bars, (_, width, _) = colours_of(page, '[data-figure="ledger"]', more)
    lengths = np.array([np.ptp(bars[bars[:, 0] == row, 1]) for row in np.unique(bars[:, 0])])
    long, short = lengths.max(), np.median(lengths[lengths < lengths.max() / 2])  # but for the row of the interval's line
    assert long / short == pytest.approx(3.0, rel=0.05), "75 % and 25 %"
    assert long > 0.4 * width
    for name in ("n_dot_v", "face_angle"):
        rmse, _ = colours_of(page, f'[data-figure="{name}"]', more)
        bias, _ = colours_of(page, f'[data-figure="{name}"]', less)
        assert np.median(rmse[:, 0]) < np.median(bias[:, 0]), "the picture is darker on the whole, so its bias lies below"
    blue, _ = colours_of(page, "#histogram", [98, 164, 215], 40)
    orange, _ = colours_of(page, "#histogram", [225, 146, 86], 40)
    assert np.median(blue[:, 1]) < np.median(orange[:, 1]), "too dark is left of too bright"


def test_the_environment_has_its_light(open_cell):  # noqa: F811
    page = open_cell()
    image = page.locator(".environment .map")
    image.scroll_into_view_if_needed()
    page.wait_for_timeout(400)
    shot = iio.imread(io.BytesIO(image.screenshot()))[..., :3].astype(int)
    height, width = shot.shape[:2]
    above = shot[: height // 3, : width // 4].mean((0, 1))
    assert above[2] > above[0] + 50, "blue above"
    assert np.ptp(shot[3 * height // 4, : width // 2].mean(0)) < 10, "grey below"
    found = np.argwhere(np.abs(shot - [240, 228, 66]).max(-1) < 40)
    u = np.arctan2(LIGHT["direction"][0], -LIGHT["direction"][2]) / (2 * np.pi) % 1.0
    centre, radius = np.array([0.5 * height, u * width]), LIGHT["angular_radius_deg"] / 180 * height
    away = np.linalg.norm(found - centre, axis=1)
    ring = np.abs(away - radius) < 4
    assert ring.sum() > 60 and ring.mean() > 0.6, "the rest is its number"
    assert page.locator(".environment .scale").is_visible() and "40" in page.locator(".environment").inner_text()


def test_the_command_can_be_copied(open_cell, report_folder):  # noqa: F811
    page = open_cell(permissions=[])
    page.locator(".copy").click()
    page.wait_for_function("['Copied', 'Selected'].includes(document.querySelector('.copy').textContent)")
    if page.locator(".copy").inner_text() == "Selected":
        assert page.evaluate("String(getSelection())").strip() == report_folder[1]["cells"][1]["reproduce"]
