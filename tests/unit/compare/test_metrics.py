"""Metrics against closed forms and independent implementations, on pictures without noise and at the edges of input."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import flip_evaluator
import numpy as np
import pytest
from skimage.metrics import structural_similarity

from evalsuite.compare import compare
from evalsuite.compare.perceptual import MAX_EXPOSURES, view_of
from evalsuite.errors import EvalsuiteError
from evalsuite.image.color import luminance, tone_map

MAPS = ("difference", "relative", "zscore", "flip_map")


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(5)
    reference = rng.uniform(0.1, 2.0, (40, 56, 3))
    return reference + rng.normal(0, 0.1, reference.shape), reference


@pytest.fixture(scope="module")
def mask():
    return np.hypot(*(np.indices((40, 56)) - 20)) < 15


def values(comparison):
    return {name: metric.value for name, metric in comparison.metrics.items()}


def test_formulas(pair, mask):
    image, reference = pair
    got = values(compare(image, reference, mask=mask))
    for suffix, inside in (("", mask), ("_full", np.ones_like(mask))):
        a, b = image[inside], reference[inside]
        mean = sum(b.ravel()) / b.size
        mse = sum((x - y) ** 2 for x, y in zip(a.ravel(), b.ravel(), strict=True)) / b.size
        largest = np.sort(np.abs(a - b).max(axis=1))
        expected = {
            "mse": mse,
            "rmse": math.sqrt(mse),
            "relmse": np.mean((a - b) ** 2 / (b**2 + (0.01 * mean) ** 2)),
            "rel_rmse": math.sqrt(mse) / mean,
            "mae": np.mean(np.abs(a - b)),
            "smape": np.mean(np.abs(a - b) / ((np.abs(a) + np.abs(b)) / 2)),
            "bias": a.mean() - b.mean(),
            "rel_bias": (a.mean() - b.mean()) / b.mean(),
            "psnr": -10 * math.log10(mse * compare(image, reference, mask=mask).exposure ** 2),
            "max_abs": largest[-1],
            "p99_abs": np.interp(0.99 * (largest.size - 1), np.arange(largest.size), largest),
        }
        for name, value in expected.items():
            assert got[name + suffix] == pytest.approx(value, rel=1e-9), name + suffix
    names = "mse rmse relmse rel_rmse mae smape bias rel_bias psnr ssim flip flip_hdr delta_e2000 max_abs p99_abs".split()
    assert set(got) == {*names, *(f"{name}_full" for name in names)}


def test_ssim_and_flip_are_the_libraries(pair):
    image, reference = pair
    result = compare(image, reference)
    shown, truth = (tone_map(p, result.exposure) for p in pair)
    options = {"channel_axis": 2, "data_range": 1.0, "gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False}
    _, ssim = structural_similarity(shown, truth, full=True, **options)
    assert result.metrics["ssim"].value == pytest.approx(ssim.mean(), abs=1e-6)
    assert result.metrics["flip"].value == pytest.approx(
        flip_evaluator.evaluate(truth, shown, "LDR", applyMagma=False)[1], abs=1e-6
    )
    np.testing.assert_array_equal(result.flip_map >= 0, True)


def test_delta_e2000_of_a_published_pair():
    """Sharma, Wu and Dalal 2005, table 1, pair 1: (50, 2.6772, −79.7751) against (50, 0, −82.7485) differ by 2.0425; brought
    to linear Rec.709 they leave the gamut, so a grey pair is used: L* 50 against 60 has ΔE00 = 10 / S_L with
    S_L = 1 + 0.015 (L̄ − 50)² / √(20 + (L̄ − 50)²), L̄ = 55."""

    def gray(lightness):
        return np.full((16, 16, 3), ((lightness + 16) / 116) ** 3)

    white = np.ones((16, 16, 3))  # the mask's brightest tenth fixes the exposure at 1
    image, reference = (np.concatenate([gray(v), white]) for v in (60, 50))
    mask = np.zeros((32, 16), bool)
    mask[:16] = True
    result = compare(image, reference)
    half = result.metrics["delta_e2000"].value
    assert result.exposure == 1.0
    assert half == pytest.approx(0.5 * 10 / (1 + 0.015 * 25 / math.sqrt(45)), rel=2e-3)  # skimage's white point has 4 digits


def test_identical_pictures(pair):
    _, reference = pair
    result = compare(reference, reference, np.full_like(reference, 0.01))
    for name, metric in result.metrics.items():
        clean = name.removesuffix("_full")
        expected = {"ssim": 1.0, "psnr": math.inf}.get(clean, 0.0)
        assert metric.value == pytest.approx(expected, abs=1e-6), name
        assert metric.ci95[0] - 1e-6 <= expected <= metric.ci95[1] + 1e-6, name


def test_debiasing_is_the_product_of_the_halves(pair):
    image, reference = pair
    rng = np.random.default_rng(6)
    first, second = (reference + rng.normal(0, 0.2, reference.shape) for _ in range(2))
    metric = compare(image, (first + second) / 2, np.full_like(reference, 0.2 / math.sqrt(2)), (first, second)).metrics["mse"]
    assert metric.value == pytest.approx(np.mean((image - first) * (image - second)), rel=1e-9)
    sigma = 0.2 / math.sqrt(2)
    error = image - (first + second) / 2
    # Independent channels: Var of the mean = Σ 4 D² σ² / N², whose expectation is Σ (4 d² σ² + 4 σ⁴) / N².
    assert (metric.ci95[1] - metric.value) / 1.96 == pytest.approx(
        math.sqrt((4 * error**2 * sigma**2).sum()) / error.size, rel=0.02
    )


def test_image_noise_is_taken_off():
    rng = np.random.default_rng(8)
    mean = np.ones((64, 64, 3))
    noisy = mean + 0.1 * rng.standard_normal((64, 64, 1))
    with_noise = compare(noisy, mean, image_standard_error=np.full_like(mean, 0.1)).metrics
    assert compare(noisy, mean).metrics["mse"].value == pytest.approx(0.01, rel=0.1)
    assert with_noise["mse"].value < 0.0005 and with_noise["mse"].ci95[0] == 0
    assert with_noise["bias"].ci95[0] < 0 < with_noise["bias"].ci95[1]


def test_maps_keep_the_sign_and_mark_noise():
    reference = np.ones((32, 32, 3))
    image = reference.copy()
    image[:, :16] += 0.5
    image[:, 16:24] -= 0.25
    image[:, 24:] += 0.001
    maps = vars(compare(image, reference, np.full_like(reference, 0.01)))
    np.testing.assert_allclose(maps["difference"][0, [0, 20, 30], 0], [0.5, -0.25, 0.001], atol=1e-7)
    np.testing.assert_allclose(maps["relative"][0, [0, 20], 0], [0.5 / 1.01, -0.25 / 1.01], rtol=1e-6)
    np.testing.assert_allclose(maps["zscore"][0, [0, 20, 30]], [50, 25, 0.1], rtol=1e-3)
    np.testing.assert_array_equal(maps["noise_decided"], maps["zscore"] < 2)
    assert maps["noise_decided"].sum() == 32 * 8
    assert all(maps[name].dtype == np.float32 for name in MAPS)


def test_noise_of_the_reference_has_unit_z():
    rng = np.random.default_rng(9)
    noisy = 1 + 0.05 * rng.standard_normal((64, 64, 1)) * np.ones(3)
    maps = compare(np.ones_like(noisy), noisy, np.full_like(noisy, 0.05))
    assert np.mean(maps.zscore**2) == pytest.approx(1.0, abs=0.1)
    assert maps.noise_decided.mean() == pytest.approx(0.9545, abs=0.015)


def test_deterministic(pair, mask):
    image, reference = pair
    sigma = np.full_like(reference, 0.05)
    a, b = (compare(image, reference, sigma, mask=mask) for _ in range(2))
    assert a.to_json() == b.to_json()
    assert all(vars(a)[name].tobytes() == vars(b)[name].tobytes() for name in MAPS)


@pytest.mark.parametrize("shape", [(1, 1, 3), (2, 300, 3), (11, 3, 3), (33, 17, 3)])
@pytest.mark.parametrize("level", [0.0, 1e-6, 1.0, 3e4])
def test_any_size_and_level(shape, level):
    reference = level * np.random.default_rng(1).uniform(0.5, 1, shape)
    result = compare(reference * 1.1 + 1e-3 * level, reference, 0.1 * reference, mask=np.ones(shape[:2]))
    json.dumps(result.to_json(), allow_nan=False)
    assert all(m.ci95[0] <= m.value <= m.ci95[1] for m in result.metrics.values())


def test_black_reference_does_not_end_the_process():
    """FLIP's automatic exposure would: hence a process of its own."""
    code = """
import numpy as np
from evalsuite.compare import compare
z = np.zeros((20, 20, 3))
a, b = compare(z, z).to_json(), compare(z + 1, z).to_json()
assert a["metrics"]["rel_rmse"] == {"value": 0.0, "ci95": [0.0, 0.0]}, a["metrics"]["rel_rmse"]
assert b["metrics"]["rel_rmse"]["value"] is None and b["metrics"]["mse"]["value"] == 1.0
assert b["metrics"]["flip"]["value"] > 0.5 and b["metrics"]["flip_hdr"]["value"] > 0.5
assert any("black" in note for note in b["notes"])
print("survived")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "survived", done.stderr


def test_view():
    reference = np.random.default_rng(2).uniform(0, 1, (64, 64, 3)) * 8
    reference[0, 0] = 2e4  # a firefly moves nothing
    view = view_of(reference, np.ones((64, 64), bool))
    white = np.percentile(luminance(reference), 99)
    assert abs(math.log2(view.exposure * white)) <= 0.125 + 1e-9
    assert 2 <= view.flip_stops[2] <= MAX_EXPOSURES and view.flip_stops[0] <= view.flip_stops[1]


def test_hdr_flip_is_the_librarys_at_its_own_exposures():
    rng = np.random.default_rng(3)
    reference = rng.uniform(0, 1, (32, 32, 3)).astype(np.float32)
    image = (reference * rng.uniform(0.7, 1.3, reference.shape)).astype(np.float32)
    _, automatic, chosen = flip_evaluator.evaluate(reference, image, "HDR", applyMagma=False)
    start, stop, count = view_of(reference, np.ones((32, 32), bool)).flip_stops
    # White is the 99th percentile here and the maximum there, and stops are rounded to quarters.
    assert (start, stop) == pytest.approx((chosen["startExposure"], chosen["stopExposure"]), abs=0.3)
    assert count == chosen["numExposures"]
    assert compare(image, reference).metrics["flip_hdr"].value == pytest.approx(automatic, rel=0.1)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda k: k.update(image=np.zeros((4, 4))), "image: got shape"),
        (lambda k: k.update(image=np.zeros((4, 5, 3))), r"image: got shape \(4, 5, 3\), expected shape \(4, 4, 3\)"),
        (lambda k: k["image"].__setitem__((2, 1, 1), np.nan), "image: got nan at pixel x=1, y=2, channel G"),
        (lambda k: k["reference"].__setitem__((0, 3), np.inf), "reference: got inf at pixel x=3, y=0, channel R"),
        (lambda k: k.update(mask=np.zeros((4, 4), bool)), "mask: got no pixel inside"),
        (lambda k: k.update(mask=np.ones((4, 5), bool)), "mask: got shape"),
        (lambda k: k.update(standard_error=np.full((4, 4, 3), np.nan)), "standard error: got nan"),
        (lambda k: k.update(halves=(np.ones((4, 4, 3)), np.ones((4, 3, 3)))), "half 2: got shape"),
    ],
)
def test_bad_input_names_the_place(change, says):
    arguments = {"image": np.ones((4, 4, 3)), "reference": np.ones((4, 4, 3))}
    change(arguments)
    with pytest.raises(EvalsuiteError, match=says):
        compare(**arguments)


def test_without_noise_estimates_intervals_are_points(pair):
    result = compare(*pair)
    assert all(m.ci95 == (m.value, m.value) for m in result.metrics.values())
    assert "single points" in result.notes[0] and result.zscore is None and result.noise_decided is None
