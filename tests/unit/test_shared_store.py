"""A shared store hands entries from one machine's store to another's, whole or not at all, and no trouble of it ends a run."""

from __future__ import annotations

import errno
import logging
import os
import pickle
import random
import subprocess
import sys
import threading
import time
import uuid
import zipfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.store import asking, checksums, shared
from evalsuite.store.archive import Damaged, pack, unpack
from evalsuite.store.cache import Store
from evalsuite.store.place import Place
from evalsuite.store.shared import Shared

pytest.importorskip("fsspec")


def fill(folder):
    (folder / "a.bin").write_bytes(bytes(range(256)) * 4)
    (folder / "b.bin").write_bytes(b"b")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def s3():
    """An S3 server in a thread, whose only user's keys are in the environment."""
    pytest.importorskip("s3fs")
    server = pytest.importorskip("moto.server").ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server.start()
    with pytest.MonkeyPatch.context() as patch:
        host, port = server.get_host_and_port()
        keys = {"AWS_ACCESS_KEY_ID": "somebody", "AWS_SECRET_ACCESS_KEY": "secret-of-somebody", "AWS_DEFAULT_REGION": "us-east-1"}
        for name, value in (keys | {"AWS_ENDPOINT_URL_S3": f"http://{host}:{port}"}).items():
            patch.setenv(name, value)
        yield
    server.stop()


@pytest.fixture(params=["path", "file", "memory", "s3"])
def url(request, tmp_path) -> str:
    """A shared store of each sort, empty."""
    if request.param == "s3":
        request.getfixturevalue("s3")
        import s3fs

        bucket = f"bucket-{uuid.uuid4().hex[:8]}"
        s3fs.S3FileSystem().mkdir(bucket)
        return f"s3://{bucket}/evalsuite"
    other = {"path": str(tmp_path / "common"), "file": (tmp_path / "common").as_uri(), "memory": f"memory://{uuid.uuid4().hex}"}
    return other[request.param]


@pytest.fixture
def two(tmp_path):
    """Makes two machines' stores with a shared one between them, and what they say."""

    def make(url, **options) -> tuple[Store, Store, list[str]]:
        said: list[str] = []
        return *(Store(tmp_path / name, shared=str(url), warn=said.append, **options) for name in "AB"), said

    return make


# ---- from one machine to another ----------------------------------------------------------------------------------------


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


# ---- archives -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def entry(tmp_path) -> Path:
    """A folder as entries are."""
    folder = tmp_path / "entry"
    folder.mkdir()
    (folder / "a.bin").write_bytes(b"some bytes of a picture")
    (folder / "meta.json").write_text("{}")
    checksums.write(folder)
    return folder


def unpacked(archive: Path, label: str = "image/ab") -> dict[str, bytes]:
    folder = archive.with_name(uuid.uuid4().hex)
    folder.mkdir()
    unpack(archive, folder, label)
    return contents(folder)


def test_an_archive_is_of_the_content_alone(entry, tmp_path):
    pack(entry, tmp_path / "1.zip", "image/ab")
    os.utime(entry / "a.bin", (0, 0))
    (entry / "a.bin").chmod(0o600)
    (entry / "meta.json").rename(entry / "x")
    (entry / "x").rename(entry / "meta.json")
    pack(entry, tmp_path / "2.zip", "image/ab")
    assert (tmp_path / "1.zip").read_bytes() == (tmp_path / "2.zip").read_bytes()
    assert unpacked(tmp_path / "1.zip") == contents(entry)
    with pytest.raises(Damaged, match="another key"):
        unpacked(tmp_path / "1.zip", "image/cd")
    with zipfile.ZipFile(tmp_path / "1.zip") as packed:  # other tools read it too
        assert packed.testzip() is None and packed.namelist() == ["SHA256SUMS", "a.bin", "meta.json"]


def test_flipped_bits_and_cuts_are_found(entry, tmp_path):
    archive, whole = tmp_path / "x.zip", contents(entry)
    pack(entry, archive, "image/ab")
    data, harmless, found = archive.read_bytes(), 0, 0
    for bit in random.Random(2).sample(range(8 * len(data)), 1500):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        archive.write_bytes(flipped)
        try:
            assert unpacked(archive) == whole, bit  # times and rights of files, which nobody reads
            harmless += 1
        except Damaged:
            found += 1
    assert found > harmless > 0
    for length in range(0, len(data), 7):
        archive.write_bytes(data[:length])
        with pytest.raises(Damaged):
            unpacked(archive)


def forged(files: dict[str, bytes], label: str = "image/ab", *, sums: str | None = None, **about: object) -> bytes:
    """An archive with any names, its sums right unless others are given."""
    from hashlib import sha256
    from io import BytesIO

    stream = BytesIO()
    right = "".join(f"{sha256(data).hexdigest()}  {name}\n" for name, data in sorted(files.items()))
    with zipfile.ZipFile(stream, "w") as packed:
        packed.comment = label.encode()
        for name, data in (files | {"SHA256SUMS": (right if sums is None else sums).encode()}).items():
            member = zipfile.ZipInfo(name)
            for attribute, value in about.items():
                setattr(member, attribute, value)
            packed.writestr(member, data)
    return stream.getvalue()


def lying(data: bytes) -> bytes:
    """Says that its first file has 3 GB, in both of its headers."""
    for mark, offset in ((b"PK\x03\x04", 18), (b"PK\x01\x02", 20)):
        at = data.index(mark) + offset
        data = data[:at] + (3 * 10**9).to_bytes(4, "little") * 2 + data[at + 8 :]
    return data


WHOLE = {"a.bin": b"x", "meta.json": b"{}"}
HOSTILE = {
    "a way out": forged(WHOLE | {"../out.bin": b"x"}),
    "a way out by root": forged(WHOLE | {"/tmp/out.bin": b"x"}),
    "a folder": forged(WHOLE | {"sub/out.bin": b"x"}),
    "an empty name": forged(WHOLE | {"": b"x"}),
    "a hidden name": forged(WHOLE | {".out.bin": b"x"}),
    "a bomb": forged(WHOLE | {"c.bin": bytes(10**7)}, compress_type=zipfile.ZIP_DEFLATED),
    "a lie about sizes": lying(forged(WHOLE)),
    "too many files": forged(WHOLE | {f"f{n}": b"" for n in range(300)}),
    "no metadata": forged({"a.bin": b"x"}),
    "metadata of another kind": forged(WHOLE | {"meta.json": b"[]"}),
    "metadata that is no JSON": forged(WHOLE | {"meta.json": b"{"}),
    "metadata nested without end": forged(WHOLE | {"meta.json": b'{"a":' + b"[" * 100_000}),
    "another's entry": forged(WHOLE, "image/cd"),
    "other bytes": forged(WHOLE).replace(b"xPK", b"yPK", 1),
    "other sums": forged(WHOLE, sums=f"{0:064x}  a.bin\n{0:064x}  meta.json\n"),
    "no sums": forged(WHOLE, sums=""),
    "no archive": b"PK and nothing more",
    "nothing": b"",
}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_archive_is_refused_and_replaced(two, tmp_path, case):
    first, second, said = two(tmp_path / "common")
    archive = tmp_path / "common" / "image" / "ab" / "ab.zip"
    archive.parent.mkdir(parents=True)
    archive.write_bytes(HOSTILE[case])
    assert first.get("image", "ab") is None
    assert len(said) == 1 and "image/ab/ab.zip is damaged (" in said[0] and said[0].isprintable() and len(said[0]) < 400
    files = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert not [name for name in files if "out.bin" in name or "/a.bin" in name] and not Path("/tmp/out.bin").exists()
    first.put("image", "ab", {"n": 1}, fill)
    assert second.get("image", "ab")[1] == {"n": 1} and len(said) == 1


def test_forged_archives_are_refused_for_what_they_say(tmp_path):
    """The forger's own archive is a good one; of a liar's nothing is written."""
    (tmp_path / "x.zip").write_bytes(forged(WHOLE))
    assert unpacked(tmp_path / "x.zip").items() >= WHOLE.items()
    (tmp_path / "x.zip").write_bytes(HOSTILE["a lie about sizes"])
    with pytest.raises(Damaged, match="more bytes than it has"):
        unpack(tmp_path / "x.zip", tmp_path, "image/ab")
    assert not (tmp_path / "a.bin").exists()


def test_an_absurd_archive_is_not_fetched(two, tmp_path, monkeypatch):
    first, second, said = two(tmp_path / "common")
    first.put("image", "ab", {}, fill)
    monkeypatch.setattr(Place, "get", lambda *_: pytest.fail("fetched"))
    monkeypatch.setattr(shared, "LARGEST", 100)
    assert second.get("image", "ab") is None and "damaged" in said[0]


# ---- trouble ------------------------------------------------------------------------------------------------------------

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


# ---- whole or not at all ------------------------------------------------------------------------------------------------


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


# ---- addresses ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "url, word",
    [
        ("nosuch://bucket/x", "protocol 'nosuch'"),
        ("s3://", "no bucket or folder"),
        ("file:///", "no bucket or folder"),
        ("s3:/bucket/x", "no URL"),
        ("://bucket", "no URL"),
        ("s 3://bucket", "no URL"),
        ("simplecache::s3://bucket", "no URL"),
        ("/tmp/a\nb", "no URL"),
        ("gs://bucket/x", "pip install gcsfs"),
    ],
)
def test_wrong_addresses(tmp_path, monkeypatch, url, word):
    monkeypatch.setitem(sys.modules, "gcsfs", None)  # whether it is installed or not
    with pytest.raises(EvalsuiteError) as error:
        Store(tmp_path, shared=url)
    assert word in str(error.value) and "EVALSUITE_SHARED" in str(error.value) and error.value.exit_code == 2
    monkeypatch.setenv("EVALSUITE_SHARED", url)
    (check,) = shared.checks()
    assert not check["ok"] and word in check["text"]


def test_without_fsspec(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(EvalsuiteError, match=r"pip install 'evalsuite\[cluster\]'"):
        Store(tmp_path, shared=str(tmp_path / "common"))
    assert Store(tmp_path).get("image", "ab") is None, "needed by none without a shared store"


def test_doctor_says_what_is_there(tmp_path, monkeypatch):
    monkeypatch.delenv("EVALSUITE_SHARED", raising=False)
    assert shared.checks() == []
    monkeypatch.setenv("EVALSUITE_SHARED", str(tmp_path / "common"))
    Store(tmp_path / "A").put("image", "ab", {}, fill)
    (check,) = shared.checks()
    assert check["ok"] and "1 entries" in check["text"]


@pytest.mark.parametrize("url", ["ftp://anna:hunter2%21@host/x", "http://host/x?token=hunter2%21", "ftp:/anna:hunter2!@host/x"])
def test_credentials_are_never_shown(tmp_path, monkeypatch, url):
    said: list[str] = []

    def fails(*_):
        raise OSError(f"cannot open {url}: hunter2! for anna")

    monkeypatch.setattr(Place, "size", fails)
    monkeypatch.setattr(Place, "put", fails)
    monkeypatch.setattr(Place, "sizes", fails)
    try:
        store = Store(tmp_path, shared=url, warn=said.append)
    except EvalsuiteError as error:
        said.append(str(error))
    else:
        store.put("image", "ab", {}, fill)
        said.append(str(store.shared.facts()))
        assert "cannot open" in said[0]
    assert said and not any("hunter2" in text or "token=" in text for text in said)


def test_secrets_of_the_file_system_are_never_shown(s3, tmp_path):
    shared_ = Shared("s3://bucket/x")
    import s3fs

    shared_.place.__dict__["_at"] = s3fs.S3FileSystem(secret="hidden-one", client_kwargs={"aws_session_token": "hidden-two"}), ""
    assert shared_.place.discreet("hidden-one and hidden-two, us-east-1") == "… and …, us-east-1"
