"""Headers that say more than any machine holds, in files of a few bytes: refused before room is made."""

from __future__ import annotations

import json
import resource
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest
from crew import GROWTH
from readers import _meshes, exr_files

#: Reads files as `readers` does, and prints of each what came of it and how much the process's peak memory grew [KiB].
READ = """
import json, os, resource, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import readers
from evalsuite.errors import EvalsuiteError
for case, name in json.loads(sys.argv[2]).items():
    folder = Path(sys.argv[3]) / f"in-{name}"
    folder.mkdir(exist_ok=True)
    os.chdir(folder)
    reader = readers.READERS[name](folder)
    file = folder / reader.file
    file.write_bytes((folder.parent / case).read_bytes())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        reader.read(file)
        outcome = "accepted"
    except EvalsuiteError as error:
        outcome = f"refused: {error}"
    print(json.dumps([case, outcome, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before]), flush=True)
"""


def _exr(change) -> bytes:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        return change(exr_files(Path(folder)))


def _window(files: list[bytes]) -> bytes:
    good = files[0]
    at = good.index(b"dataWindow\0box2i\0") + 17 + 4
    return good[: at + 8] + struct.pack("<ii", 999_999, 999_999) + good[at + 16 :]


def _large_window(files: list[bytes]) -> bytes:
    """Within the limit of pixels, but not in a file of this size."""
    good = files[0]
    at = good.index(b"dataWindow\0box2i\0") + 17 + 4
    return good[: at + 8] + struct.pack("<ii", 11_000, 11_000) + good[at + 16 :]


def _tiles(files: list[bytes]) -> bytes:
    good = next(f for f in files if b"tiledesc" in f)
    at = good.index(b"tiles\0tiledesc\0") + 15 + 4
    return good[:at] + struct.pack("<II", 1_000_000, 1_000_000) + good[at + 8 :]


def _png(bits: int) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", 11_000, 11_000, bits, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"\0" * 99)) + chunk(b"IEND", b"")


def _ply(words: str, folder: Path) -> bytes:
    return _meshes(folder)["ply"][1].replace(b"element vertex 4", words.encode())


def _serialized() -> bytes:
    body = struct.pack("<I", 0x1000) + b"a\0" + struct.pack("<QQ", 10**12, 10**12)
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(body + bytes(100_000)) + struct.pack("<QI", 0, 1)


CASES = {
    "exr-window": ("exr", lambda folder: _exr(_window)),
    "exr-large-window": ("exr", lambda folder: _exr(_large_window)),
    "exr-tiles": ("exr", lambda folder: _exr(_tiles)),
    "environment-window": ("exr-environment", lambda folder: _exr(_large_window)),
    "hdr": ("hdr", lambda folder: b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n" + b"\2\2\7\7" * 9),
    "hdr-large": ("hdr", lambda folder: b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 11000 +X 11000\n\2\2\x2a\xf8" + bytes(99)),
    "png": ("png", lambda folder: _png(8)),
    "png-16": ("png", lambda folder: _png(16)),
    "ply": ("ply", lambda folder: _ply("element vertex 1000000000000", folder)),
    "ply-2^32": ("ply", lambda folder: _ply("element vertex 4294967300", folder)),
    "serialized": ("serialized", lambda folder: _serialized()),
    "obj": ("obj", lambda folder: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4294967295\nf 1 2 99999999999999\n"),
    "film": ("scene", lambda folder: _film("1000000", "1000000")),
    "report": (
        "report",
        lambda folder: b'size = [1000000, 1000000]\n[[group]]\nscenes = ["torus"]\ntechniques = ["diffuse-sh9"]\n',
    ),
}


def _film(width: str, height: str) -> bytes:
    from small_scene import scene_xml

    text = scene_xml().replace('name="width" value="48"', f'name="width" value="{width}"')
    return text.replace('name="height" value="40"', f'name="height" value="{height}"').encode()


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory) -> dict[str, tuple[str, int]]:
    """case → what came of it, growth of memory [KiB]; in one process, which a crash would end."""
    folder = tmp_path_factory.mktemp("huge")
    for case, (_, make) in CASES.items():
        (folder / case).write_bytes(make(folder))
    names = json.dumps({case: name for case, (name, _) in CASES.items()})
    words = [sys.executable, "-c", READ, str(Path(__file__).parent), names, str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith('["')]
    return {case: (outcome, growth) for case, outcome, growth in found}


@pytest.mark.parametrize("case", CASES)
def test_refused_before_it_is_made(outcomes, case):
    outcome, growth = outcomes[case]
    assert outcome.startswith("refused: ") and "bad_alloc" not in outcome and "MemoryError" not in outcome
    assert growth << 10 < GROWTH / 2, growth  # Mitsuba itself takes some 100 MB when it first loads a scene


def test_the_measure_sees_memory():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    block = bytearray(1 << 30)
    block[:: 1 << 12] = b"x" * len(block[:: 1 << 12])
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) << 10 > GROWTH / 2 or before << 10 > 1 << 30
