"""An entry as one file, for places that know no folders: a ZIP archive without compression (pictures are float32 noise, which
deflates by a twentieth), the same bytes for the same content whoever packs it and when.

What others packed is not trusted: an archive holds no more than its own bytes, in plain files of one folder, for the entry that
it says it is of, with the checksums that it says it has. Anything else is damaged.
"""

from __future__ import annotations

import json
import re
import shutil
import struct
import zipfile
from pathlib import Path

from evalsuite.store import checksums
from evalsuite.store.claims import FULL

#: Most files of an entry; those with most have a dozen.
FILES = 256
_MOMENT = (1980, 1, 1, 0, 0, 0)  # the earliest that the format can tell
_NAME = re.compile(r"[\w=+-][\w.=+-]*", re.ASCII)
_CHUNK = 1 << 20


class Damaged(ValueError):
    """An archive that is not what was packed; its text says why."""


def pack(folder: Path, archive: Path, label: str) -> None:
    """Put the files of a folder into an archive. label: what it is of, ASCII. Raises OSError."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as packed:
        packed.comment = label.encode("ascii")
        for path in sorted(folder.iterdir()):
            about = zipfile.ZipInfo(path.name, _MOMENT)
            about.create_system, about.external_attr, about.file_size = 3, 0o644 << 16, path.stat().st_size
            with path.open("rb") as source, packed.open(about, "w") as target:
                shutil.copyfileobj(source, target, _CHUNK)


def unpack(archive: Path, folder: Path, label: str) -> None:
    """Put the files of an archive into an empty folder, and hold them against their checksums.

    Raises Damaged; OSError when the folder's disk is full."""
    try:
        with zipfile.ZipFile(archive) as packed:
            members = packed.infolist()
            _plain(members, archive.stat().st_size)
            if packed.comment != label.encode("ascii"):
                raise Damaged("the entry of another key")
            for member in members:
                with packed.open(member) as source, (folder / member.filename).open("xb") as target:
                    shutil.copyfileobj(source, target, _CHUNK)
        if checksums.damages(folder) != []:
            raise Damaged("files that are not those of its checksums")
        if not isinstance(json.loads((folder / "meta.json").read_bytes()), dict):
            raise Damaged("no metadata")
    except OSError as error:
        if error.errno in FULL:
            raise
        raise Damaged(error.strerror or str(error)) from error
    except Damaged:
        raise
    # All that zipfile and json say of bytes that make no sense.
    except (zipfile.BadZipFile, EOFError, struct.error, ValueError, RuntimeError, OverflowError) as error:
        raise Damaged(str(error) or "cut short") from error


def _plain(members: list[zipfile.ZipInfo], size: int) -> None:
    """Refuse names that lead elsewhere, and more files or bytes than there can be."""
    if len(members) > FILES:
        raise Damaged(f"{len(members)} files")
    for member in members:
        if not _NAME.fullmatch(member.filename):
            raise Damaged("a name that is no plain file's")
        if member.compress_type != zipfile.ZIP_STORED or member.compress_size != member.file_size:
            raise Damaged("compressed files")
    if sum(member.file_size for member in members) > size:
        raise Damaged("more bytes than it has")
