"""The frame of `script/bench`: figures, limits, table, file, exit code. No time is measured here but of sleeping."""

import json
import math
import sys
import time
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

import benchmarks
from benchmarks import __main__ as program
from benchmarks import frames, timing
from benchmarks.figure import Figure, Limit, NotMeasured
from benchmarks.table import limit, table, value
from evalsuite.execute.local import Lane


def figure(number, limit_=None, ends=None, **more):
    return Figure("a figure", number, ends or (number, number), 3, limit=limit_, **more)


@pytest.mark.parametrize(
    "number, ends, bound, says",
    [
        (1.1, (1.0, 1.14), Limit(1.15), "kept"),
        (1.1, (1.0, 1.2), Limit(1.15), "≈ kept"),
        (1.2, (1.1, 1.3), Limit(1.15), "≈ missed"),
        (1.3, (1.2, 1.4), Limit(1.15), "missed"),
        (1.15, (1.15, 1.15), Limit(1.15), "kept"),
        (600.0, (550.0, 700.0), Limit(500.0, least=True), "kept"),
        (499.0, (480.0, 520.0), Limit(500.0, least=True), "≈ missed"),
        (9.0, (8.0, 10.0), None, ""),
    ],
)
def test_verdicts(number, ends, bound, says):
    found = figure(number, bound, ends)
    assert found.verdict == says
    assert found.missed == says.endswith("missed")


def test_a_ratio_is_of_rounds_and_its_interval_students():
    # Two rounds whose logarithms are ln 2 ∓ d: t(0.975, 1) = 12.706, half width 12.706 · d √2 / √2.
    d = 0.01
    found, (low, high) = timing.ratio([2.0 * math.exp(-d), 6.0 * math.exp(d)], [1.0, 3.0])
    assert found == pytest.approx(2.0)
    assert math.log(high / 2.0) == pytest.approx(12.7062 * d, rel=1e-4)
    assert math.log(low / 2.0) == pytest.approx(-12.7062 * d, rel=1e-4)


def test_intervals_hold_the_true_ratio_in_95_percent():
    rng = np.random.default_rng(5)
    logs = rng.normal(np.log(1.1), 0.1, (2000, 5))
    held = sum(low <= 1.1 <= high for _, (low, high) in (timing.mean(np.exp(row)) for row in logs)) / len(logs)
    assert held == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / len(logs)))


def test_a_single_round_has_no_interval():
    with pytest.raises(ValueError, match="single round"):
        timing.mean([1.0])


def test_both_sides_are_timed_in_turns_and_the_warm_up_is_not_counted():
    said = []
    ours, theirs = timing.rounds_of(lambda: said.append("a") or time.sleep(0.03), lambda: said.append("b"), 2)
    assert "".join(said) == "ab" + "ab" + "ba"
    assert len(ours) == len(theirs) == 2
    assert min(ours) >= 0.03 > max(theirs)


@pytest.fixture
def fake(monkeypatch, tmp_path):
    """Benchmarks by name, and a run of them: (exit code, what the file then holds)."""

    def run(arguments=(), **made):
        monkeypatch.setattr(program, "NAMES", tuple(made))
        for name, measure in made.items():
            monkeypatch.setitem(sys.modules, f"benchmarks.{name}", SimpleNamespace(TITLE=f"title of {name}", measure=measure))
        path = tmp_path / "kept" / "benchmarks.json"
        code = program.main([*arguments, "--json", str(path)])
        return code, json.loads(path.read_text()) if path.exists() else None

    return run


def test_kept_limits_end_with_0_and_are_written_down(fake, capsys):
    code, kept = fake(quickly=lambda quick: [figure(0.1, Limit(0.3), (0.09, 0.12), unit="s", beside="bare 0.01 s")])
    assert code == 0
    assert kept["quickly"]["figures"][0] == {
        "what": "a figure", "value": 0.1, "ci95": [0.09, 0.12], "rounds": 3, "unit": "s",
        "limit": {"value": 0.3, "least": False}, "beside": "bare 0.01 s", "verdict": "kept",
    }  # fmt: skip
    assert kept["quickly"]["title"] == "title of quickly" and kept["quickly"]["machine"]["cores"] >= 1
    assert "0.1 [0.09, 0.12] s" in capsys.readouterr().out


def test_one_missed_limit_ends_with_1(fake):
    code, kept = fake(
        good=lambda quick: [figure(1.0, Limit(2.0))], bad=lambda quick: [figure(1.0, Limit(2.0)), figure(3.0, Limit(2.0))]
    )
    assert code == 1
    assert [f["verdict"] for f in kept["bad"]["figures"]] == ["kept", "missed"]


def test_a_figure_without_a_limit_misses_none(fake):
    assert fake(page=lambda quick: [figure(1e9)])[0] == 0


def test_what_cannot_be_measured_is_said_and_misses_nothing(fake, capsys):
    def measure(quick):
        raise NotMeasured("no GPU here")

    code, kept = fake(frames=measure)
    assert code == 0 and kept["frames"]["figures"] == [] and kept["frames"]["not_measured"] == "no GPU here"
    assert "no GPU here" in capsys.readouterr().out


def test_names_choose_and_the_others_records_stay(fake):
    asked = []
    made = {name: lambda quick, n=name: asked.append((n, quick)) or [figure(1.0)] for name in ("one", "two")}
    fake(**made)
    _, kept = fake(["two", "--quick"], **made)
    assert asked == [("one", False), ("two", False), ("two", True)]
    assert not kept["one"]["quick"] and kept["two"]["quick"]


def test_an_unknown_name_ends_with_2(fake, capsys):
    code, kept = fake(["tow"], two=lambda quick: [])
    assert code == 2 and kept is None
    assert "did you mean 'two'" in capsys.readouterr().err


def test_a_file_of_something_else_is_left_alone(tmp_path, capsys, monkeypatch):
    path = tmp_path / "mine.json"
    path.write_text("[1, 2]")
    monkeypatch.setitem(sys.modules, "benchmarks.start", SimpleNamespace(TITLE="t", measure=lambda quick: [figure(1.0)]))
    assert program.main(["start", "--json", str(path)]) == 2
    assert path.read_text() == "[1, 2]" and str(path) in capsys.readouterr().err


def test_every_name_is_a_module():
    for name in benchmarks.NAMES:
        assert find_spec(f"benchmarks.{name}"), name


def test_the_table_says_each_limit_in_its_unit():
    assert limit(figure(1.0, Limit(500.0, least=True), unit="×").to_json()) == "≥ 500 ×"
    assert value(figure(0.1212, None, (0.1, 0.2), unit="s").to_json()) == "0.121 [0.1, 0.2] s"
    assert len(table({"a": {"title": "t", "not_measured": None, "figures": [figure(1.0).to_json()] * 2}}).rows) == 2


def test_frames_and_what_they_write_beside_a_copy():
    lane = Lane("gpu")
    try:
        speeds = lane.call("benchmarks.frames:copies", 2**22, 4)
    finally:
        lane.close()
    copy = frames.copying(speeds, "some card")
    assert len(speeds) == 4 and copy.unit == "GB/s" and copy.ci95[0] <= copy.value <= copy.ci95[1] < 1e5
    rates = frames.rates(("glossy-mcguire",), (64, 48), "some card", 2.0)
    assert rates and all(rate.unit == "fps" and rate.what.startswith("glossy-mcguire/") for rate in rates)
    written = rates[0].value * 64 * 48 * 32 * 1e-9
    assert f"writes {written:.3g} GB/s, {written / 2.0:.1%} of a copy's" in rates[0].beside
