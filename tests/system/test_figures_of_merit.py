"""The figures that every technique must reach where the truth is known in closed form, measured as a user would."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import stats

from evalsuite.image import exr

REPORT = """
title = "Figures of merit"
[[group]]
scenes = ["sphere"]
environments = ["furnace"]
techniques = ["diffuse-sh9", "diffuse-topmip", "glossy-mcguire"]
parameters = { exponent = 50 }
[[group]]
scenes = ["sphere"]
environments = ["sh2"]
techniques = ["diffuse-sh9"]
[[group]]
scenes = ["sphere"]
environments = ["sh2"]
techniques = ["mirror-cube"]
parameters = { face_size = 1024 }
[[group]]
scenes = ["sphere"]
environments = ["sh2"]
techniques = ["brute-force"]
parameters = { bsdf = ["diffuse", "phong", "blinnphong"], samples = 4096, exponent = 50 }
"""


@pytest.fixture(scope="module")
def cells(evalsuite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    (folder / "merit.toml").write_text(REPORT)
    outcome = evalsuite("run", "merit.toml", "--target-error", "0.004", "--size", "64x64", "--out", "out", "--json", cwd=folder)
    assert outcome.code == 0, outcome.err
    found = {cell["id"]: cell for cell in json.loads(outcome.out)["cells"]}
    assert len(found) == 8 and {c["status"] for c in found.values()} == {"scored"}
    for cell in found.values():
        cell["pictures"] = {name: exr.read(folder / "out" / path) for name, path in cell["images"].items()}
    return found


def inside(cell, name="image") -> np.ndarray:
    return cell["pictures"][name][cell["pictures"]["mask"][..., 0] > 0.5].astype(np.float64)


@pytest.mark.parametrize("technique", ["diffuse-sh9", "diffuse-topmip"])
def test_furnace_diffuse(cells, technique):
    """albedo × L = 0.5 in every pixel of the object, within 0.2 %; and the reference says so too."""
    cell = cells[f"sphere/{technique}/env=furnace/unoccluded"]
    image = inside(cell)
    assert len(image) > 1000 and np.abs(image / 0.5 - 1).max() < 0.002
    assert cell["mean_reference"] == pytest.approx(0.5, rel=0.002)


def test_furnace_mcguire_returns_k_g_beside_the_albedo_of_the_published_brdf(cells):
    cell = cells["sphere/glossy-mcguire/env=furnace,exponent=50/unoccluded"]
    assert np.abs(inside(cell) - 1).max() < 1e-4
    # At normal incidence ∫ f cos = (s+8)(2^(−s/2) + s) / ((s+2)(s+4)), 003 Eq 13 integrated in closed form.
    albedo = cell["albedo"]
    assert albedo["cos_theta"][0] == 1.0 and albedo["radiance"] == 1.0
    assert albedo["value"][0] == pytest.approx(58 * 50 / (52 * 54), abs=4 * albedo["standard_error"][0] + 1e-6)
    assert albedo["value"][3] < 0.4 and cell["mean_reference"] < 0.6  # it falls like cos²: the formula's furnace is no furnace


def test_degree_2_environment(cells):
    metric = cells["sphere/diffuse-sh9/env=sh2/unoccluded"]["metrics"]["rel_rmse"]
    assert metric["value"] < 0.003 and metric["ci95"][1] < 0.004


def test_mirror_of_a_smooth_map(cells):
    metric = cells["sphere/mirror-cube/env=sh2,face_size=1024/unoccluded"]["metrics"]["rel_rmse"]
    assert metric["ci95"][1] < 0.005


@pytest.mark.parametrize("bsdf", ["diffuse", "phong", "blinnphong"])
def test_oracle_agrees_with_mitsuba_within_noise(cells, bsdf):
    """Z-test of every pixel, Šidák-corrected at 1 %, and of the mean over all pixels."""
    (cell,) = (c for c in cells.values() if c["parameters"].get("bsdf") == bsdf)
    difference = (inside(cell) - inside(cell, "reference")).mean(axis=1)  # channels share their samples
    variance = inside(cell, "standard_error").mean(axis=1) ** 2 + inside(cell, "image_standard_error").mean(axis=1) ** 2
    z = difference / np.sqrt(variance)
    assert len(z) > 1000 and 0.8 < z.std() < 1.25  # the stated errors are the real ones
    limit = stats.norm.isf((1 - 0.99 ** (1 / len(z))) / 2)
    assert np.abs(z).max() < limit
    assert abs(difference.mean()) < 3.3 * np.sqrt(variance.sum()) / len(z)
    assert np.sqrt(variance).mean() < 0.02 * inside(cell, "reference").mean()  # a test that could have seen a difference
