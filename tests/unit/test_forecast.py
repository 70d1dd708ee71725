"""What a run will take: made-up histories whose law is known, and files that are not whole."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from evalsuite import forecast
from evalsuite.settings import Settings
from evalsuite.store import costs

RATE, START = 2e-7, 1.5


def reference(error, pixels=4096, difficulty=0.2):
    spp = difficulty / error**2
    return {"kind": "reference", "scene": "s", "environment": "e", "target": "t", "bsdf": "b", "pixels": pixels, "spp": spp,
            "reached_error": error, "seconds": START + RATE * spp * pixels}  # fmt: skip


def run(fresh, reference_s, pixels=65536, noise=1.0):
    wall = noise * (5.0 + 0.8 * fresh + 10.0 * fresh * pixels / 1e6 + 1.1 * reference_s)
    return {"kind": "run", "wall": wall, "reference_s": reference_s, "fresh": fresh, "cells": fresh, "pixels": fresh * pixels,
            "bytes": 40.0 * fresh * pixels}  # fmt: skip


def test_runs_weigh_start_cells_pixels_and_references():
    rng = np.random.default_rng(0)
    made = [run(int(rng.integers(1, 60)), float(rng.uniform(5, 900)), int(rng.choice([4096, 65536]))) for _ in range(12)]
    for row in (run(30, 400.0), run(80, 1500.0)):
        assert forecast._time(row, made) == pytest.approx(row["wall"], rel=0.05)
    assert forecast._scatter(made, forecast._time) == 0.3
    wild = [run(10, 100.0, noise=float(np.exp(rng.normal(0, 1)))) for _ in range(12)]
    assert forecast._scatter(wild, forecast._time) > 0.6
    assert forecast._per_pixel(made) == pytest.approx(40.0) and forecast._per_pixel([]) == 0.0
    value, low, high = forecast._ranged(100.0, 0.3)
    assert low * high == pytest.approx(value**2) and 1.5 < high / value < 1.8


def test_what_earlier_runs_wrote_is_read_and_what_is_broken_passed_over(tmp_path):
    assert costs.read(tmp_path) == []
    costs.append(tmp_path / "store", [reference(0.02)])
    costs.append(tmp_path / "store", [run(1, 2.0)])
    with (tmp_path / "store" / costs.NAME).open("ab") as file:
        file.write(b'{"kind": "run", "wa\n[1]\n\xff\xfe\n' + b"[" * 100_000 + b"\n")
    rows = costs.read(tmp_path / "store")
    assert [row["kind"] for row in rows] == ["reference", "run"]
    assert forecast._whole(rows[0], "reference") and forecast._whole(rows[1], "run")
    assert not forecast._whole({"kind": "run", "wall": "long"}, "run") and not forecast._whole({"kind": "run"}, "run")


def test_references_of_other_clusters_count_by_their_cores(tmp_path):
    rows = [reference(0.02) | {"cores": 8}, reference(0.02) | {"cores": 2}, reference(0.02)]  # the last of before
    costs.append(tmp_path, rows)
    workers = SimpleNamespace(passes=SimpleNamespace(cores=4))
    here = SimpleNamespace(store=SimpleNamespace(root=tmp_path), costs=[], workers=workers, settings=Settings())
    found, _ = forecast.known(here)
    assert [row["seconds"] / rows[0]["seconds"] for row in found] == [2.0, 0.5, 1.0]
    here.settings = Settings(worst_error=0.1)  # whose samples follow another law
    costs.append(tmp_path, [reference(0.02) | {"worst_error": 0.1}])
    assert [row["worst_error"] for row in forecast.known(here)[0]] == [0.1]


def test_what_took_long_beside_other_work_counts_as_if_alone():
    quiet = [reference(0.02) | {"cores": 2, "seconds": 10.0, "processor": 19.0} for _ in range(8)]
    busy = [reference(0.02) | {"cores": 2, "seconds": 16.0, "processor": 19.0} for _ in range(8)]
    before = reference(0.02) | {"cores": 2, "seconds": 12.0}  # a line that does not say
    here, _ = forecast.alone([*quiet, *busy, before], [], 2)
    assert [row["seconds"] for row in here] == pytest.approx([10.0] * 16 + [12.0])
    there, runs = forecast.alone([*quiet, *busy], [run(1, 50.0) | {"processor": 76.0, "cores": 4}, run(1, 50.0)], 4)
    assert [row["seconds"] for row in there] == pytest.approx([5.0] * 16)
    assert runs[0]["reference_s"] == pytest.approx(20.0), "on the cores of its run, 95 % of them busy"
    assert runs[1]["reference_s"] == run(1, 50.0)["reference_s"]


def test_the_file_does_not_grow_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr(costs, "LATEST", 2000)
    for number in range(100):
        costs.append(tmp_path, [{"kind": "run", "number": number}])
    assert (tmp_path / costs.NAME).stat().st_size <= 4000 + 50
    rows = costs.read(tmp_path)
    assert rows[-1]["number"] == 99 and [r["number"] for r in rows] == list(range(100 - len(rows), 100)) and len(rows) > 20


def test_in_words():
    found = {
        "cells": 9,
        "made": 7,
        "references": 5,
        "samples": [2.5e9, 1e9, 6e9],
        "seconds": [95.0, 50.0, 7300.0],
        "bytes": [1e7, 5e6, 2e7],
    }
    assert forecast.in_words(json.loads(json.dumps(found))) == (
        "7 of 9 cells to make, 5 references of 2.5 billion [1 billion … 6 billion] samples in all: "
        "1 min 35 s [50 s … 2.0 h], 10 MB [5 MB … 20 MB]"
    )
    assert "in the store" in forecast.in_words(found | {"made": 0})
