"""The pictures of a run's folder: what rounding leaves of them, what is shared, what stays and what goes."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.image import exr
from evalsuite.image.rounding import MOST, bits_for, bits_in, significant, stepped
from evalsuite.store import kept, results

rng = np.random.default_rng(5)
RADIANCES = (rng.random((24, 24, 3)) * 10.0 ** rng.integers(-6, 7, (24, 24, 1))).astype(np.float32)


def run(folder, cells):
    """Cells as (id, files), written into a folder."""
    made = [({"id": name, "reference_id": "0123456789abcdef"}, files) for name, files in cells.items()]
    return results.write(folder, {}, made)["cells"]


@pytest.fixture
def store(tmp_path):
    """Files of one cell as the store has them."""
    mask = np.zeros((24, 24), np.float32)
    mask[4:20, 4:20] = 1.0
    error = rng.standard_normal((24, 24, 3)).astype(np.float32) * 1e-7
    pictures = {"image": RADIANCES, "reference": RADIANCES * 1.1, "standard_error": 1e-2 * RADIANCES, "error": error,
                "relative": error, "zscore": mask, "flip": rng.random((24, 24)), "mask": mask, "regions": mask * 7,
                "rung-0": error + 3}  # fmt: skip
    for name, picture in pictures.items():
        exr.write(tmp_path / "store" / f"{name}.exr", picture)
    return {name: tmp_path / "store" / f"{name}.exr" for name in pictures}


@pytest.mark.parametrize("bits", [4, 6, MOST, 23])
def test_significant_digits(bits):
    values = np.concatenate([RADIANCES.ravel(), -RADIANCES.ravel(), [0.0, 1.0, np.inf, -np.inf]]).astype(np.float32)
    found = significant(values, bits)
    finite = np.isfinite(values)
    assert (np.abs(found[finite] - values[finite]) <= 2.0 ** -(bits + 1) * np.abs(values[finite])).all()
    np.testing.assert_array_equal(found[~finite], values[~finite])
    np.testing.assert_array_equal(significant(found, bits), found)
    assert np.isnan(significant([np.nan], bits)).all() and significant([3.4e38], bits)[0] > 3.3e38
    assert bits_in(found[finite]) == bits
    mantissa, _ = np.frexp(found[finite].astype(np.float64))
    np.testing.assert_array_equal(mantissa * 2.0 ** (bits + 1) % 1, 0)


def test_steps_are_powers_of_two():
    assert set(np.unique(stepped(np.linspace(0, 1, 99), 0.3))) == {0.0, 0.25, 0.5, 0.75, 1.0}
    np.testing.assert_array_equal(stepped([0.1, 0.2], 0.0), np.float32([0.1, 0.2]))


def test_pictures_are_kept_to_what_is_stated(tmp_path, store):
    (cell,) = run(tmp_path / "out", {"a": store})
    read = {n: next(iter(exr.read_parts(tmp_path / "out" / p).values())) for n, p in cell["images"].items()}
    was = {n: next(iter(exr.read_parts(p).values())) for n, p in store.items()}
    assert set(read) == set(was) - {"relative", "zscore"}
    bits = bits_for(was["reference"], was["standard_error"])
    for name in ("image", "reference"):
        assert (np.abs(read[name] - was[name]) <= was["standard_error"] / 16).all()
        np.testing.assert_array_equal(read[name], significant(was[name], bits), "the file adds nothing to the rounding")
    np.testing.assert_allclose(read["standard_error"], was["standard_error"], rtol=0.032)
    inside = was["mask"] > 0.5
    error = np.where(inside[..., None], was["error"], 0.0)
    off = np.abs(read["error"] - error)
    assert (off <= 0.032 * np.abs(error) + was["standard_error"] / 4).all() and 0 < off.max()
    np.testing.assert_allclose(read["flip"], was["flip"], atol=1 / 512 + 1e-7)
    np.testing.assert_array_equal(read["mask"], was["mask"])
    np.testing.assert_array_equal(read["regions"], was["regions"])
    np.testing.assert_allclose(read["rung-0"][inside], was["rung-0"].mean(-1)[inside], atol=3 / 64)
    assert (read["rung-0"][~inside] == 0).all()


def test_bits_follow_the_noise():
    reference = np.full((4, 4, 3), 2.0)
    assert [bits_for(reference, s * reference) for s in (1.0, 2.0**-6, 2.0**-8, 1e-9, 0.0)] == [8, 10, 12, MOST, MOST]
    assert bits_for(reference, None) == MOST


def test_kept_and_fresh_pictures_are_alike(tmp_path, store):
    (cell,) = run(tmp_path / "out", {"a": store})
    fresh, own = store["image"], tmp_path / "out" / cell["images"]["image"]
    alike = exr.coarsest([fresh, own])
    assert not np.array_equal(exr.read(fresh), exr.read(own))
    np.testing.assert_array_equal(alike(exr.read(fresh)), alike(exr.read(own)))
    np.testing.assert_array_equal(exr.coarsest([fresh])(exr.read(fresh)), exr.read(fresh))


def test_what_a_killed_run_was_writing_goes(tmp_path, store):
    out, name = tmp_path / "out", ".new-a1_b2c3d"
    theirs = [out / "notes" / name, out / ".new-year", out / "cells" / "x" / ".new-year.webp"]
    left = [out / "index.html", out / "images" / "x" / "a.exr", out / "cells" / "x" / "a.webp", out / "rankings" / "a.png"]
    left = [path.with_name(name + path.suffix) for path in left]
    for path in (*theirs, *left):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"half")
    run(out, {"a": store})
    assert all(path.exists() for path in theirs) and not any(path.exists() for path in left)


def test_cells_share_their_reference(tmp_path, store):
    a, b = run(tmp_path / "out", {"a": store, "b": store})
    assert a["images"]["reference"] == b["images"]["reference"] == "images/references/0123456789abcdef/reference.exr"
    assert a["images"]["image"] != b["images"]["image"]
    assert len(list((tmp_path / "out").rglob("reference.exr"))) == 1


def test_unchanged_pictures_stay_and_gone_ones_go(tmp_path, store):
    out = tmp_path / "out"
    a, b = run(out, {"a": store, "b": store})
    times = {p: p.stat().st_mtime_ns for p in out.rglob("*.exr")}
    (a,) = run(out, {"a": store})
    assert not (out / b["images"]["image"]).exists() and (out / a["images"]["reference"]).exists()
    assert {p: p.stat().st_mtime_ns for p in out.rglob("*.exr")}.items() <= times.items()
    # Cells of an earlier run name the folder's own files.
    own = {name: out / place for name, place in a["images"].items()}
    before = {p: p.read_bytes() for p in out.rglob("*.exr")}
    assert run(out, {"a": own}) == [a] and {p: p.read_bytes() for p in out.rglob("*.exr")} == before
    exr.write(store["image"], RADIANCES * 2)
    run(out, {"a": store})
    np.testing.assert_allclose(exr.read(out / a["images"]["image"]), RADIANCES * 2, rtol=1e-3)


def test_a_reference_id_that_is_none_is_not_believed(tmp_path, store):
    for stated in ("../../../outside", "", None):
        places = kept.paths({"reference_id": stated}, store, "cell-00000000")
        assert places["reference"].startswith("images/references/") and ".." not in places["reference"]
        assert len(places["reference"].split("/")) == 4


def test_a_folder_that_is_not_ours_is_left_alone(tmp_path, store):
    foreign = tmp_path / "out" / "images" / "holiday-12345678"
    foreign.mkdir(parents=True)
    run(tmp_path / "out", {"a": store})
    assert foreign.is_dir()
