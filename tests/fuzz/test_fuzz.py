"""Damaged files: each is read, or refused in one line; none ends the process, holds it up or takes its memory."""

from __future__ import annotations

import pytest
from crew import fuzz
from damage import data, mutated
from readers import READERS

#: Files a format, in every run of the tests and in the slow ones: those that Mitsuba reads take longest.
FEW = {name: 10 if name.endswith(("-texture", "scene", "ply", "obj", "serialized", "results")) else 60 for name in READERS}
MANY = {name: 1500 if name.endswith(("-texture", "scene", "ply", "obj", "serialized", "results")) else 5000 for name in READERS}


@pytest.mark.parametrize("name", READERS)
def test_a_few_damaged_files(name):
    tally = fuzz(name, range(FEW[name]))
    assert not tally.findings, tally.findings
    assert tally.accepted + tally.refused == FEW[name] and tally.refused > 0


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", READERS)
def test_thousands_of_damaged_files(name):
    tally = fuzz(name, range(10_000, 10_000 + MANY[name]))
    print(tally)
    assert not tally.findings, tally.findings


@pytest.mark.parametrize(
    ("how", "what"),
    [
        ("crash", "exit code -6"),
        ("hang", "hung for 1 s"),
        ("memory", "memory"),
        ("exception", "raised ZeroDivisionError"),
        ("lines", "more than one line"),
    ],
)
def test_the_harness_sees(monkeypatch, how, what):
    """Every kind of failure that it is there to find, by its seed."""
    monkeypatch.setenv("FUZZ_FAULT", how)
    # Only the hang is to be waited for: to take memory needs time of its own on a busy machine.
    tally = fuzz("fault", range(3), seconds=1.0 if how == "hang" else 20.0)
    assert (tally.accepted, [seed for seed, _ in tally.findings]) == (2, [1])
    assert what in tally.findings[0][1]


def test_the_same_seed_damages_alike():
    corpus = [bytes(range(256)) * 4]
    assert mutated(data, 5, corpus) == mutated(data, 5, corpus) != mutated(data, 6, corpus)
