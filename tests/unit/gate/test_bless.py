"""The baseline file, and accepting cells into it."""

from __future__ import annotations

import difflib
import json
from importlib.resources import files

import jsonschema
import numpy as np
import pytest
from synthetic import MESA, NVIDIA, two

from evalsuite.commands_gate import bless, undo
from evalsuite.errors import EvalsuiteError
from evalsuite.gate import baseline as baselines
from evalsuite.gate.record import Record
from evalsuite.image import exr

SCHEMA = json.loads(files("evalsuite.gate").joinpath("baseline.schema.json").read_text(encoding="utf-8"))


def cells(**errors: float) -> dict:
    return {scene: (two.picture(error), two.reference(seed)) for seed, (scene, error) in enumerate(errors.items())}


def test_file_is_of_its_schema_sorted_and_changes_by_the_line(gate):
    gate.bless(cells(b=0.05, a=0.03) | {"skip": "skipped"})
    text = gate.path.read_text(encoding="utf-8")
    data = json.loads(text)
    jsonschema.Draft202012Validator(SCHEMA).validate(data)
    assert list(data["cells"]) == [two.name(s) for s in ("a", "b", "skip")]
    assert baselines.read(gate.path).text() == text
    assert max(map(len, text.splitlines())) < 400 and len(text.splitlines()) < 100
    gate.bless(cells(b=0.04, a=0.03) | {"skip": "skipped"})
    now = gate.path.read_text(encoding="utf-8")
    diff = [line for line in difflib.ndiff(text.splitlines(), now.splitlines()) if line[0] in "+-"]
    assert diff and all(line[2:5] == "   " for line in diff), "facts and metrics only"
    changed = json.loads(now)["cells"]
    assert changed[two.name("a")] == data["cells"][two.name("a")] and changed[two.name("b")] != data["cells"][two.name("b")]


def test_provenance(gate):
    host = MESA | {"versions": {"numpy": "2"}, "llvm": "/home/me/libLLVM.so", "cpu": "a processor"}
    gate.bless(cells(a=0.05), host=host, reason="why not")
    gate.bless(cells(a=0.05, b=0.05), host=NVIDIA)
    found = baselines.read(gate.path)
    a, b = (found.cells[two.name(scene)] for scene in "ab")
    assert found.renderer(a) == "llvmpipe" and found.renderer(b) == "NVIDIA H100"
    assert found.hosts[a["host"]]["cpu"] == "a processor"
    assert (a["reason"], b["reason"], a["seed"], a["target_error"]) == ("why not", "first", 0, 0.02)
    assert "/home" not in gate.path.read_text()


def test_cells_by_glob_and_the_rest_stays(gate):
    gate.bless(cells(a=0.05, b=0.05, c=0.05))
    better = cells(a=0.04, b=0.04, c=0.04)
    assert [row["id"] for row in gate.bless(better, "[ab]/*", two.name("a"))] == [two.name("a"), two.name("b")]
    assert {s: row["verdict"] for s, row in gate.check(better).items()} == {"a": "unchanged", "b": "unchanged", "c": "closer"}


def test_dry_run_writes_nothing(gate):
    gate.bless(cells(a=0.05), dry_run=True)
    assert not gate.path.exists() and gate.pictures == []


@pytest.mark.parametrize(("now", "patterns", "words"), [
    (cells(a=0.05), ["nothing*"], "no such cell"),
    (cells(a=0.05), [two.name("aa")], f"did you mean '{two.name('a')}'"),
    ({"a": "failed"}, [two.name("a")], "a cell with a score"),
    (cells(a=0.09), [], "'further' without a reason"),
    ({"a": (two.picture(0.05), two.reference(0, mean=2 * two.truth()))}, [], "'other truth' without a reason"),
])  # fmt: skip
def test_refusals_are_one_line_and_write_nothing(gate, now, patterns, words):
    gate.bless(cells(a=0.05))
    before = gate.path.read_bytes()
    for reason in (None, "  "):
        with pytest.raises(EvalsuiteError) as caught:
            gate.bless(now, *patterns, reason=reason)
        assert words in str(caught.value) and "\n" not in str(caught.value)
    assert gate.path.read_bytes() == before


def test_reason_is_kept_and_failed_cells_are_passed_over(gate):
    gate.bless(cells(a=0.05, b=0.05))
    assert [row["id"] for row in gate.bless(cells(a=0.09) | {"b": "failed"}, reason="softer on purpose")] == [two.name("a")]
    found = baselines.read(gate.path).cells
    assert found[two.name("a")]["reason"] == "softer on purpose" and found[two.name("b")]["reason"] == "first"


def test_missing_cell_leaves_only_when_named(gate):
    gate.bless(cells(a=0.05, b=0.05))
    assert gate.bless(cells(a=0.05)) == []
    gate.bless(cells(a=0.05), two.name("b"))
    assert list(baselines.read(gate.path).cells) == [two.name("a")]


def test_small_steps_within_tolerance_do_not_add_up(gate):
    """Each of twenty steps is drift against the one before; the baseline stays the first, until they are a change."""
    reference, verdicts = two.reference(0, 0.001), []
    gate.bless({"a": (two.picture(0.05), reference)})
    for step in range(1, 21):
        image = two.truth() + (two.picture(0.05) - two.truth()) * (1 + 1e-4 * step)
        verdicts.append(gate.check({"a": (image, reference)})["a"]["verdict"])
        if verdicts[-1] == "unchanged":
            assert gate.bless({"a": (image, reference)}) == []
    assert verdicts[0] == "unchanged" and verdicts[-1] == "further"


def test_undo_and_undo_of_undo(gate):
    gate.bless(cells(a=0.05))
    first = gate.path.read_bytes()
    gate.bless(cells(a=0.04, b=0.03))
    second = gate.path.read_bytes()
    rows = undo(gate.path, dry_run=True)
    assert gate.path.read_bytes() == second
    assert [row["id"] for row in rows] == [two.name("a"), two.name("b")] and rows[1]["is"] == "not blessed"
    undo(gate.path)
    assert gate.path.read_bytes() == first
    assert gate.check(cells(a=0.05))["a"]["verdict"] == "unchanged"
    undo(gate.path)
    assert gate.path.read_bytes() == second
    assert gate.check(cells(a=0.04, b=0.03))["b"]["verdict"] == "unchanged"


def test_undo_of_the_first_bless(gate):
    with pytest.raises(EvalsuiteError, match="nothing to undo"):
        undo(gate.path)
    gate.bless(cells(a=0.05))
    undo(gate.path)
    assert not gate.path.exists()
    undo(gate.path)
    assert gate.check(cells(a=0.05))["a"]["verdict"] == "unchanged"


def test_pictures_that_no_state_names_are_removed(gate):
    for error in (0.05, 0.04, 0.03):
        gate.bless(cells(a=error, b=0.05))
    assert len(gate.pictures) == 3, "two of a, one of b"


def test_record_keeps_the_object_bit_for_bit_and_small(tmp_path):
    image, (mean, sigma) = two.picture(0.05).astype(np.float32), two.reference(0)
    Record.of(image, two.mask(), None, mean, sigma).write(tmp_path / "one.exr")
    found = Record.read(tmp_path / "one.exr")
    assert np.array_equal(found.image[two.mask()], image[two.mask()]) and not found.image[~two.mask()].any()
    assert found.digest == Record.of(image, two.mask(), None, mean, sigma).digest
    assert found.digest != Record.of(np.nextafter(image, 2), two.mask(), None, mean, sigma).digest
    block = two.mask()[16:24, 24:32]
    assert block.all() and np.allclose(found.truth[2, 3], mean[16:24, 24:32].mean((0, 1)))
    assert np.allclose(found.truth_error[2, 3], np.sqrt(np.square(sigma[16:24, 24:32]).sum((0, 1))) / 64)
    assert (tmp_path / "one.exr").stat().st_size < image.nbytes


def spoil(change):
    def act(path):
        data = json.loads(path.read_text())
        change(data, data["cells"][two.name("a")])
        path.write_text(json.dumps(data))

    return act


@pytest.mark.parametrize(("damage", "words"), [
    (lambda path: path.unlink(), "evalsuite bless"),
    (lambda path: path.write_text("{"), "does not read"),
    (lambda path: path.write_bytes(b"\xff\xfe\x00"), "does not read"),
    (lambda path: path.write_text("[" * 100_000), "does not read"),
    (lambda path: path.write_text("[]"), "schema 'list'"),
    (spoil(lambda d, c: d.update(schema="evalsuite.baseline/9")), "evalsuite.baseline/9"),
    (spoil(lambda d, c: d.update(cells=[])), "no whole file"),
    (spoil(lambda d, c: d.pop("hosts")), "no whole file"),
    (spoil(lambda d, c: d.update(hosts={"x": 1})), "no whole file"),
    (spoil(lambda d, c: d.update(run={"size": [1, "x"]})), "size = "),
    (spoil(lambda d, c: d.update(run={"size": [64, 64, 3]})), "size = "),
    (spoil(lambda d, c: d.update(run={"target_error": 7.0})), "target_error = 7.0"),
    (spoil(lambda d, c: d.update(run={"seed": True})), "seed = True"),
    (spoil(lambda d, c: d.update(run={"cap": 1.5})), "cap = 1.5"),
    (spoil(lambda d, c: d.update(run={"choice": {"scenes": 3}})), "choice = "),
    (spoil(lambda d, c: d.update(run={"choice": {"scenes": [3]}})), "choice = "),
    (spoil(lambda d, c: d.update(run={"choice": {"parameters": {"exponent": 3}}})), "choice = "),
    (spoil(lambda d, c: c.pop("status")), "no status"),
    (spoil(lambda d, c: c.update(host="nowhere")), "no host"),
    (spoil(lambda d, c: c.update(image="../../x")), "no digest"),
    (spoil(lambda d, c: c.update(metrics=[])), "no whole metrics"),
    (spoil(lambda d, c: c["metrics"].pop("mse")), "no mse"),
    (spoil(lambda d, c: c["metrics"].update(mse={"value": "x", "ci95": [0, 1]})), "no whole metrics"),
    (spoil(lambda d, c: c["metrics"].update(mse={"value": 1, "ci95": 3})), "no whole metrics"),
    (spoil(lambda d, c: c.update(parameters=3)), "no whole facts"),
    (lambda path: next(path.with_suffix("").glob("*.exr")).write_bytes(b"no picture"), ".exr"),
    (lambda path: exr.write(next(path.with_suffix("").glob("*.exr")), two.truth()), "a record of a blessed cell"),
])  # fmt: skip
def test_damaged_baseline_is_one_line(gate, damage, words):
    gate.bless(cells(a=0.05))
    damage(gate.path)
    with pytest.raises(EvalsuiteError) as caught:
        gate.check(cells(a=0.06))
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_another_cells_picture_is_not_taken(gate):
    gate.bless(cells(a=0.05, b=0.04))
    a, b = gate.pictures
    a.write_bytes(b.read_bytes())
    with pytest.raises(EvalsuiteError, match="another picture than was blessed"):
        gate.check(cells(a=0.06, b=0.04))


def test_baseline_is_json(gate):
    with pytest.raises(EvalsuiteError, match=r"\.json"):
        bless(gate.home / "baseline", gate.folder(cells(a=0.05)), [])
