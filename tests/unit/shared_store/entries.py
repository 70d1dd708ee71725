"""What the tests put into a store."""

from __future__ import annotations

from pathlib import Path


def fill(folder):
    (folder / "a.bin").write_bytes(bytes(range(256)) * 4)
    (folder / "b.bin").write_bytes(b"b")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}
