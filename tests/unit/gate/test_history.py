"""Every check leaves a line, and a row a cell."""

from __future__ import annotations

import json
import shutil
import sqlite3
from contextlib import closing
from io import StringIO

import pytest
from rich.console import Console
from synthetic import two

from evalsuite.commands_gate import Asked, Outlets, check
from evalsuite.errors import EvalsuiteError
from evalsuite.gate import history
from evalsuite.report import page
from evalsuite.store import results as store_results


@pytest.fixture
def checked(gate, monkeypatch):
    """checked(error) → the check of a run whose picture is so far off, all in one output folder."""
    monkeypatch.chdir(gate.home)
    (gate.home / "small.toml").write_text("[[group]]\nscenes = []\ntechniques = []\n")
    gate.bless({"one": (two.picture(0.05), two.reference(0))})

    def call(error: float, **outlets: object) -> tuple[dict, str]:
        folder, told = gate.home / "out", StringIO()
        gate.folder({"one": (two.picture(error), two.reference(0))}).rename(folder) if not folder.exists() else None
        fresh = gate.folder({"one": (two.picture(error), two.reference(0))})
        (folder / "results.json").write_text((fresh / "results.json").read_text())
        for file in fresh.glob("images/*/*.exr"):
            (folder / file.relative_to(fresh)).write_bytes(file.read_bytes())
        console = Console(file=told, width=200)
        return check("small.toml", gate.path, Asked(), folder, Outlets(**outlets), render=False, console=console), told.getvalue()

    return call


def test_checks_add_up(gate, checked):
    codes = [checked(error)[0]["exit_code"] for error in (0.05, 0.09, 0.03)]
    assert codes == [0, 1, 0]
    with closing(sqlite3.connect(gate.home / "out" / "history.sqlite")) as database:
        rows = database.execute(
            "SELECT exit_code, verdict, rel_rmse, low, high FROM checks JOIN cells USING (number) ORDER BY number"
        )
        found = rows.fetchall()
    assert [row[:2] for row in found] == [(0, "unchanged"), (1, "further"), (0, "closer")]
    for error, (*_, value, low, high) in zip((0.05, 0.09, 0.03), found, strict=True):
        assert low <= value <= high and value == pytest.approx(error, abs=0.01)


def test_a_damaged_history_is_told_and_fails_nothing(gate, checked):
    checked(0.05)
    (gate.home / "out" / "history.sqlite").write_bytes(b"no database " * 100)
    found, told = checked(0.05)
    assert found["exit_code"] == 0 and "history.sqlite: got file is not a database" in told
    with pytest.raises(EvalsuiteError, match="move it away"):
        history.append(gate.home / "out" / "history.sqlite", found, None)


def test_half_a_check_is_none(gate, checked):
    found, _ = checked(0.05)
    path = gate.home / "other.sqlite"
    with pytest.raises(EvalsuiteError):
        history.append(path, found | {"cells": found["cells"] * 2}, None)
    with closing(sqlite3.connect(path)) as database:
        assert database.execute("SELECT count(*) FROM checks").fetchone() == (0,)
    assert history.append(path, found, "abc") == 1


def test_the_page_has_the_trends_and_leads_to_them(gate, checked):
    folder = gate.home / "out"
    checked(0.05)
    assert (folder / "trends.html").exists() and not (folder / "index.html").exists(), "there was no page to lead from"
    page.write(store_results.read(folder), folder)
    (folder / "trends.html").unlink()
    checked(0.09)
    assert 'href="trends.html"' in (folder / "index.html").read_text(encoding="utf-8")
    found = json.loads((folder / "trends.json").read_text(encoding="utf-8"))
    assert [check["number"] for check in found["checks"]] == [1, 2]
    [series] = found["series"]
    assert series["cell"] == two.name("one") and [p["verdict"] for p in series["points"]] == ["unchanged", "further"]


def test_a_history_elsewhere_goes_on_in_a_fresh_folder(gate, checked):
    past = gate.home / "kept" / "history.sqlite"
    for _ in range(2):
        checked(0.05, history=past)
        shutil.rmtree(gate.home / "out")
    checked(0.05, history=past)
    assert not (gate.home / "out" / "history.sqlite").exists()
    assert len(json.loads((gate.home / "out" / "trends.json").read_text(encoding="utf-8"))["checks"]) == 3
