"""Pictures without content, of one pixel, of one row, of numbers at the ends of the floats: `compare` stays finite."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from evalsuite.errors import WorkerFailed
from evalsuite.execute.local import Lane
from evalsuite.image import exr

SHAPES = ((12, 16), (1, 1), (1, 16), (16, 1), (2, 2))


def _pictures(shape: tuple[int, int]) -> dict[str, np.ndarray]:
    lamp = np.zeros(shape)
    lamp[0, 0] = 1e30
    noise = np.random.default_rng(0).uniform(0, 1, (*shape, 3))
    constants = {"black": 0.0, "grey": 0.5, "negative": -0.5, "largest": 3e38, "subnormal": 1e-40}
    flat = {name: np.full((*shape, 3), value) for name, value in constants.items()}
    return {**flat, "lamp": np.repeat(lamp[..., None], 3, axis=2), "noise": noise}


@pytest.fixture(scope="module")
def lane():
    lane = Lane("compare")  # FLIP's own exposures would end the process for a black reference
    yield lane
    lane.close()


@pytest.mark.parametrize("shape", SHAPES)
def test_any_two_of_them(lane, tmp_path, shape):
    pictures = _pictures(shape)
    for name, picture in pictures.items():
        exr.write(tmp_path / f"{name}.exr", picture)
    for a, b in itertools.product(pictures, repeat=2):
        paths = tmp_path / f"{a}.exr", tmp_path / f"{b}.exr"
        try:
            found = lane.call("evalsuite.commands:_compare_files", *paths, None, None, Path(tmp_path / "maps"))
        except WorkerFailed as error:
            pytest.fail(f"{a} against {b}: {error}")
        json.dumps(found, allow_nan=False)
        if a == b and a != "subnormal":
            assert found["metrics"]["mse"]["value"] == 0, (a, b)


def test_black_against_black(evalsuite, tmp_path):
    exr.write(tmp_path / "black.exr", np.zeros((8, 8, 3)))
    outcome = evalsuite("compare", "black.exr", "black.exr", "--json", cwd=tmp_path)
    assert outcome.code == 0, outcome.err
    metrics = json.loads(outcome.out)["metrics"]
    assert metrics["flip"]["value"] == 0 and metrics["ssim"]["value"] == pytest.approx(1)


@pytest.mark.parametrize(
    "words",
    [("--seed", "-1"), ("--seed", "99999999999999999999"), ("--jobs", "0"), ("--jobs", "100000"), ("--cap", "9999999999999"),
     ("--size", "1000000x1000000"), ("--size", "16384x16384")],
)  # fmt: skip
def test_numbers_beyond_sense(evalsuite, tmp_path, words):
    outcome = evalsuite("run", "--scene", "sphere", "-t", "diffuse-sh9", "--out", "o", *words, cwd=tmp_path)
    assert outcome.code == 2 and "Traceback" not in outcome.err
    assert len([line for line in outcome.err.splitlines() if line.strip()]) == 1, outcome.err
