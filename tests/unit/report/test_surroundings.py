"""The picture of a cell's environment and the outlines of its lights."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest

from evalsuite.environment_view import reduced
from evalsuite.image import exr
from evalsuite.math.sphere import latlong_to_direction
from evalsuite.report import surroundings


def light(u, v, radius=10.0):
    return {"direction": latlong_to_direction(u, v).tolist(), "angular_radius_deg": radius, "share": 0.25}


def points(path):
    return [(m, float(x), float(y)) for m, x, y in re.findall(r"([ML])([\d.]+) ([\d.]+)", path)]


def test_an_outline_is_a_circle_on_the_equator_and_wider_towards_the_poles():
    path = points(surroundings._outline(1, light(0.25, 0.5))["path"])
    assert [m for m, *_ in path].count("M") == 1
    x, y = np.array([p[1:] for p in path]).T
    assert np.hypot(x - 90, y - 90) == pytest.approx(10.0, abs=0.2)
    high = np.array([p[1:] for p in points(surroundings._outline(1, light(0.25, 30 / 180))["path"])])
    assert np.ptp(high[:, 1]) == pytest.approx(20.0, abs=0.1) and np.ptp(high[:, 0]) == pytest.approx(2 * 20.3, abs=0.4)


def test_no_line_crosses_the_map_from_seam_to_seam():
    path = points(surroundings._outline(1, light(0.0, 0.5))["path"])
    assert [m for m, *_ in path].count("M") >= 2
    for (_, x0, _), (move, x1, _) in pairwise(path):
        assert move == "M" or abs(x1 - x0) < 10.0


def test_a_picture_is_written_once_and_states_its_white(tmp_path):
    radiance = np.full((16, 32, 3), 0.5, np.float32)
    radiance[4, 5] = 100.0
    exr.write(tmp_path / "images" / "environments" / "0123456789abcdef" / "environment.exr", radiance)
    cell = {"images": {"environment": "images/environments/0123456789abcdef/environment.exr"}, "lights": [light(0.2, 0.3)]}
    found = surroundings.section(cell, tmp_path)
    written = tmp_path / found["preview"]
    before = written.stat().st_mtime_ns
    assert found["share"] == 0.25 and found["scale"].ticks[-1][1] == "≥ 1", "twice the usual luminance is white"
    surroundings.section(cell, tmp_path)
    assert written.stat().st_mtime_ns == before
    assert surroundings.section({"images": {}}, tmp_path) is None
    assert surroundings.section({"images": {"environment": "images/none.exr"}}, tmp_path) is None


@pytest.mark.parametrize("shape", [(64, 128), (70, 130), (512, 1024), (1, 3)])
def test_a_small_map_keeps_means(shape):
    radiance = np.random.default_rng(1).random((*shape, 3)).astype(np.float32)
    small = reduced(radiance, 64)
    k = -(-shape[1] // 64)
    assert small.shape == (max(shape[0] // k, 1), shape[1] // k, 3)
    rows, columns = (size * k for size in small.shape[:2])
    means = [picture.mean((0, 1), dtype=np.float64) for picture in (small, radiance[:rows, :columns])]
    np.testing.assert_allclose(*means, rtol=1e-6)
