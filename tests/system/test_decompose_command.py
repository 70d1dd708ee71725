"""`evalsuite decompose` as a user types it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evalsuite.image import exr
from evalsuite.math.sphere import latlong_solid_angles


def integral(path) -> np.ndarray:
    image = exr.read(path).astype(np.float64)
    return np.einsum("yxc,yx->c", image, latlong_solid_angles(*image.shape[:2]))


def test_lights_and_remainder_are_the_map(evalsuite, tmp_path):
    source, out = tmp_path / "map.exr", tmp_path / "decomposed"
    image = np.full((64, 128, 3), 0.01, np.float32)
    image[20:24, 30:36] = (5.0, 4.0, 2.0)
    exr.write(source, image)
    done = evalsuite("decompose", source, "-o", out)
    assert done.code == 0, done.err
    lights = json.loads((out / "lights.json").read_text())
    assert len(lights) == 1 and set(lights[0]) == {
        "direction", "angular_radius_deg", "solid_angle", "radiance", "irradiance", "share",
    }  # fmt: skip
    assert np.linalg.norm(lights[0]["direction"]) == pytest.approx(1.0)
    total = np.sum([light["irradiance"] for light in lights], axis=0)
    np.testing.assert_allclose(np.array(lights[0]["radiance"]) * lights[0]["solid_angle"], lights[0]["irradiance"])
    np.testing.assert_allclose(total + integral(out / "remainder.exr"), integral(source), rtol=1e-5)
    np.testing.assert_allclose(integral(out / "lights.exr"), total, rtol=1e-3)
    assert {p.name for p in out.iterdir()} == {
        "lights.json", "remainder.exr", "lights.exr", "discs.png", "convergence.json", "convergence.png",
    }  # fmt: skip


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["nowhere"], "nowhere"),
        (["furnace", "--sizes", "0"], "sizes"),
        (["furnace", "--smallest-deg", "60"], "smallest_deg"),
        (["furnace", "--surround", "2"], "surround"),
    ],
)
def test_bad_input_is_one_line(evalsuite, tmp_path, arguments, said):
    done = evalsuite("decompose", *arguments, "-o", tmp_path / "out")
    assert done.code == 2 and said in done.err and len(done.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
