"""Figures of the papers that compute more than they copy: each against a case whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.image import exr
from evalsuite.report import figures_page
from evalsuite.report.figures import beside, filtering_methods, highlights, prefiltered, rendered, seam, warping
from evalsuite.scene.builtin import environment_path


def cell(folder, name, image, truth, **more):
    """A scored cell whose pictures lie in a folder."""
    pictures = {"image": image, "reference": truth, "mask": np.ones_like(image)}
    for kind, picture in pictures.items():
        exr.write(folder / f"{name}-{kind}.exr", np.asarray(picture, np.float32))
    return {
        "id": name, "scene": "s", "technique": "t", "target": "unoccluded", "environment": "sh2", "parameters": {},
        "all_parameters": {}, "exposure": 1.0, "status": "scored", "message": "",
        "metrics": {"rel_rmse": {"value": 0.1, "ci95": [0.08, 0.12]}},
        "images": {kind: f"{name}-{kind}.exr" for kind in pictures}, **more,
    }  # fmt: skip


def test_a_view_of_its_own_needs_no_warp_and_blending_betters_each(monkeypatch):
    monkeypatch.setattr(warping, "SIZE", 32)
    monkeypatch.setattr(warping, "FACE", 16)
    found = warping.data()["measured"]
    assert found["relative_rms"] < min(found["warped_relative_rms"])
    monkeypatch.setattr(warping, "SHARES", (1.0, 0.0, 0.0))
    found = warping.data()["measured"]
    assert found["degrees_off"][0] == pytest.approx(0, abs=1e-5) and found["relative_rms"] < 1e-6
    assert found["warped_relative_rms"][1] > 0.05


def test_filtering_methods_rank_and_hardware_is_exact_where_nothing_varies(monkeypatch):
    off = filtering_methods.data()["off"]
    assert off["classic"] == 0 < off["hierarchical"] < off["hardware"] < 0.1 < 1 < off["unfiltered"]
    monkeypatch.setattr(filtering_methods, "MAP", "furnace")
    monkeypatch.setattr(
        filtering_methods, "cube", lambda name, width: type("Cube", (), {"levels": [np.ones((6, width, width, 3))]})
    )
    assert max(filtering_methods.data()["off"].values()) < 1e-4


def test_a_prefiltered_map_is_exact_at_degree_two(tmp_path):
    """sh2 holds degree 2 alone: the irradiance is smooth, and bilinear texels are off by their own second differences only."""
    pixels = np.full((48, 64, 3), 0.5)
    cells = rendered.Rendered(tmp_path, [cell(tmp_path, "a", pixels, pixels)], {}, {"sh2": environment_path("sh2")})
    data = prefiltered.data(cells, "1", "scene")
    assert 0 < data["measured"]["map_relative_rms"] < 5e-4
    assert [len(data[name]) for name in ("titles", "image", "truth", "error")] == [3] * 4
    assert all(panel.pixels.shape == (48, 64, 3) for panel in data["image"])
    sharp = prefiltered.data(cells, "400", "scene")["measured"]["map_relative_rms"]
    assert sharp > data["measured"]["map_relative_rms"]
    with pytest.raises(LookupError):
        rendered.Rendered(tmp_path, [], {}, {}).environment()


@pytest.mark.parametrize("shape", [(96, 96), (64, 96), (96, 64)])
def test_a_step_along_the_seam_is_found_there(tmp_path, shape):
    """An error that lies in the band alone, one that lies elsewhere alone, and one that lies everywhere."""
    height, width = shape
    z, hit = seam._reflected(width, height)
    there = seam.ndimage.binary_dilation(seam._crossing(z, hit), iterations=seam.BAND)
    truth = np.ones((*shape, 3))
    ratios = {}
    for ring, error in ((2.0, there), (1.0, ~there), (0.0, there | ~there)):
        made = cell(tmp_path, f"r{ring}", truth + 0.1 * error[..., None], truth, parameters={"ring": ring})
        data = seam.data(rendered.Rendered(tmp_path, [made]))
        (ratios[ring],) = data["measured"]["seam_error_over_elsewhere"].values()
        assert len(data["rows"][0]) == 5 and data["rows"][0][1].pixels.shape == data["rows"][0][2].pixels.shape
    assert ratios[2.0]["value"] > 1e3 and ratios[1.0]["value"] < 1e-3
    lo, hi = ratios[0.0]["ci95"]
    assert lo <= ratios[0.0]["value"] == pytest.approx(1, rel=1e-3) and hi == pytest.approx(1, rel=1e-3)


def test_highlights_and_titles(tmp_path):
    one = np.full((8, 8, 3), 0.5)
    cells = [
        cell(tmp_path, f"{target}{s}", one, one, target=target, parameters={"exponent": s})
        for s in (20, 200) for target in (highlights.DIRECT, highlights.WHOLE)
    ]  # fmt: skip
    found = rendered.Rendered(tmp_path, cells, best=frozenset({"unoccluded200"}))
    data = highlights.data(found)
    assert data["names"] == ["s = 20", "s = 200"] and all(len(row) == 5 for row in data["rows"])
    assert beside.data(found, "exponent=s")["titles"] == ["s = 20", "s = 20", "s = 200", "s = 200, best"]
    turned = cell(tmp_path, "b", one, one, technique="glossy-boxmip", parameters={"azimuth": 130, "bias": -0.32})
    assert beside.title(turned, ("technique", "azimuth", "bias")) == "box MIPs, seen from 130°, b = −0.32"


def test_the_page_shows_what_is_whole(tmp_path):
    """In the papers' order, with its files; a damaged or half-made figure is left out, words stay words."""
    for name in ("002-fig3", "001-fig4", "001-fig12", "003-fig3"):
        (tmp_path / f"{name}.png").write_bytes(b"")
        (tmp_path / f"{name}.json").write_text('{"stand_ins": {"<the café>": "office"}}')
    (tmp_path / "001-fig12.json").write_text("{")
    (tmp_path / "003-fig3.png").unlink()
    page = figures_page.write(tmp_path).read_text("utf-8")
    assert 0 < page.index('id="001-fig4"') < page.index('id="002-fig3"')
    assert 'id="001-fig12"' not in page and 'id="003-fig3"' not in page
    assert "office for &lt;the café&gt;" in page and 'href="002-fig3.json"' in page and 'href="002-fig3.pdf"' not in page
