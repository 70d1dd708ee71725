"""Runs on a real Dask cluster of this machine: the same results from one worker and from several, whatever happens to them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("distributed")

import numpy as np
from small_scene import scene_xml

from benchmarks.local_dask import LocalDask, free_port
from evalsuite.errors import EvalsuiteError, MachineLacks, WorkerFailed
from evalsuite.execute import cluster, there
from evalsuite.scene import builtin
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import Store

TASKS = Path(__file__).parents[1] / "unit"  # where `crashing` is
WORDS = ("-t", "diffuse-sh9", "--size", "48x48", "--target-error", "0.005")


@pytest.fixture
def dask(tmp_path):
    made = []

    def make(workers: int = 2) -> LocalDask:
        made.append(LocalDask(tmp_path, workers, TASKS))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.fixture
def connected(dask, tmp_path):
    """Cluster to a fresh scheduler of two workers, and both."""
    there_ = dask()
    made = cluster.Cluster(there_.address, Store(tmp_path / "store"))
    yield made, there_
    made.close()


def command(tmp_path: Path, name: str, *words: object) -> tuple[list[str], dict[str, str]]:
    environment = os.environ | {"EVALSUITE_CACHE": str(tmp_path / f"cache-{name}"), "COLUMNS": "200"}
    scene = tmp_path / "own.xml"
    scene.write_text(scene_xml('<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'))
    (tmp_path / "map.exr").write_bytes(builtin.environment_path("sh2").read_bytes())
    run = ["run", "accuracy", "--scene", scene, *WORDS, "--out", tmp_path / name, *words]
    return [sys.executable, "-m", "evalsuite.cli", *map(str, run)], environment


def found(tmp_path: Path, name: str) -> dict:
    """All of a run that does not tell its time, and its references to the last bit."""
    results = json.loads((tmp_path / name / "results.json").read_text())
    cells = {}
    for cell in results["cells"]:
        assert cell["status"] == "scored", cell["message"]
        kept = ("metrics", "regions", "curves", "ledger", "reference_id", "reached_error", "certificate", "decided")
        cells[cell["id"]] = {key: cell[key] for key in kept} | {"spp": cell["cost"]["reference_spp"]}
    pictures = {}
    for entry in sorted((tmp_path / f"cache-{name}" / "reference").glob("*/*")):
        with np.load(entry / "halves.npz") as halves:
            pictures[entry.name] = [(entry / "reference.exr").read_bytes(), *(halves[k].tobytes() for k in halves)]
    assert len(cells) > 1 and len(pictures) > 1
    return {"cells": cells, "comparisons": results["comparisons"], "pictures": pictures}


def made(tmp_path: Path, name: str, *words: object) -> dict:
    line, environment = command(tmp_path, name, *words)
    done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stderr
    return found(tmp_path, name)


def test_the_same_from_one_and_from_many_even_when_one_is_killed(dask, tmp_path):
    alone = made(tmp_path, "alone")
    assert made(tmp_path, "jobs", "--jobs", "3") == alone
    one = dask(1)
    assert made(tmp_path, "one", "--scheduler", one.address) == alone
    one.start_worker()
    one.start_worker()
    one.wait(3)
    line, environment = command(tmp_path, "killed", "--scheduler", one.address)
    run = subprocess.Popen(line, env=environment, stderr=subprocess.PIPE, text=True)
    for victim in list(one.busy(2).values())[:1]:
        os.kill(victim, signal.SIGKILL)
    _, words = run.communicate(timeout=500)
    assert run.returncode == 0, words
    assert found(tmp_path, "killed") == alone
    assert sum(worker.poll() is not None for worker in one.workers) == 1


def test_a_native_abort_costs_its_own_task(connected):
    pool, _ = connected
    assert pool.width == 2
    tasks = [pool.submit("crashing:square", 3), pool.submit("crashing:abort"), pool.submit("crashing:square", 4)]
    assert (tasks[0].result(60), tasks[2].result(60)) == (9, 16)
    with pytest.raises(WorkerFailed, match=r"SIGABRT.*out of registers"):
        tasks[1].result(60)
    with pytest.raises(EvalsuiteError, match=r"scene\.xml: got a cube, expected a sphere"):
        pool.call("crashing:refuse")
    with pytest.raises(WorkerFailed, match="ModuleNotFoundError"):
        pool.call("no_such_module:square", 1)


def test_dead_workers_tasks_are_done_by_others(connected):
    pool, there_ = connected
    tasks = [pool.submit("crashing:slow_square", k, 1.0) for k in range(6)]
    os.kill(next(iter(there_.busy(2).values())), signal.SIGKILL)
    assert [task.result(60) for task in tasks] == [k * k for k in range(6)]


def test_one_that_dawdles_is_overtaken(connected, monkeypatch):
    monkeypatch.setattr(cluster, "DAWDLES_S", 2.0)
    pool, there_ = connected
    assert [pool.call("crashing:slow_square", k, 0.1) for k in range(4)] == [0, 1, 4, 9]
    task = pool.submit("crashing:slow_square", 5, 1.0)
    worker = next(iter(there_.busy(1).values()))
    started = time.monotonic()
    os.kill(worker, signal.SIGSTOP)
    try:
        assert task.result(60) == 25
    finally:
        os.kill(worker, signal.SIGCONT)
    assert time.monotonic() - started < 25  # Dask itself would wait five minutes for a worker that is silent


def test_a_scheduler_that_comes_back(connected):
    pool, there_ = connected
    tasks = [pool.submit("crashing:slow_square", k, 1.0) for k in range(6)]
    there_.busy(1)
    os.killpg(there_.scheduler.pid, signal.SIGKILL)
    there_.scheduler.wait()
    there_.start_scheduler()
    there_.start_worker()
    assert [task.result(100) for task in tasks] == [k * k for k in range(6)]
    assert pool._home is None and pool.call("crashing:square", 7) == 49


def test_a_scheduler_lost_for_good(connected, monkeypatch):
    monkeypatch.setattr(cluster, "RECONNECT_S", 2.0)
    monkeypatch.syspath_prepend(TASKS)
    pool, there_ = connected
    said = []
    pool._store.warn = said.append
    tasks = [pool.submit("crashing:slow_square", k, 0.5) for k in range(6)]
    there_.busy(1)
    os.killpg(there_.scheduler.pid, signal.SIGKILL)
    assert [task.result(100) for task in tasks] == [k * k for k in range(6)]
    assert pool.call("crashing:square", 7) == 49
    assert len(said) == 2 and "connection lost" in said[0] and "this machine alone" in said[1]


def test_who_is_closed_leaves_nobody_waiting(connected):
    pool, _ = connected
    task = pool.submit("crashing:hang")
    pool.close()
    with pytest.raises(WorkerFailed, match="interrupted"):
        task.result(10)


def test_nobody_there(evalsuite, tmp_path):
    done = evalsuite("run", "--scene", "torus", "--scheduler", f"tcp://127.0.0.1:{free_port()}", cwd=tmp_path)
    assert done.code == 2 and "dask scheduler" in done.err and "Traceback" not in done.err
    for words in (("--scheduler", "nonsense://x"), ("--scheduler", "tcp://127.0.0.1:9", "--jobs", 2)):
        done = evalsuite("run", "--scene", "torus", *words, cwd=tmp_path)
        assert done.code == 2 and len(done.err.strip().splitlines()) == 1, done.err


def test_without_dask(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MachineLacks, match="pip install"):
        cluster.Cluster("tcp://127.0.0.1:9", Store(tmp_path))


def test_paths_by_what_they_stand_for(tmp_path):
    """As on two machines: the store elsewhere, scenes that came with evalsuite, own scenes that must be the same."""
    shared = (tmp_path / "shared").as_uri()
    ours, theirs = Store(tmp_path / "ours", shared=shared), tmp_path / "theirs"
    before = Store(tmp_path / "ours", shared="")  # made before there was a shared store
    entry, _ = before.put("image", "ab" * 32, {}, lambda folder: (folder / "image.exr").write_text("x"))
    value = {"a": [str(entry)], "b": entry / "image.exr", "c": str(tmp_path), "d": "torus", "e": 3}
    travels = there.sent(value, ours)
    assert there.found(travels) == {"a": [entry], "b": entry / "image.exr", "c": str(tmp_path), "d": "torus", "e": 3}
    (tmp_path / "ours").rename(tmp_path / "not here")
    os.environ["EVALSUITE_CACHE"], before = str(theirs), os.environ.get("EVALSUITE_CACHE")
    try:
        got = there.found(travels)["b"]
        assert got.read_text() == "x" and got.is_relative_to(theirs)
        with pytest.raises(EvalsuiteError, match="EVALSUITE_SHARED"):
            there.found(there.Stored(tmp_path / "ours", "", "image", "cd" * 32))
    finally:
        os.environ.pop("EVALSUITE_CACHE") if before is None else os.environ.update(EVALSUITE_CACHE=before)
    torus = SceneSource(builtin.scenes_directory() / "torus.xml", builtin.environment_path("sh2"), (8, 8))
    travels = there.sent(torus, ours)
    assert travels.path == there.Shipped("torus.xml") and there.found(travels) == torus
    own = tmp_path / "own.xml"
    own.write_text(scene_xml())
    travels = there.sent(SceneSource(own), ours)
    assert there.found(travels) == SceneSource(own)
    own.write_text(scene_xml(parameters='<rgb name="reflectance" value="0.6"/>'))
    with pytest.raises(EvalsuiteError, match=r"own\.xml.*another scene"):
        there.found(travels)
    own.unlink()
    with pytest.raises(EvalsuiteError, match="same path"):
        there.found(travels)


def test_another_version_there():
    with pytest.raises(EvalsuiteError, match=r"mitsuba .* \(there 0\.1\).*install the same"):
        there.run({**there.code(), "mitsuba": "0.1"}, "crashing:square", 3)
