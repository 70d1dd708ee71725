"""Two runs: verdicts against differences that are known by construction, and how often noise alone gives one."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from evalsuite.commands_runs import are_runs, compare_folders
from evalsuite.compare import decide
from evalsuite.compare.comparison import noisy_picture
from evalsuite.compare.run_folder import Run
from evalsuite.compare.runs import compare_runs
from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr
from evalsuite.report.runs import in_all, notes
from evalsuite.store import results

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "report"))
import two_runs as two


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return two.pair(tmp_path_factory.mktemp("runs"))


def verdict(tmp_path, of_a, of_b, **other):
    """The one cell of two runs whose pictures and references are given."""
    a, b = (tmp_path / side for side in "ab")
    for folder, (image, reference), more in ((a, of_a, {}), (b, of_b, other)):
        two.run(folder, [two.cell(folder, two.name("one"), image, reference, **more)])
    return compare_folders(a, b, None)["cells"][0]


def test_closer_further_hidden_by_noise_and_unchanged(folders):
    found = compare_folders(*folders, None)
    rows = {row["scene"]: row for row in found["cells"]}
    verdicts = {scene: row["verdict"] for scene, row in rows.items()}
    assert verdicts == {"better": "closer", "worse": "further", "noisy": "undecided", "same": "unchanged"}
    assert found["counts"] == {"closer": 1, "further": 1, "undecided": 1, "unchanged": 1, "unscored": 0}
    assert [rows[s]["basis"] for s in ("better", "worse", "noisy", "same")] == ["paired", "paired", "paired", "identical"]
    # mse of 1 ± e times the truth is e² mean truth²: from 0.1 to 0.05 and back.
    square = np.square(two.truth()[two.mask()]).mean()
    for scene, expected in (("better", -0.0075), ("worse", 0.0075), ("noisy", 0.0)):
        low, high = rows[scene]["difference"]["ci95"]
        assert low <= expected * square <= high and high - low < 0.001
    assert rows["better"]["relative"]["value"] == pytest.approx(-0.75, abs=0.02)
    assert rows["worse"]["relative"]["value"] == pytest.approx(3.0, abs=0.2)
    assert rows["same"]["difference"] == {"value": 0.0, "ci95": [0.0, 0.0]}
    assert found["only_a"] == [two.name("gone")] and len(found["only_b"]) == 1
    assert found["changes"] == [{"what": "git", "a": "aaaa", "b": "bbbb"}]


def test_swapped_runs_swap_the_verdicts(folders):
    there, back = (compare_folders(*pair, None) for pair in (folders, folders[::-1]))
    opposite = {"closer": "further", "further": "closer", "undecided": "undecided", "unchanged": "unchanged"}
    assert [opposite[c["verdict"]] for c in there["cells"]] == [c["verdict"] for c in back["cells"]]
    for x, y in zip(there["cells"], back["cells"], strict=True):
        assert x["difference"]["value"] == pytest.approx(-y["difference"]["value"])


@pytest.mark.parametrize(("channels", "least"), [(3, 0), (1, 3)])
def test_noise_alone_decides_in_at_most_five_percent(channels, least):
    """Two pictures equally far from the truth: the share of 200 references that prefer one. Channels that move together are what
    the interval is made for; with independent ones it is too wide."""
    truth, inside = two.truth(), two.mask()
    images = two.picture(0.05), truth * (1 - 0.05 * np.sign(np.arange(two.SIZE) - 23.5)[:, None, None])
    pictures = [noisy_picture(image, None, k)[inside] for k, image in enumerate(images, 1)]
    decided = 0
    for seed in range(200):
        noise = two.NOISE * truth * np.random.default_rng(seed).standard_normal((two.SIZE, two.SIZE, channels))
        reference = noisy_picture(truth + noise, two.NOISE * truth, 0)[inside]
        low, high = decide.difference(*pictures, reference).ci95
        decided += not low <= 0 <= high
    assert least <= decided <= 20


def test_shared_noise_tells_what_apart_intervals_cannot(tmp_path):
    """A change far within either error's interval: decided with one reference, not with two."""
    same = two.reference(0, 0.2)
    assert verdict(tmp_path / "same", (two.picture(0.05), same), (two.picture(0.045), same))["verdict"] == "closer"
    row = verdict(tmp_path / "other", (two.picture(0.05), same), (two.picture(0.045), two.reference(1, 0.2)), seed=1)
    assert (row["verdict"], row["basis"], row["reference"]) == ("undecided", "independent", "other samples")
    assert {"what": "seed", "a": 0, "b": 1} in row["changes"]


def test_other_samples_decide_what_is_large(tmp_path):
    row = verdict(tmp_path, (two.picture(0.1), two.reference(0)), (two.picture(0.05), two.reference(1)), seed=1)
    assert (row["verdict"], row["basis"], row["quantity"]) == ("closer", "independent", "mse")
    wide = verdict(tmp_path, (two.picture(0.1), two.reference(0)), (two.picture(0.05), two.reference(1)), target_error=0.01)
    assert wide["basis"] == "worst case" and {"what": "target_error", "a": 0.02, "b": 0.01} in wide["changes"]
    width = [row["difference"]["ci95"][1] - row["difference"]["ci95"][0] for row in (row, wide)]
    assert width[1] > 1.2 * width[0], "what one seed shares is unknown"


def test_same_picture_with_another_reference_is_unchanged(tmp_path):
    row = verdict(tmp_path, (two.picture(0.1), two.reference(0)), (two.picture(0.1), two.reference(1)), seed=1)
    assert (row["verdict"], row["reference"], row["difference"]["value"]) == ("unchanged", "other samples", 0.0)


@pytest.mark.parametrize(("change", "verdict"), [(1e-6, "unchanged"), (1e-3, "further"), (-0.03, "closer")])
def test_rounding_in_the_folders_is_no_change(tmp_path, change, verdict):
    """As runs keep their pictures (`store.kept`): what differs by the rounding of floats may fall on either side of a step."""
    folders = []
    grain = 0.01 * np.random.default_rng(3).standard_normal((two.SIZE, two.SIZE, 3))
    for side, error in (("a", 0.05), ("b", 0.05 + change)):
        image = two.picture(error) * (1 + grain)
        cell = two.cell(tmp_path / side, two.name("one"), image, two.reference(0))
        files = {name: tmp_path / side / path for name, path in cell["images"].items()}
        folders.append(tmp_path / f"kept-{side}")
        results.write(folders[-1], {}, [(cell, files)])
    kept = [exr.read(next(folder.rglob("image.exr"))) for folder in folders]
    assert not np.array_equal(*kept), "some pixels are a step apart"
    assert compare_folders(*folders, None)["cells"][0]["verdict"] == verdict


def test_another_truth_is_named_and_measured_by_its_own(tmp_path):
    brighter = 2 * two.truth()
    row = verdict(tmp_path, (two.picture(0.1), two.reference(0)), (2 * two.picture(0.05), two.reference(1, mean=brighter)))
    assert (row["verdict"], row["reference"], row["quantity"]) == ("closer", "another truth", "rel_rmse²")
    assert row["relative"]["value"] == pytest.approx(-0.75, abs=0.02)


def test_pictures_of_another_size(tmp_path, monkeypatch):
    a, b = tmp_path / "a", tmp_path / "b"
    two.run(a, [two.cell(a, two.name("one"), two.picture(0.1), two.reference(0))])
    monkeypatch.setattr(two, "SIZE", 32)
    two.run(b, [two.cell(b, two.name("one"), two.picture(0.05), two.reference(0))])
    row = compare_folders(a, b, None)["cells"][0]
    assert (row["verdict"], row["reference"]) == ("closer", "another size")


def test_parameters_and_status_that_changed_are_told(tmp_path):
    shared = two.reference(0)
    other = {"all_parameters": {"exponent": 10.0, "lod_offset": 0.5}}
    row = verdict(tmp_path / "1", (two.picture(0.1), shared), (two.picture(0.05), shared), **other)
    assert row["changes"] == [{"what": "lod_offset", "a": 0.0, "b": 0.5}]
    failed = {"status": "failed", "message": "worker died", "metrics": {}, "images": {}}
    row = verdict(tmp_path / "2", (two.picture(0.1), shared), (two.picture(0.05), shared), **failed)
    assert row["verdict"] == "unscored" and row["difference"] is None
    assert {"what": "status", "a": "scored", "b": "failed"} in row["changes"]


def test_noise_of_the_pictures_themselves_counts(tmp_path):
    """With one exact reference, pictures that carry more noise than they differ by are undecided."""
    exact = two.truth(), np.zeros_like(two.truth())
    rng = np.random.default_rng(5)
    noisy = [two.picture(error) + 0.05 * rng.standard_normal(two.truth().shape) for error in (0.02, 0.0201)]
    without = verdict(tmp_path / "1", (noisy[0], exact), (noisy[1], exact))
    assert without["difference"]["ci95"][0] == without["difference"]["ci95"][1], "an exact truth and exact pictures"
    a, b = tmp_path / "2" / "a", tmp_path / "2" / "b"
    for folder, image in ((a, noisy[0]), (b, noisy[1])):
        cell = two.cell(folder, two.name("one"), image, exact)
        cell["images"]["image_standard_error"] = "images/noise.exr"
        exr.write(folder / "images" / "noise.exr", np.full_like(image, 0.05))
        two.run(folder, [cell])
    assert compare_folders(a, b, None)["cells"][0]["verdict"] == "undecided"


def test_what_changed_everywhere_is_said_once(tmp_path):
    a, b = (tmp_path / side for side in "ab")
    for folder, seed in ((a, 0), (b, 1)):
        two.run(folder, [two.cell(folder, two.name(s), two.picture(0.1 * (k + 1) / (seed + 1)), two.reference(2 * k + seed),
                                  seed=seed, target_error=0.02 / (1 + k * seed)) for k, s in enumerate("xy")])  # fmt: skip
    found = compare_folders(a, b, tmp_path / "out")
    samples = "the reference has other samples: noise no longer cancels"
    assert in_all(found) == [samples, "seed: 0 → 1"]
    assert notes(found["cells"][1]) == [samples, "target_error: 0.02 → 0.01", "seed: 0 → 1"]
    html = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert html.count(samples) == 1 and html.count("target_error: 0.02 → 0.01") == 2, "in the table and at the pictures"


def damaged(folder, change):
    data = json.loads((folder / "results.json").read_text())
    change(data)
    (folder / "results.json").write_text(json.dumps(data))


def drop(folder, name):
    next(folder.glob(f"images/*/{name}.exr")).unlink()


@pytest.mark.parametrize(("spoil", "words"), [
    (lambda b: (b / "results.json").unlink(), "no such file"),
    (lambda b: (b / "results.json").write_text("{"), "does not read"),
    (lambda b: (b / "results.json").write_text("[]"), "schema 'list'"),
    (lambda b: damaged(b, lambda d: d.update(schema="evalsuite.results/9")), "evalsuite.results/9"),
    (lambda b: damaged(b, lambda d: d.update(cells={})), "whole metrics"),
    (lambda b: damaged(b, lambda d: d["cells"][0].pop("status")), "whole metrics"),
    (lambda b: damaged(b, lambda d: d["cells"][0]["metrics"].update(mse={"value": 1})), "whole metrics"),
    (lambda b: damaged(b, lambda d: d["cells"][0]["images"].pop("mask")), "None as mask"),
    (lambda b: damaged(b, lambda d: d["cells"][0]["images"].update(image="../a/images/x.exr")), "in its folder"),
    (lambda b: drop(b, "image"), "image.exr"),
    (lambda b: next(b.glob("images/*/reference.exr")).write_bytes(b"no picture"), "reference.exr"),
])  # fmt: skip
def test_bad_input_is_one_line(tmp_path, spoil, words):
    a, b = (tmp_path / side for side in "ab")
    for folder in (a, b):
        two.run(folder, [two.cell(folder, two.name("one"), two.picture(0.1), two.reference(0))])
    spoil(b)
    with pytest.raises(EvalsuiteError, match=words) as caught:
        compare_folders(a, b, None)
    assert "\n" not in str(caught.value)


def test_what_is_a_run(tmp_path, folders):
    a, b = folders
    assert are_runs(a, b) and are_runs(a / "results.json", b)
    assert not are_runs(tmp_path / "x.exr", tmp_path / "y.png")
    with pytest.raises(EvalsuiteError, match="two pictures, or the folders of two runs"):
        are_runs(a, tmp_path / "y.exr")
    with pytest.raises(EvalsuiteError, match="a folder of its own"):
        compare_folders(a, b, a)
    with pytest.raises(EvalsuiteError, match="no run"):
        compare_folders(a, tmp_path / "other.json", None)
    assert compare_folders(a / "results.json", b, None)["cells"] == compare_folders(a, b, None)["cells"]


def test_runs_of_nothing_in_common():
    empty = Run(Path("a"), {"cells": []})
    assert compare_runs(empty, empty)["cells"] == []
