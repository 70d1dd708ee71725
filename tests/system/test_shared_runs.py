"""Machines with stores of their own and one shared: what one rendered the other takes, and no trouble there changes a result."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from bench import Bench
from steady import different

from evalsuite.store import costs

pytest.importorskip("fsspec")


@pytest.fixture(scope="module")
def first(tmp_path_factory) -> tuple[Bench, Path, dict]:
    """A machine that has made a report, what it shared, and its results."""
    folder = tmp_path_factory.mktemp("first")
    bench, common = Bench(folder), folder / "common"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EVALSUITE_SHARED", str(common))
        return bench, common, bench.complete()[0]


@pytest.fixture
def second(first, tmp_path) -> Bench:
    """Another machine with an empty store, for the same report."""
    return Bench(tmp_path, first[0].folder)


def warnings(bench: Bench) -> list[str]:
    return [line for line in bench.said().splitlines() if line.startswith("warning: ")]


def cached(bench: Bench) -> list[bool]:
    return [cell["cost"]["cached"] for cell in json.loads((bench.out / "results.json").read_text())["cells"]]


def test_the_second_machine_renders_nothing(first, second, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", first[1].as_uri())
    assert not different(second.complete()[0], first[2])
    assert cached(second) == [True, True] and warnings(second) == []
    assert not [row for row in costs.read(second.cache) if row["kind"] == "reference"], "no sample was taken"
    ours, theirs = ({str(path.relative_to(bench.cache)) for path in bench.inodes()} for bench in (second, first[0]))
    assert ours == theirs and len(ours) > 5 and second.verify().returncode == 0 and not second.leftovers()


@pytest.mark.slow
def test_no_cache_reads_nothing_of_it(first, second, tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", str(common := tmp_path / "common"))
    subprocess.run(["cp", "-r", str(first[1]), str(common)], check=True)
    archives = [*common.glob("reference/*/*.zip"), *common.glob("image/*/*.zip")]
    before = {path: path.stat().st_ino for path in archives}
    assert not different(second.complete(None, "--no-cache")[0], first[2])
    assert cached(second) == [False, False]
    assert len(before) > 2 and not before.items() & {path: path.stat().st_ino for path in archives}.items(), "and writes all"


def test_damage_there_is_made_anew_and_mended(first, second, tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", str(common := tmp_path / "common"))
    subprocess.run(["cp", "-r", str(first[1]), str(common)], check=True)
    for archive in (found := [*common.glob("reference/*/*.zip")]):
        archive.write_bytes(archive.read_bytes()[:-1000])
    assert len(found) == 2 and not different(second.complete()[0], first[2])
    assert len(warnings(second)) == 1 and "damaged (" in warnings(second)[0]
    third = Bench(tmp_path / "third", first[0].folder)
    third.folder.mkdir()
    assert not different(third.complete()[0], first[2])
    assert cached(third) == [True, True] and warnings(third) == []


@pytest.mark.slow
def test_a_killed_run_leaves_whole_entries(first, second, tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", str(common := tmp_path / "common"))
    assert second.kill(lambda: len([*common.glob("*/*/*.zip")]) > 3) != "ended before"
    third = Bench(tmp_path / "third", first[0].folder)
    third.folder.mkdir()
    assert not different(third.complete()[0], first[2]) and warnings(third) == []
    assert not different(second.complete()[0], first[2]) and warnings(second) == []


def test_a_full_disk_there(first, second, tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", str(common := tmp_path / "common"))
    common.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(common)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("needs to mount a file system")
    try:
        assert not different(second.complete()[0], first[2])
    finally:
        subprocess.run(["umount", str(common)], check=True)
    assert 1 <= len(warnings(second)) <= 2 and "No space left on device" in warnings(second)[0]
    assert not second.leftovers()


def test_a_wrong_address_is_one_line(second, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", "nosuch://anna:hunter2@bucket")
    assert second.start().wait(timeout=100) == 2
    said = second.said().strip().splitlines()
    assert len(said) == 1 and said[0].startswith("error: EVALSUITE_SHARED nosuch://bucket") and "hunter2" not in said[0]
    assert not second.out.exists() or not (second.out / "results.json").exists()


def test_info_and_share(first, tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_SHARED", str(tmp_path / "common"))
    bench = first[0]
    info = json.loads(bench.upkeep("info", "--json").stdout)["shared"]
    assert info == {"url": str(tmp_path / "common"), "entries": 0, "megabytes": 0.0, "problem": None}
    sent = json.loads(bench.upkeep("share", "--json").stdout)
    assert sent == {"url": str(tmp_path / "common"), "sent": len(bench.inodes()), "problems": []}
    assert json.loads(bench.upkeep("share", "--json").stdout)["sent"] == 0
    said = bench.upkeep("info").stdout
    assert f"{sent['sent']} entries" in said.splitlines()[-1] and str(tmp_path / "common") in said.splitlines()[-1]
    monkeypatch.setenv("EVALSUITE_SHARED", "")
    assert bench.upkeep("share").returncode == 2 and json.loads(bench.upkeep("info", "--json").stdout)["shared"] is None
    monkeypatch.setenv("EVALSUITE_SHARED", str(bench.folder / "small.xml" / "x"))  # a file in the way
    failed = bench.upkeep("share")
    assert failed.returncode == 1 and "warning: shared store" in failed.stderr and "Traceback" not in failed.stderr
