"""What a notebook shows: whole, escaped, without scripts, and pictures that say what is so."""

from __future__ import annotations

import base64
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from evalsuite import api
from evalsuite.scene.model import SceneSource

sys.path.insert(0, str(Path(__file__).parent))
import two_runs as two


class Whole(HTMLParser):
    """Every tag is closed in order; texts and addresses are kept."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open, self.tags, self.text, self.addresses = [], set(), [], []
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.addresses += [value for name, value in attributes if name in ("src", "href")]
        if tag not in ("img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def picture(html: str) -> np.ndarray:
    (address,) = Whole(html).addresses
    return iio.imread(base64.b64decode(address.removeprefix("data:image/png;base64,"))) / 255


@pytest.fixture
def result():
    mean, sigma = two.reference(0)
    return api.compare(two.picture(0.1), mean, standard_error=sigma, mask=two.mask())


def test_comparison(result):
    html = result._repr_html_()
    found = Whole(html)
    assert found.tags <= {"div", "table", "tr", "td", "img", "p", "span"}, "no script, no style that leaks"
    text = " ".join(found.text)
    for words in ("relative RMSE", "FLIP", "95 %", "image − reference", f"{result.pixels} pixels", "no halves"):
        assert words in text
    assert re.search(r"10\.\d+ %", text) and len(html) < 50_000
    shown = picture(html)
    left, right = shown[:, 2:20].mean((0, 1)), shown[:, 28:46].mean((0, 1))
    assert left[0] > left[2] + 0.2 and right[2] > right[0] + 0.2, "red where too bright, blue where too dark"
    assert re.fullmatch(r"Comparison\(rel_rmse 0\.10\d* \[.*\], .*; \d+ pixels\)", repr(result))


def test_large_pictures_are_thinned():
    mean = np.ones((600, 900, 3)) + np.random.default_rng(0).random((600, 900, 3))
    html = api.compare(mean * 1.1, mean)._repr_html_()
    assert max(picture(html).shape) <= 256 and len(html) < 300_000


def test_a_metric_without_a_number(result):
    black = api.compare(two.picture(0.1), np.zeros_like(two.truth()))
    assert "—" in black._repr_html_() and "nan" not in black._repr_html_()
    assert "rel_rmse inf" in repr(black)


def test_reference():
    mean, sigma = (x.astype(np.float32) for x in two.reference(0))
    made = api.Reference(mean, sigma, (mean, mean), two.mask(), 256, 0.0198, True)
    text = " ".join(Whole(made._repr_html_()).text)
    assert "256 a pixel, stopped at the cap" in text and "1.98 %" in text and "48 × 48 pixels" in text and "radiance" in text
    shown = picture(made._repr_html_())
    assert shown[two.mask()].mean() > 0.5 and shown.max() == 1.0, "exposed for the object"
    assert repr(made) == "Reference(48 × 48, 256 spp, relative standard error 1.98%, stopped at the cap)"
    dark = api.Reference(0 * mean, sigma, (mean, mean), ~two.mask() & False, 32, 0.5, False)
    assert picture(dark._repr_html_()).max() == 0


def test_scene_is_escaped():
    evil = "<script>alert(1)</script>"
    handle = api.SceneHandle(SceneSource(Path("x") / f"{evil}.xml", None, (64, 32), {}, False, {"gap": "0.5"}))
    handle.bindings = {"subject": {"type": "phong", "exponent": 10.0}}
    found = Whole(handle._repr_html_())
    assert found.tags == {"div", "b"} and "64 × 32 pixels" in "".join(found.text)
    assert repr(handle) == "SceneHandle(scene script>.xml, size 64 × 32 pixels, parameters gap=0.5, bound subject: phong)"
