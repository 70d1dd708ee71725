"""The figures' lock: every number names what it rests on, and what moved is told from noise."""

from __future__ import annotations

import copy
import json

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.report.figures import lock

NUMBERS = {
    "id": "f", "title": "F", "ratio": 4.0, "angles": [10.0, 20.0], "fps": {"value": 3.0, "ci95": [2.0, 4.0], "timing": True},
    "seam": {"value": 2.0, "ci95": [1.5, 2.5]}, "flag": True,
    "cells": {"s/t/a=1/u": {"status": "scored", "rel_rmse": {"value": 0.1, "ci95": [0.09, 0.12]}}},
}  # fmt: skip
ASKED = {"target_error": 0.02, "cap": 4096, "size": None, "env": {}, "mesh": {}}
RESULTS = {"s/t/a=1/u": {"image": "aa", "reference": "bb"}}


def entry(change=lambda numbers: None, results=RESULTS):
    numbers = copy.deepcopy(NUMBERS)
    change(numbers)
    return lock.entry(numbers, results)


def test_every_number_rests_on_a_result():
    made = entry()
    assert set(made["numbers"]) == {"ratio", "angles/0", "angles/1", "seam", "cells/s/t/a=1/u/rel_rmse"}
    assert all(set(row["behind"]) <= set(made["results"]) and row["behind"] for row in made["numbers"].values())
    computed = lock.entry(NUMBERS, {})
    assert computed["numbers"]["ratio"]["behind"] == ["computed"]
    other = lock.entry({**NUMBERS, "ratio": 4.1}, {})
    assert computed["results"] != other["results"]


def test_the_same_again_reproduces():
    assert lock.check("f", entry(), entry()).verdict == lock.SAME
    slow = entry(lambda numbers: numbers["fps"].update(value=1.0))
    assert lock.check("f", entry(), slow).verdict == lock.SAME


@pytest.mark.parametrize(("change", "moved"), [
    (lambda n: n.update(ratio=4.001), ["ratio: 4 → 4.001"]),
    (lambda n: n["angles"].append(30.0), ["angles/2: new"]),
    (lambda n: n["cells"].clear(), ["cells/s/t/a=1/u/rel_rmse: gone"]),
    (lambda n: n["seam"].update(value=3.5, ci95=[3.2, 3.8]), ["seam: 2 → 3.5"]),
    (lambda n: n["seam"].update(value=None, ci95=[None, None]), ["seam: 2.0 → None"]),
])  # fmt: skip
def test_what_moved_no_longer_reproduces(change, moved):
    found = lock.check("f", entry(), entry(change))
    assert found.verdict == lock.MOVED and list(found.changes) == moved


def test_other_noise_is_noise():
    """Another driver's picture, and numbers within their intervals."""
    other = {"s/t/a=1/u": {"image": "cc", "reference": "bb"}}
    again = entry(lambda n: n["seam"].update(value=2.6, ci95=[2.1, 3.1]), other)
    found = lock.check("f", entry(), again)
    assert found.verdict == lock.NOISE and list(found.results) == ["s/t/a=1/u"] and not found.changes
    assert lock.check("f", entry(), entry(lambda n: n.update(ratio=4.0 + 1e-9))).verdict == lock.SAME


def test_other_figures_stay_only_if_they_were_asked_for_alike(tmp_path):
    lock.write(tmp_path, ASKED, {"a": entry()})
    lock.write(tmp_path, ASKED, {"b": entry()})
    assert set(lock.read(tmp_path / lock.NAME)["figures"]) == {"a", "b"}
    lock.write(tmp_path, ASKED | {"size": [48, 48]}, {"b": entry()})
    assert set(lock.read(tmp_path / lock.NAME)["figures"]) == {"b"}
    (tmp_path / lock.NAME).write_text("{")
    lock.write(tmp_path, ASKED, {"a": entry()})
    assert set(lock.read(tmp_path / lock.NAME)["figures"]) == {"a"}


@pytest.mark.parametrize("text", [
    "", "{}", "[]", "\0", '{"schema": "evalsuite.figures/2", "figures": {}, "asked": {}}',
    *(json.dumps({"schema": lock.SCHEMA, "asked": ASKED | wrong, "figures": {}})
      for wrong in ({"size": [0, 4]}, {"target_error": 2}, {"env": {"grace": {}}}, {"mesh": []}, {"cap": "4096"})),
    *(json.dumps({"schema": lock.SCHEMA, "asked": ASKED, "figures": {"002-fig3": wrong}})
      for wrong in ({}, [], {"numbers": {"a": 1}, "results": {}}, {"numbers": {"a": {"value": "1"}}, "results": {}},
                    {"numbers": {"a": {"value": 1, "ci95": [1]}}, "results": {}})),
])  # fmt: skip
def test_what_is_no_lock_says_so(tmp_path, text):
    place = tmp_path / lock.NAME
    place.write_text(text)
    with pytest.raises(EvalsuiteError, match=r"figures\.lock\.json"):
        lock.read(place)
    with pytest.raises(EvalsuiteError, match="no such file"):
        lock.read(tmp_path / "gone" / lock.NAME)
    assert json.loads(json.dumps(entry())) == entry()
