"""An entry on its way: an archive of its content alone, refused when damaged or hostile."""

from __future__ import annotations

import os
import random
import uuid
import zipfile
from pathlib import Path

import pytest

from evalsuite.store import checksums, shared
from evalsuite.store.archive import Damaged, pack, unpack
from evalsuite.store.place import Place
from tests.unit.shared_store.entries import contents, fill

pytest.importorskip("fsspec")


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
