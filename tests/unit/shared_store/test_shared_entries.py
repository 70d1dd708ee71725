"""A shared store hands entries from one machine's store to another's, whole or not at all."""

from __future__ import annotations

import pickle
import random
import subprocess
import sys
import time
import uuid
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from evalsuite.store.archive import unpack
from evalsuite.store.cache import Store
from evalsuite.store.place import Place
from tests.unit.shared_store.entries import contents, fill

pytest.importorskip("fsspec")


def test_what_one_makes_the_other_finds(two, url, tmp_path):
    first, second, said = two(url)
    assert not second.has("image", "ab12") and second.get("image", "ab12") is None
    made, meta = first.put("image", "ab12", {"name": "ü", "n": float("nan")}, fill)
    assert second.has("image", "ab12") and not list((tmp_path / "B").glob("image")), "to have is not to fetch"
    found, theirs = second.get("image", "ab12")
    assert found == second.path("image", "ab12") and contents(found) == contents(made) and str(theirs) == str(meta)
    assert set(contents(found)) == {"a.bin", "b.bin", "meta.json", "SHA256SUMS"}
    assert said == [] and list(tmp_path.glob("*/.runs/*/*.zip")) == []
    assert second.shared.facts()["entries"] == 1 and second.shared.facts()["problem"] is None
    assert second.written == 0, "what was fetched it did not make"


def test_what_was_fetched_is_the_stores_own(two, tmp_path, monkeypatch):
    first, second, _ = two(tmp_path / "common")
    for key in ("ab", "cd"):
        first.put("image", key, {}, fill)
    monkeypatch.setattr(time, "time_ns", lambda: 10**18)  # a clock that stands
    places = [second.get("image", key)[0] for key in ("ab", "cd")]
    ticks = [path.stat().st_mtime_ns for place in places for path in (place, place / "a.bin")]
    assert ticks[0] == ticks[1] < ticks[2] == ticks[3], "ordered by the store's ticks, as what it made"
    (tmp_path / "common").rename(tmp_path / "gone")
    assert second.get("image", "ab")[0] == places[0]


def test_what_is_there_is_not_sent_again(two, url, monkeypatch):
    first, second, said = two(url)
    sent, put = [], Place.put
    monkeypatch.setattr(Place, "put", lambda self, file, name: sent.append(name) or put(self, file, name))
    first.put("image", "ab", {"n": 1}, fill)
    second.put("image", "ab", {"n": 1}, fill)
    assert sent == ["image/ab/ab.zip"] and said == []
    again, fresh, _ = two(url, read=False)
    assert not fresh.has("image", "ab") and fresh.get("image", "ab") is None, "--no-cache reads nothing"
    again.put("image", "ab", {"n": 2}, fill)
    assert len(sent) == 2, "and writes, as it does to the local store"


def test_what_was_here_before_is_sent_on_demand(two, tmp_path):
    Store(tmp_path / "A", shared="").put("image", "ab", {}, fill)
    first, second, _ = two(tmp_path / "common")
    assert first.get("image", "ab") and second.get("image", "ab") is None
    assert first.share("image", "ab") and not first.share("image", "ab") and not first.share("image", "cd")
    assert second.get("image", "ab")


def test_a_damaged_local_entry_is_fetched(two, tmp_path):
    first, _, said = two(tmp_path / "common")
    place, _ = first.put("image", "ab", {}, fill)
    (place / "b.bin").write_bytes(b"c")
    assert (first.get("image", "ab")[0] / "b.bin").read_bytes() == b"b"
    assert len(said) == 1 and str(place / "b.bin") in said[0]


def test_a_worker_elsewhere_makes_the_same_store(tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_CACHE", str(tmp_path / "A"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EVALSUITE_SHARED", "common")
    Store().put("image", "ab", {"n": 1}, fill)
    described = pickle.loads(pickle.dumps(Store().description))
    assert described == (None, str(tmp_path / "common")), "no folder of this machine, and none relative to where it works"
    monkeypatch.setenv("EVALSUITE_CACHE", str(tmp_path / "B"))
    monkeypatch.setenv("EVALSUITE_SHARED", "")
    root, url = described
    assert Store(root, shared=url).get("image", "ab")[0] == tmp_path / "B" / "image" / "ab" / "ab"
    assert Store(tmp_path / "C").description == (tmp_path / "C", "") and Store().shared is None


def test_threads_at_once(two, url):
    first, second, said = two(url)
    keys = [f"{n:02x}{n}" for n in range(16)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda key: first.put("image", key, {"key": key}, fill), keys))
        found = list(pool.map(lambda key: second.get("image", key), keys))
    assert [meta["key"] for _, meta in found] == keys and said == []


@pytest.mark.parametrize("end", [KeyboardInterrupt, OSError])
@pytest.mark.parametrize("sort", ["path", "memory"])
def test_half_a_copy_is_never_seen(two, tmp_path, monkeypatch, end, sort):
    """Where an object is not put whole: what stops a copy half way leaves no entry and no rest."""
    first, second, _ = two(tmp_path / "common" if sort == "path" else f"memory://{uuid.uuid4().hex}")
    fs, root = first.shared.place._at
    seen = []

    def stops(file, path, **_):
        fs.pipe_file(path, Path(file).read_bytes()[:100])
        seen.append(second.shared.has("image", "ab"))
        raise end

    with monkeypatch.context() as patch:
        patch.setattr(fs, "put_file", stops)
        with suppress(KeyboardInterrupt):
            first.put("image", "ab", {}, fill)
    assert seen == [False] and second.get("image", "ab") is None and not fs.find(root)
    assert first.share("image", "ab") and second.get("image", "ab")


WRITER = """
import sys
from pathlib import Path
from evalsuite.store.cache import Store
store = Store(Path(sys.argv[1]), read=False, shared=sys.argv[2])
n = 0
while True:
    data = bytes([n % 251]) * 700_000
    store.put("image", f"{n % 3:02x}", {"n": n % 251}, lambda folder: (folder / "a").write_bytes(data))
    n += 1
    if n == 3:
        print("ready", flush=True)
"""


def test_killed_writers_leave_no_half_of_an_entry(tmp_path):
    """Processes that replace the same entries as fast as they can, killed at random times, beside one who reads all there is."""
    chance, common, looks = random.Random(3), tmp_path / "common", 0
    for number in range(8):
        words = [sys.executable, "-c", WRITER]
        writers = [
            subprocess.Popen(
                [*words, str(tmp_path / f"{number}{k}"), str(common)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
            for k in range(2)
        ]
        assert [writer.stdout.readline() for writer in writers] == [b"ready\n"] * 2
        until = time.monotonic() + chance.uniform(0.05, 0.4)
        while time.monotonic() < until:
            looks += whole(common, tmp_path / "look")
        for writer in writers:
            writer.kill()
            assert writer.communicate()[1] == b""
        looks += whole(common, tmp_path / "look")
    assert looks > 50
    reader = Store(tmp_path / "reader", shared=str(common), warn=pytest.fail)
    assert all(reader.get("image", f"{n:02x}") for n in range(3)) and reader.shared.facts()["entries"] == 3


def whole(common: Path, spare: Path) -> int:
    """How many archives there are, each held against its sums."""
    seen = 0
    for archive in common.glob("*/*/*.zip"):
        with archive.open("rb") as stream:  # this very one, whatever takes its name
            copy = spare.with_suffix(".zip")
            copy.write_bytes(stream.read())
        folder = spare.with_name(uuid.uuid4().hex)
        folder.mkdir()
        unpack(copy, folder, f"image/{archive.stem}")
        seen += 1
    return seen
