"""No trouble of a shared store ends a run; each is told once."""

from __future__ import annotations

import errno
import threading
import time

import pytest

from evalsuite.store import asking, shared
from evalsuite.store.place import Place
from tests.unit.shared_store.entries import fill

pytest.importorskip("fsspec")


TROUBLE = {
    "unreachable": ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused"),
    "no permission": PermissionError(errno.EACCES, "Permission denied"),
    "no such bucket": FileNotFoundError("The specified bucket does not exist"),
    "stale": OSError(errno.ESTALE, "Stale file handle"),
    "of the library": RuntimeError("two\nlines\x1b[31m"),
    "read only": NotImplementedError(),
}


@pytest.mark.parametrize("case", TROUBLE)
@pytest.mark.parametrize("method", ["size", "get", "put"])
def test_trouble_is_told_once_and_then_left(two, tmp_path, monkeypatch, case, method):
    first, second, said = two(tmp_path / "common")
    for n in range(8):
        first.put("image", f"0{n}", {"n": n}, fill)
    asked = []

    def fails(*arguments):
        asked.append(arguments)
        raise TROUBLE[case]

    monkeypatch.setattr(Place, method, fails)
    for n in range(9):
        found = second.get("image", f"0{n}")
        assert (found is None) == (method != "put" or n == 8)
        assert found or second.put("image", f"0{n}", {"n": n}, fill)[1] == {"n": n}
        assert second.get("image", f"0{n}")[1] == {"n": n}
    if method == "put":  # only the last was to be sent
        for n in range(8):
            second.put("image", f"1{n}", {}, fill)
    else:
        assert not (method == "size" and second.shared.has("image", "00"))
    assert len(asked) == asking.FAILURES
    assert len(said) == 2 and all(text.isprintable() and text.startswith("shared store ") for text in said)
    assert "goes on with the local store" in said[0] and f"after {asking.FAILURES} failures" in said[1]
    assert not list(tmp_path.glob("B/.runs/*/*")) or [p.name for p in tmp_path.glob("B/.runs/*/*")] == ["lock"]


def test_a_place_that_recovers_is_asked_on(two, tmp_path, monkeypatch):
    _, second, said = two(tmp_path / "common")
    size, calls = Place.size, []

    def unsteady(self, name):
        calls.append(name)
        if len(calls) % 3:
            raise ConnectionResetError(errno.ECONNRESET, "Connection reset by peer")
        return size(self, name)

    monkeypatch.setattr(Place, "size", unsteady)
    for n in range(12):
        second.get("image", f"0{n}")
    assert len(calls) == 12 and len(said) == 1


def test_no_answer_holds_nobody_up(two, tmp_path, monkeypatch):
    _, second, said = two(tmp_path / "common")
    over = threading.Event()
    monkeypatch.setattr(asking, "LIMIT_S", 0.05)
    monkeypatch.setattr(Place, "size", lambda *_: over.wait(30))
    began = time.monotonic()
    for n in range(6):
        second.put("image", f"0{n}", {}, fill)
    assert time.monotonic() - began < 5
    over.set()
    assert len(said) == 2 and "no answer in 0 s" in said[0]


def test_a_slow_answer_is_told(two, tmp_path, monkeypatch):
    first, _, said = two(tmp_path / "common")
    monkeypatch.setattr(asking, "SLOW_S", -1.0)
    for key in ("ab", "cd"):
        first.put("image", key, {}, fill)
    assert len(said) == 1 and "slow, 0 s" in said[0]
    assert first.shared.has("image", "cd")


def test_a_file_in_the_way(two, tmp_path):
    (tmp_path / "common").write_text("no folder")
    first, second, said = two(tmp_path / "common")
    first.put("image", "ab", {}, fill)
    assert second.get("image", "ab") is None and first.get("image", "ab")
    assert said and all("Not a directory" in text for text in said) and first.shared.facts()["entries"] == 0


def test_a_closed_door_of_s3(s3, two, monkeypatch):
    """No such bucket: nothing is found there, nothing can be sent."""
    first, second, said = two("s3://no-such-bucket-here/x")
    first.put("image", "ab", {}, fill)
    assert second.get("image", "ab") is None and first.get("image", "ab")
    assert any("cannot be written" in text and "bucket" in text for text in said)
    assert not any("secret-of-somebody" in text for text in said)


def test_a_full_local_disk_is_not_the_shared_stores_trouble(two, tmp_path, monkeypatch):
    first, second, said = two(tmp_path / "common")
    first.put("image", "ab", {}, fill)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Place, "get", full)
    assert second.get("image", "ab") is None and said == [] and not list(tmp_path.glob("B/.runs/*/*.zip"))
    monkeypatch.setattr(shared, "pack", full)
    assert second.put("image", "cd", {"n": 1}, fill)[1] == {"n": 1}
    assert len(said) == 1 and "No space left" in said[0] and str(tmp_path / "B") in said[0]


def test_a_read_only_local_store_keeps_what_it_fetches_for_the_run(two, tmp_path, monkeypatch):
    from evalsuite.store import claims

    first, second, said = two(tmp_path / "common")
    first.put("image", "ab", {"n": 1}, fill)

    def refuse(root):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(claims, "tick", refuse)
    place, meta = second.get("image", "ab")
    assert meta == {"n": 1} and (place / "b.bin").read_bytes() == b"b" and tmp_path not in place.parents
    second.put("image", "cd", {"n": 2}, fill)
    assert first.shared.has("image", "cd") and len(said) == 1 and "not kept" in said[0]
