"""The store is atomic and content-addressed; errors are one line and survive the way between processes."""

import pickle

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError, MachineLacks
from evalsuite.store.cache import Store, digest, file_digest, write_atomic


def test_error_is_one_line_and_pickles():
    error = EvalsuiteError("a.xml", "two\nlines", "one", "mend it")
    assert str(error) == "a.xml: got two lines, expected one; mend it"
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and again.exit_code == 2
    assert MachineLacks("x", "y", "z").exit_code == 3


def test_digest_sees_every_texel_and_no_dictionary_order():
    a = np.zeros((4, 4, 3), np.float32)
    b = a.copy()
    b[3, 3, 2] = 1e-30
    assert digest({"x": 1, "y": a}) == digest({"y": a, "x": 1})
    assert digest(a) != digest(b) != digest(b.astype(np.float64))
    assert digest([1, 2]) != digest([2, 1])


def test_changed_file_has_another_digest(tmp_path):
    path = tmp_path / "f"
    path.write_bytes(b"one")
    first = file_digest(path)
    path.write_bytes(b"three")
    assert file_digest(path) != first


def test_entry_is_whole_or_absent(tmp_path):
    store = Store(tmp_path)
    assert store.get("image", "ab12") is None

    def half(folder):
        (folder / "a").write_text("x")
        raise OSError(28, "No space left on device")

    with pytest.raises(EvalsuiteError, match="No space left"):
        store.put("image", "ab12", {"n": 1}, half)
    assert store.get("image", "ab12") is None
    assert [p for p in tmp_path.rglob("*") if p.is_file() and p.stat().st_size] == [], "locks only"

    store.put("image", "ab12", {"n": 1}, lambda folder: (folder / "a").write_text("x"))
    place, meta = store.get("image", "ab12")
    assert meta == {"n": 1} and (place / "a").read_text() == "x"
    assert list(store.entries()) == [("image", place)]


def test_second_writer_keeps_the_first_copy(tmp_path):
    store = Store(tmp_path)
    store.put("k", "cd", {"n": 1}, lambda folder: (folder / "a").write_text("first"))
    place, _ = store.put("k", "cd", {"n": 1}, lambda folder: (folder / "a").write_text("second"))
    assert (place / "a").read_text() == "first"


def test_a_file_in_the_way_is_one_line(tmp_path):
    (tmp_path / "cache").write_text("not a folder")
    with pytest.raises(EvalsuiteError, match="cache"):
        Store(tmp_path / "cache").put("k", "ef", {})
    with pytest.raises(EvalsuiteError):
        write_atomic(tmp_path / "cache" / "results.json", "{}")
