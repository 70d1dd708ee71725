"""The gate on synthetic runs, whose pictures' distance to the truth is known by construction."""

from __future__ import annotations

import json

import numpy as np
import pytest
from synthetic import MESA, NVIDIA, two

from evalsuite.commands_gate import bless
from evalsuite.gate import tolerance
from evalsuite.gate.verdict import _within_noise
from evalsuite.image import exr


def without_pictures(gate):
    for file in gate.pictures:
        file.unlink()


def test_same_again_is_unchanged_bit_for_bit(gate):
    cells = {"one": (two.picture(0.05), two.reference(0))}
    assert [row["verdict"] for row in gate.bless(cells)] == ["extra"]
    row = gate.check(cells)["one"]
    assert (row["verdict"], row["passed"], row["changed"]) == ("unchanged", True, False)
    assert "bit for bit" in row["reason"]


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize(("error", "verdict", "direction", "passed"), [
    (0.10, "further", "further", False),
    (0.02, "closer", "closer", True),
])  # fmt: skip
def test_further_fails_and_closer_proposes_a_bless(gate, kept, error, verdict, direction, passed):
    """With the old picture at hand and by intervals alone."""
    gate.bless({"one": (two.picture(0.05), two.reference(0))})
    if not kept:
        without_pictures(gate)
    row = gate.check({"one": (two.picture(error), two.reference(1))}, seed=1)["one"]
    assert (row["verdict"], row["direction"], row["passed"]) == (verdict, direction, passed)
    assert row["basis"] == ("paired" if kept else "independent")
    low, high = row["relative"]["ci95"]
    assert low <= error**2 / 0.05**2 - 1 <= high
    assert ("bless" in row["reason"]) == passed


def test_old_picture_tells_what_intervals_cannot(gate):
    """4.5 % of error instead of 5 %, before references of two seeds with 20 % of noise a pixel."""
    gate.bless({"one": (two.picture(0.05), two.reference(0, 0.2))})
    better = {"one": (two.picture(0.045), two.reference(1, 0.2))}
    assert gate.check(better, seed=1)["one"]["verdict"] == "closer"
    without_pictures(gate)
    assert gate.check(better, seed=1)["one"]["verdict"] == "inconclusive"


def test_fresh_references_without_a_change_never_fail(gate):
    """50 seeds, two levels of noise: another reference is no change of the picture, of the truth or of the measure."""
    for noise, seeds in ((0.02, 25), (0.3, 25)):
        gate.path.unlink(missing_ok=True)
        gate.bless({"one": (two.picture(0.05), two.reference(0, noise))})
        for seed in range(1, 1 + seeds):
            row = gate.check({"one": (two.picture(0.05), two.reference(seed, noise))}, seed=seed)["one"]
            assert (row["verdict"], row["passed"]) == ("unchanged", True), (noise, seed, row["reason"])


def test_other_picture_as_far_from_the_truth_is_left_open(gate):
    """Left and right against top and bottom: as far away. Noise alone decides in at most 1 %."""
    other = two.truth() * (1 - 0.05 * np.sign(np.arange(two.SIZE) - two.SIZE / 2 + 0.5)[:, None, None])
    gate.bless({"one": (two.picture(0.05), two.reference(0))})
    found = [gate.check({"one": (other, two.reference(seed))}, seed=seed)["one"] for seed in range(1, 21)]
    assert {row["verdict"] for row in found} == {"inconclusive"}
    assert all(row["changed"] and not row["significant"] and row["passed"] for row in found)


def test_confidence_is_of_all_cells_together(gate):
    """A change of 2.86 standard errors: decided alone (2.58), not as one of four (3.02)."""
    names, reference = "abcd", two.reference(4, 0.5)
    gate.bless(dict.fromkeys(names, (two.picture(0.05), reference)))
    for count, verdict in ((1, "further"), (4, "inconclusive")):
        rows = gate.check({n: (two.picture(0.0501 if k < count else 0.05), reference) for k, n in enumerate(names)})
        assert [row["verdict"] for row in rows.values()] == [verdict] * count + ["unchanged"] * (4 - count)


def test_rounding_and_drift_are_no_change(gate):
    image, reference = two.picture(0.05), two.reference(0)
    gate.bless({"one": (image, reference)})
    rng = np.random.default_rng(1)
    for relative, why in ((1e-7, "rounding of floats"), (0.5e-5, "drift")):
        moved = image * (1 + relative * rng.uniform(-1, 1, image.shape))
        row = gate.check({"one": (moved, reference)})["one"]
        assert (row["verdict"], row["changed"]) == ("unchanged", True) and why in row["reason"]
    row = gate.check({"one": (image * (1 + 1e-3 * np.sign(image - two.truth())), reference)})["one"]
    assert row["verdict"] == "further", "0.1 % of brightness away from the truth is no drift"


def test_another_driver_explains_what_was_measured_and_no_more(gate):
    gate.bless({"one": (two.picture(0.05), two.reference(0))})
    for error, verdict in ((0.053, "unchanged"), (0.052, "unchanged"), (0.07, "further")):
        row = gate.check({"one": (two.picture(error), two.reference(0))}, host=NVIDIA)["one"]
        assert (row["verdict"], row["tolerance"]["reason"]) == (verdict, "driver"), error
    assert gate.check({"one": (two.picture(0.053), two.reference(0))})["one"]["verdict"] == "further", "the same driver"
    assert tolerance.tolerance("glossy-boxmip", "a", "b").allowed > tolerance.tolerance("glossy-mcguire", "a", "b").allowed
    assert tolerance.tolerance("glossy-boxmip", "a", "a") == (tolerance.DRIFT, "drift")


def test_driver_may_move_pixels_it_may_not_cost(gate):
    """Pictures that differ by more than drivers do, and whose error grew by less than that allows, pass."""
    other = two.truth() * (1 - 0.053 * np.sign(np.arange(two.SIZE) - two.SIZE / 2 + 0.5)[:, None, None])
    gate.bless({"one": (two.picture(0.05), two.reference(0, 0.001))})
    row = gate.check({"one": (other, two.reference(0, 0.001))}, host=NVIDIA)["one"]
    assert (row["verdict"], row["passed"]) == ("tolerated", True) and row["picture_change"] > tolerance.DRIVER
    assert gate.check({"one": (other, two.reference(0, 0.001))})["one"]["verdict"] == "further"


def test_missing_extra_and_failed_cells_fail_and_others_are_judged(gate):
    shared = two.picture(0.05), two.reference(0)
    gate.bless(dict.fromkeys(("same", "gone", "crashed", "unseen", "left out"), shared) | {"skip": "skipped", "now": "skipped"})
    fresh = {"same": shared, "new": shared, "crashed": "failed", "unseen": "uncertified", "left out": "skipped"}
    rows = gate.check(fresh | {"skip": "skipped", "now": shared})
    found = {scene: (row["verdict"], row["passed"]) for scene, row in rows.items()}
    failed = dict.fromkeys(("crashed", "unseen", "left out", "now"), ("failed", False))
    assert found == failed | {"same": ("unchanged", True), "skip": ("unchanged", True), "gone": ("missing", False),
                              "new": ("extra", False)}  # fmt: skip
    assert rows["crashed"]["reason"] == "failed: why"
    assert "gone" not in gate.check(fresh, complete=False), "a run that was asked for fewer cells lacks none"


def test_changed_truth_fails_whatever_the_picture_does(gate):
    """A missing cosine in a plugin moves the truth, not the picture; with other samples it is told from noise all the same."""
    image = two.picture(0.05)
    gate.bless({"one": (image, two.reference(0))})
    for seed, factor in ((0, 1.02), (1, 1.02), (2, 0.9)):
        row = gate.check({"one": (image, two.reference(seed, mean=factor * two.truth()))}, seed=seed)["one"]
        assert (row["verdict"], row["passed"]) == ("other truth", False), (seed, factor)
    corner = two.truth()
    corner[14:26, 14:26] *= 1.1
    assert gate.check({"one": (image, two.reference(3, mean=corner))}, seed=3)["one"]["verdict"] == "other truth"
    exact = two.reference(0, 0.0)
    gate.path.unlink()
    gate.bless({"one": (image, exact)})
    rounded = exact[0] * (1 + 1e-6), exact[1]
    assert gate.check({"one": (image, rounded)})["one"]["verdict"] == "unchanged"


def test_changed_size_is_another_truth(gate, monkeypatch):
    gate.bless({"one": (two.picture(0.05), two.reference(0))})
    monkeypatch.setattr(two, "SIZE", 32)
    assert gate.check({"one": (two.picture(0.05), two.reference(0))})["one"]["verdict"] == "other truth"


@pytest.mark.parametrize("metric", ["mse", "relmse", "psnr", "flip", "ssim", "delta_e2000", "max_abs"])
def test_metric_that_says_otherwise_of_the_same_bits_fails(gate, metric):
    cells = {"one": (two.picture(0.05), two.reference(0))}
    gate.bless(cells)
    folder = gate.folder(cells)
    data = json.loads((folder / "results.json").read_text())
    data["cells"][0]["metrics"][metric]["value"] *= 1.001
    (folder / "results.json").write_text(json.dumps(data))
    row = gate.judge(folder)["one"]
    assert row["verdict"] == "other measure" and row["reason"].endswith(f": {metric}")


@pytest.mark.parametrize("kept", [True, False])
def test_another_object_mask_is_another_measure(gate, monkeypatch, kept):
    cells = {"one": (two.picture(0.05), two.reference(0))}
    gate.bless(cells)
    if not kept:
        without_pictures(gate)
    whole = two.mask()
    monkeypatch.setattr(two, "mask", lambda: whole & (np.arange(two.SIZE) < 40))
    assert gate.check(cells)["one"]["verdict"] == "other measure"
    assert gate.check(cells, host=NVIDIA)["one"]["passed"], "another driver may see a silhouette otherwise"


def test_sampled_pictures_carry_their_own_noise(gate, tmp_path):
    """A technique with Monte Carlo noise, drawn with another seed, is not another technique."""
    exact, verdicts = two.reference(0, 0.001), []
    for seed in range(12):
        noisy = two.picture(0.03) + 0.05 * np.random.default_rng(seed).standard_normal(two.truth().shape)
        folder = tmp_path / f"sampled {seed}"
        cell = two.cell(folder, two.name("one"), noisy, exact)
        cell["images"]["image_standard_error"] = "images/noise.exr"
        exr.write(folder / "images" / "noise.exr", np.full_like(noisy, 0.05))
        two.run(folder, [cell], host=MESA)
        if seed == 0:
            bless(gate.path, folder, [])
        else:
            verdicts.append(gate.judge(folder)["one"]["verdict"])
    assert set(verdicts) == {"inconclusive"}


@pytest.mark.parametrize(("gap", "agree"), [(0.0, True), (2.5, True), (3.5, True), (8.0, False)])
def test_measures_of_other_samples_agree_within_thrice_their_intervals(gap, agree):
    """Values `gap` half widths apart; widths added, they meet up to six."""
    a, b = ({"value": v, "ci95": [v - 0.01, v + 0.01]} for v in (0.2, 0.2 + 0.01 * gap))
    assert _within_noise(a, b) == _within_noise(b, a) == agree


def test_measure_of_other_samples_that_says_otherwise_fails(gate):
    gate.bless({"one": (two.picture(0.05), two.reference(0))})
    folder = gate.folder({"one": (two.picture(0.05), two.reference(1))}, seed=1)
    data = json.loads((folder / "results.json").read_text())
    metric = data["cells"][0]["metrics"]["rel_rmse"]
    metric |= {"value": 1.2 * metric["value"], "ci95": [1.2 * end for end in metric["ci95"]]}
    (folder / "results.json").write_text(json.dumps(data))
    row = gate.judge(folder)["one"]
    assert row["verdict"] == "other measure" and row["reason"].endswith(": rel_rmse")
