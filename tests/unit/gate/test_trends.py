"""The history read, and what trends make of it."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gate import history
from evalsuite.gate.trends import LAST, trends

MESA, OTHER = "llvmpipe", "NVIDIA H100"


def row(name, value, half, seed=0, verdict="unchanged"):
    now = None if value is None else {"value": value, "ci95": [None if half is None else value - half, value + (half or 0)]}
    return {"id": name, "verdict": verdict, "metrics": {"rel_rmse": {"now": now}}, "picture_change": None, "seed": seed}


def add(path, rows, renderer=MESA, report="small"):
    """One more check."""
    number = len(history.read(path, report, 10**6)) + 1
    check = {
        "created": f"2026-01-{number:02d}",
        "report": report,
        "host": {"gl_renderer": renderer},
        "passed": True,
        "exit_code": 0,
    }
    return history.append(path, check | {"cells": rows}, f"commit{number}")


def made(path, **given):
    return trends("small", history.read(path, "small", given.get("last", LAST)))


@pytest.fixture
def past(tmp_path):
    return tmp_path / "deep" / "history.sqlite"


def test_a_step_is_told_with_its_size_and_commits(past):
    for k in range(20):
        add(past, [row("a", 0.0410 if k < 16 else 0.0500, 0.001, seed=k), row("b", 0.03, 0.001, seed=k)])
    found = made(past)
    assert [one["cell"] for one in found["series"]] == ["a", "b"] and found["series"][1]["changes"] == []
    [change] = found["series"][0]["changes"]
    facts = {name: change[name] for name in ("check", "after", "commit", "after_commit", "verdict")}
    assert facts == {"check": 17, "after": 16, "commit": "commit17", "after_commit": "commit16", "verdict": "unchanged"}
    assert change["from"]["value"] == pytest.approx(0.041) and change["to"]["value"] == pytest.approx(0.05)
    low, high = change["difference"]["ci95"]
    # Sixteen and four independent measurements of ± 0.001.
    assert (high - low) / 2 == pytest.approx(0.001 * (1 / 16 + 1 / 4) ** 0.5, rel=0.01)
    assert (low + high) / 2 == pytest.approx(0.009) == change["difference"]["value"]
    assert [(one["first"], one["last"]) for one in found["series"][0]["levels"]] == [(1, 16), (17, 20)]


def test_without_noise_drift_is_no_change_and_more_is(past):
    for value in (0.05, 0.05 + 1e-5, 0.05, 0.05 - 1e-5, 0.0502, 0.0502):
        add(past, [row("a", value, 0.0)])
    [change] = made(past)["series"][0]["changes"]
    assert change["check"] == 5


def test_each_renderer_is_a_series(past):
    for k in range(6):
        add(past, [row("a", 0.05 if k % 2 else 0.06, 0.0)], MESA if k % 2 else OTHER)
    series = made(past)["series"]
    assert [(one["gl_renderer"], one["changes"], len(one["points"])) for one in series] == [(MESA, [], 3), (OTHER, [], 3)]


def test_the_latest_change_comes_first(past):
    for k in range(8):
        add(past, [row("z", 0.05 + 0.01 * (k >= 6), 0.0), row("m", 0.05 + 0.01 * (k >= 3), 0.0), row("a", 0.05, 0.0)])
    assert [one["cell"] for one in made(past)["series"]] == ["z", "m", "a"]


def test_gaps_and_open_ends(past):
    for k in range(6):
        value, half = (None, 0.0) if k == 2 else (0.9, None) if k == 3 else (0.05 if k < 2 else 0.06, 0.0)
        add(past, [row("a", value, half, verdict="failed" if value is None else "unchanged"), row("never", None, None)])
    [series] = made(past)["series"]
    assert [p["check"] for p in series["points"]] == [1, 2, 4, 5, 6]
    [change] = series["changes"]
    assert (change["after"], change["check"]) == (2, 5), "the one whose interval is open decides nothing"


def test_only_the_last_checks_and_one_report(past):
    for k in range(9):
        add(past, [row("a", 0.05, 0.0)])
        add(past, [row("other", 0.05 + k, 0.0)], report="another")
    found = made(past, last=4)
    assert len(found["checks"]) == 4 and [one["cell"] for one in found["series"]] == ["a"]
    assert [check.created for check in history.read(past, "small", 4)] == [f"2026-01-{k:02d}" for k in range(6, 10)]
    assert made(past.with_name("none.sqlite"))["series"] == []


def test_a_history_of_an_earlier_version_goes_on(past):
    past.parent.mkdir()
    with closing(sqlite3.connect(past)) as database, database:
        database.executescript(history.TABLES.replace(", seed INTEGER", ""))
        database.execute("INSERT INTO checks VALUES (1, '2025', 'small', 'old', 'llvmpipe', 1, 0)")
        database.execute("INSERT INTO cells VALUES (1, 'a', 'unchanged', 0.05, 0.05, 0.05, NULL)")
    assert history.read(past, "small", 9)[0].cells["a"] == ("unchanged", 0.05, 0.05, 0.05, None)
    add(past, [row("a", 0.06, 0.0, seed=3)])
    first, second = history.read(past, "small", 9)
    assert (first.cells["a"].seed, second.cells["a"].seed) == (None, 3)
    assert [c["check"] for c in made(past)["series"][0]["changes"]] == [2]


def test_what_is_no_history_is_refused(past):
    past.parent.mkdir()
    past.write_bytes(b"no database " * 100)
    with pytest.raises(EvalsuiteError, match="move it away"):
        history.read(past, "small", 9)
    past.write_bytes(b"")
    with pytest.raises(EvalsuiteError, match="no such table"):
        history.read(past, "small", 9)
