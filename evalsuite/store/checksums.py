"""SHA-256 of every file of an entry, in a file beside them that `sha256sum --check` reads too."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

#: `<hex digest>  <name>` a line, sorted by name; the file itself is not in it.
SUMS = "SHA256SUMS"


@dataclass(frozen=True)
class Damage:
    """A file that is not what was written. file: its path. found, expected: SHA-256 (hex), or words where there is none."""

    file: Path
    found: str
    expected: str


def write(folder: Path) -> None:
    """Sum all files of a folder up. Raises OSError."""
    (folder / SUMS).write_text("".join(f"{_sum(path)}  {path.name}\n" for path in _files(folder)), encoding="utf-8")


def damages(folder: Path) -> list[Damage] | None:
    """What differs from the sums, whichever of both was damaged; empty for a whole entry, None for one without sums.

    A file that cannot be read is damaged; so is one that no sum speaks of. Raises FileNotFoundError when the folder is gone."""
    try:
        lines = (folder / SUMS).read_bytes().decode("utf-8", "replace").split("\n")
    except FileNotFoundError:
        folder.stat()
        return None
    except OSError as error:
        return [Damage(folder / SUMS, error.strerror or str(error), "sums that read")]
    stated = {name: digest for digest, _, name in (line.partition("  ") for line in lines if line)}
    there = {path.name: path for path in _files(folder)}
    found = []
    for name in sorted(stated.keys() | there):
        expected = stated.get(name, "no such file")
        try:
            got = _sum(there[name]) if name in there else "no file"
        except OSError as error:
            got = error.strerror or str(error)
        if got != expected:
            found.append(Damage(folder / name.replace("\0", ""), got, expected))
    return found


def seal(data: bytes) -> bytes:
    """Bytes of a lone file with their own SHA-256 (binary) in front."""
    return hashlib.sha256(data).digest() + data


def unseal(sealed: bytes) -> bytes | None:
    """What was sealed, None when it is damaged."""
    digest, data = sealed[:32], sealed[32:]
    return data if hashlib.sha256(data).digest() == digest else None


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.name != SUMS)


def _sum(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
