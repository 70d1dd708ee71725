"""A store finds what its disk damages, gives back room without taking what is in use, and orders uses by a clock that only goes
forward."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.store import claims, upkeep
from evalsuite.store.cache import Store, file_digest


def fill(folder):
    (folder / "a.bin").write_bytes(bytes(range(256)) * 4)
    (folder / "b.bin").write_bytes(b"b")


def made(store, *keys):
    return {key: store.put("image", key, {"name": key}, fill)[0] for key in keys}


def uses(root, key="", then="time.sleep(60)"):
    """Another process that claims a store, uses an entry, says so and lives on."""
    code = f"import time\nfrom evalsuite.store.cache import Store\nstore = Store({str(root)!r})\n"
    code += f"assert store.get('image', {key!r})\n" if key else "store.partial('x')\n"
    code += f"fresh = store._claim().room()\n(fresh / 'half').write_text('x')\nprint('ready', flush=True)\n{then}"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    return process


def ended(process):
    process.kill()
    process.wait()
    process.stdout.close()


def test_every_flipped_bit_is_found_and_made_anew(tmp_path):
    said, chance = [], random.Random(1)
    store = Store(tmp_path, warn=said.append)
    place = made(store, "ab")["ab"]
    sizes = {path.name: path.stat().st_size for path in place.iterdir()}
    assert set(sizes) == {"a.bin", "b.bin", "meta.json", "SHA256SUMS"}
    # All bits of the sums and the metadata, a few of the rest.
    bits = [(name, bit) for name in ("SHA256SUMS", "meta.json", "b.bin") for bit in range(8 * sizes[name])]
    bits += [("a.bin", bit) for bit in chance.sample(range(8 * sizes["a.bin"]), 200)]
    for name, bit in bits:
        whole = (place / name).read_bytes()
        broken = bytearray(whole)
        broken[bit // 8] ^= 1 << bit % 8
        (place / name).write_bytes(broken)
        ((found, damaged),) = upkeep.verify(upkeep.things(store))
        assert found == place and damaged, (name, bit)
        assert name == "SHA256SUMS" or damaged[0].file == place / name
        (place / name).write_bytes(whole)
    assert list(upkeep.verify(upkeep.things(store))) == [(place, [])]

    (place / "a.bin").write_bytes(b"torn")
    assert store.get("image", "ab") is None
    assert len(said) == 1 and str(place / "a.bin") in said[0] and "\n" not in said[0]
    assert made(store, "ab")["ab"] == place and store.get("image", "ab")
    assert (place / "a.bin").stat().st_size == sizes["a.bin"]


@pytest.mark.parametrize("harm", ["gone", "more", "no sums", "empty sums"])
def test_missing_and_foreign_files(tmp_path, harm):
    store = Store(tmp_path)
    place = made(store, "ab")["ab"]
    if harm == "gone":
        (place / "b.bin").unlink()
    elif harm == "more":
        (place / "c.bin").write_text("c")
    elif harm == "no sums":  # as an earlier version left them
        (place / "SHA256SUMS").unlink()
    else:
        (place / "SHA256SUMS").write_text("")
    ((_, damaged),) = upkeep.verify(upkeep.things(store))
    assert damaged is None if harm == "no sums" else damaged
    assert store.get("image", "ab") is None
    made(store, "ab")
    assert store.get("image", "ab") and sorted(p.name for p in place.iterdir())[-2:] == ["b.bin", "meta.json"]


def test_sums_are_those_of_coreutils(tmp_path):
    place = made(Store(tmp_path), "ab")["ab"]
    assert subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=place, capture_output=True).returncode == 0


def test_removed_by_verify(tmp_path):
    store = Store(tmp_path)
    places = made(store, "ab", "cd")
    (places["ab"] / "b.bin").write_bytes(b"c")
    upkeep.remove(store, [path for path, damaged in upkeep.verify(upkeep.things(store)) if damaged])
    assert not places["ab"].exists() and not places["ab"].parent.exists() and store.get("image", "cd")


def test_least_recently_used_go_first(tmp_path):
    places = made(Store(tmp_path), "aa", "bb", "cc", "dd")
    old = made(Store(tmp_path), "ee")["ee"]
    (old / "SHA256SUMS").unlink()  # of an earlier version: no use to anyone
    for key in ("bb", "aa"):
        assert Store(tmp_path).get("image", key)
    size = sum(path.stat().st_size for path in places["aa"].iterdir())
    would = upkeep.prune(Store(tmp_path), 3 * size, dry_run=True)
    assert would["removed"] == 2 and all(place.exists() for place in (*places.values(), old))
    found = upkeep.prune(Store(tmp_path), 3 * size)
    assert found == would | {"dry_run": False} and found["after"] == 3 * size
    assert [key for key, place in places.items() if place.exists()] == ["aa", "bb", "dd"] and not old.exists()
    upkeep.prune(Store(tmp_path), size)
    assert [key for key, place in places.items() if place.exists()] == ["aa"]
    assert upkeep.prune(Store(tmp_path), 0)["after"] == 0 and not list(Store(tmp_path).entries())


def test_order_survives_a_clock_that_jumps(tmp_path, monkeypatch):
    store, day = Store(tmp_path), 86400 * 10**9
    now = time.time_ns()
    for key, moment in (("aa", now), ("bb", now + 1000 * day), ("cc", now - 5000 * day), ("dd", 0), ("ee", now)):
        monkeypatch.setattr(time, "time_ns", lambda moment=moment: moment)
        store.put("image", key, {}, fill)
    assert store.get("image", "aa")
    order = sorted(store.entries(), key=lambda entry: entry[1].stat().st_mtime_ns)
    assert [place.name for _, place in order] == ["bb", "cc", "dd", "ee", "aa"]
    times = [path.stat().st_mtime_ns for _, place in order for path in place.glob("a.bin")]
    assert len(set(times)) == 5, "the pictures of a run's folder are told apart by these"
    assert times[:4] == [place.stat().st_mtime_ns for _, place in order[:4]], "ticks, not the time of day"
    monkeypatch.undo()
    del store
    upkeep.prune(Store(tmp_path), 2200)
    assert [place.name for _, place in Store(tmp_path).entries()] == ["aa"]


def test_what_a_living_process_uses_stays(tmp_path):
    places = made(Store(tmp_path), "aa", "bb")
    (tmp_path / "partial").mkdir()
    (tmp_path / "partial" / "x.state").write_bytes(b"half a reference")
    process = uses(tmp_path, "aa")
    later = made(Store(tmp_path), "cc")["cc"]
    try:
        found = upkeep.prune(Store(tmp_path), 0)
        assert found["kept_in_use"] == 3 and found["removed"] == 1 and found["left_by_killed"] == 0
        assert places["aa"].exists() and later.exists() and not places["bb"].exists()
        assert (tmp_path / "partial" / "x.state").exists() and list(tmp_path.glob(".runs/*/*/half"))
    finally:
        ended(process)
    found = upkeep.prune(Store(tmp_path), 0)
    assert found["removed"] == 3 and found["left_by_killed"] == 1 and found["after"] == 0
    assert not list(tmp_path.glob(".runs/*")) and not list(tmp_path.glob("image/*"))


def test_what_is_used_while_it_prunes_stays(tmp_path, monkeypatch):
    places, looks, held = made(Store(tmp_path), "aa", "bb"), [], upkeep._held

    def look(path):
        looks.append(path)
        if len(looks) == 3:  # both are seen; now the first is to go
            assert path == places["aa"] and claims.touch(path, claims.tick(tmp_path))
        return held(path)

    monkeypatch.setattr(upkeep, "_held", look)
    found = upkeep.prune(Store(tmp_path), 0)
    assert places["aa"].exists() and not places["bb"].exists() and found["kept_in_use"] == found["removed"] == 1


def test_the_next_run_sweeps_after_a_killed_one(tmp_path):
    ended(uses(tmp_path))
    process = uses(tmp_path)
    try:
        (tmp_path / "partial").mkdir()
        (tmp_path / "partial" / ".new-abc").touch()
        assert len(list(tmp_path.glob(".runs/*"))) == 1, "the dead one's folder is gone, the living one's stays"
        Store(tmp_path).partial("x")
        assert (tmp_path / "partial" / ".new-abc").exists(), "it may be the living one's"
    finally:
        ended(process)
    Store(tmp_path).partial("x")
    assert not (tmp_path / "partial" / ".new-abc").exists() and not list(tmp_path.glob(".runs/*"))


def test_a_process_that_ends_leaves_no_claim(tmp_path):
    process = uses(tmp_path, then="")
    process.wait()
    process.stdout.close()
    assert not list(tmp_path.glob(".runs/*"))


def test_prune_beside_runs_harms_none(tmp_path):
    """Processes put, get and read while another empties the store as fast as it can."""
    code = f"""
import sys
from evalsuite.store.cache import Store
store = Store({str(tmp_path)!r})
for n in range(150):
    key = f"{{n % 7:02x}}"
    found = store.get("image", key)
    if found is None:
        found = store.put("image", key, {{"n": n % 7}}, lambda folder: (folder / "a").write_bytes(bytes([n % 7]) * 5000))
    assert found[1] == {{"n": n % 7}} and (found[0] / "a").read_bytes() == bytes([n % 7]) * 5000
    if n % 5 == 4:
        del store
        store = Store({str(tmp_path)!r})
"""
    runs = [subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True) for _ in range(3)]
    removed = 0
    while any(run.poll() is None for run in runs):
        removed += upkeep.prune(Store(tmp_path), 0)["removed"]
    for run in runs:
        assert run.wait() == 0, run.stderr.read()
        run.stderr.close()
    upkeep.prune(Store(tmp_path), 0)
    assert not list(Store(tmp_path).entries()) and not list(tmp_path.glob(".runs/*")) and removed > 7, "more than the last few"


@pytest.mark.parametrize(
    "text, size", [("10GB", 10**10), ("1.5 tb", 15 * 10**11), ("2GiB", 2**31), ("700", 700), ("3K", 3000), ("0", 0)]
)
def test_sizes(text, size):
    assert upkeep.bytes_of(text) == size


@pytest.mark.parametrize("text", ["", "GB", "-1GB", "10 parsecs", "1e3", "10GBB"])
def test_no_sizes(text):
    with pytest.raises(EvalsuiteError, match="--max-size"):
        upkeep.bytes_of(text)


def test_a_digest_sees_a_change_behind_the_clock(tmp_path):
    path = tmp_path / "f"
    path.write_bytes(b"one")
    before, times = file_digest(path), path.stat()
    time.sleep(0.02)  # the kernel's own clock has ticks
    path.write_bytes(b"two")
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert path.stat().st_mtime_ns == times.st_mtime_ns and file_digest(path) != before


def test_a_fork_does_not_end_its_parents_claim(tmp_path):
    claim = claims.Claim(tmp_path)
    claims._end(claim.folder, claim._lock, os.getpid() + 1)
    assert claims.living(tmp_path) == [claim.begun]
