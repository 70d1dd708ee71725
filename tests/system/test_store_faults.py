"""A damaged, read-only or full store, two runs at once: the next run, or both, end with the very same results."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from bench import Bench
from steady import different, facts


@pytest.fixture(scope="module")
def warm(tmp_path_factory) -> tuple[Bench, dict]:
    """A bench whose store has everything, and what its results are. Its report is that of all tests here."""
    bench = Bench(tmp_path_factory.mktemp("bench"))
    return bench, bench.complete()[0]


@pytest.fixture
def bench(tmp_path, warm) -> Bench:
    """A bench of one's own, with a copy of that store."""
    shutil.copytree(warm[0].cache, tmp_path / "cache")
    return Bench(tmp_path, warm[0].folder)


@pytest.fixture
def cold(tmp_path, warm) -> Bench:
    """A bench of one's own, with an empty store."""
    (tmp_path / "cache").mkdir()
    return Bench(tmp_path, warm[0].folder)


@pytest.fixture
def expected(warm) -> dict:
    return warm[1]


@contextmanager
def mounted(folder: Path, *options: str) -> Iterator[None]:
    """A mount that only root can make."""
    if os.geteuid() != 0 or subprocess.run(["mount", *options, str(folder)], capture_output=True).returncode != 0:
        pytest.skip("needs to mount a file system")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    with mounted(folder, "--bind", str(folder)):
        subprocess.run(["mount", "-o", "remount,bind,ro", str(folder)], check=True)
        yield


def errors(bench: Bench) -> list[str]:
    return [line for line in bench.said().splitlines() if line.startswith("error: ")]


def warnings(bench: Bench) -> list[str]:
    return [line for line in bench.said().splitlines() if line.startswith("warning: ")]


def test_two_cold_stores_are_alike(cold, expected):
    found, _ = cold.complete()
    assert not different(found, expected)
    assert len([name for name in expected if name.endswith(".exr")]) > 10 and len(expected) > 500


def test_damaged_entries_are_named_and_made_anew(bench, expected):
    paths = [
        next(bench.cache.glob(p)) for p in ("reference/*/*/reference.exr", "comparison/*/*/meta.json", "seen/*/*/gbuffer.npz")
    ]
    for path in paths:
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data)
    found = bench.verify()
    assert found.returncode == 1 and "3 damaged" in found.stdout
    assert all(f"{path}: found " in found.stdout for path in paths)
    assert not different(bench.complete()[0], expected)
    assert len(warnings(bench)) == 3 and all(str(path) in bench.said() for path in paths)
    assert bench.verify().returncode == 0


def test_upkeep_by_commands(bench):
    entries = bench.inodes()
    would = json.loads(bench.upkeep("prune", "--max-size", "0", "--dry-run", "--json").stdout)
    assert would["removed"] == len(entries) > 5 and would["after"] == 0 and bench.inodes() == entries
    half = json.loads(bench.upkeep("prune", "--max-size", f"{would['before'] // 2}", "--json").stdout)
    assert half["after"] <= would["before"] // 2 and len(entries) - half["removed"] == len(bench.inodes()) > 0
    place = next(iter(bench.inodes()))
    (place / "meta.json").write_text("{}")
    found = json.loads((done := bench.upkeep("verify", "--remove", "--json")).stdout)
    assert done.returncode == 1 and [row["file"] for row in found["damaged"]] == [str(place / "meta.json")]
    assert not place.exists() and bench.verify().returncode == 0
    wrong = bench.upkeep("prune", "--max-size", "much")
    assert wrong.returncode == 2 and wrong.stderr.count("\n") == 1 and "--max-size much" in wrong.stderr


def test_a_warm_read_only_store_is_read(bench, expected):
    with read_only(bench.cache):
        assert not different(bench.complete()[0], expected)
    assert len(warnings(bench)) == 1 and "Read-only file system" in warnings(bench)[0]
    assert not bench.leftovers()


@pytest.mark.slow
def test_a_cold_read_only_store_is_done_without(cold, expected):
    with read_only(cold.cache):
        assert not different(cold.complete()[0], expected)
    assert len(warnings(cold)) == 1 and "not kept" in warnings(cold)[0]
    assert not list(cold.cache.iterdir())


@contextmanager
def nearly_full(folder: Path, need: int) -> Iterator[Path]:
    """A disk of its own with space for `need` bytes left; gives the file to remove for more."""
    with mounted(folder, "-t", "tmpfs", "-o", f"size={16 << 20}", "tmpfs"):
        space, ballast = os.statvfs(folder), folder / "ballast"
        ballast.write_bytes(bytes((space.f_bavail * space.f_frsize - need) // 4096 * 4096))
        yield ballast


def occupied(folder: Path) -> int:
    return sum(path.stat().st_blocks * 512 for path in folder.rglob("*"))


@pytest.mark.parametrize("left", [pytest.param(0, marks=pytest.mark.slow), 0.5])
def test_a_full_disk_under_the_store(cold, warm, expected, left):
    with nearly_full(cold.cache, int(left * occupied(warm[0].cache))) as ballast:
        assert cold.start().wait(timeout=300) == 2
        assert len(errors(cold)) == 1 and str(cold.cache) in errors(cold)[0] and "Traceback" not in cold.said()
        assert not cold.leftovers() and not (cold.out / "results.json").exists()
        stored = cold.inodes()
        assert bool(stored) == bool(left) and cold.verify().returncode == 0
        ballast.unlink()
        assert not different(cold.complete()[0], expected)
        assert stored.items() <= cold.inodes().items()


@pytest.mark.parametrize("left", [pytest.param(0, marks=pytest.mark.slow), 0.5])
def test_a_full_disk_under_the_output(bench, warm, expected, left):
    bench.out.mkdir()
    with nearly_full(bench.out, int(left * occupied(warm[0].out / "images"))) as ballast:
        assert bench.start().wait(timeout=300) == 2
        assert len(errors(bench)) == 1 and str(bench.out) in errors(bench)[0] and "Traceback" not in bench.said()
        assert not (bench.out / "results.json").exists() and not list(bench.out.rglob(".*-*"))
        ballast.unlink()
        assert not different(bench.complete()[0], expected)


@pytest.mark.parametrize("same_folder", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_two_runs_at_once(cold, expected, same_folder):
    outs = [cold.out, cold.out if same_folder else cold.folder / "other"]
    runs = [cold.start(out) for out in outs]
    assert [run.wait(timeout=500) for run in runs] == [0, 0], cold.said()
    for out in outs:
        assert not different(facts(out), expected)
    assert not cold.leftovers() and cold.verify().returncode == 0
