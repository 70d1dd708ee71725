"""The store's second tier: entries in a place that other machines see too, any that fsspec knows.

Each is one archive, `<url>/<kind>/<key[:2]>/<key>.zip`, there whole or not at all. An entry's name decides its content: what one
has sent the others need not. No run rests on the place: what goes wrong there is told in one line, and the run goes on with its
local store.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.store.archive import Damaged, pack, unpack
from evalsuite.store.asking import Asking, NoAnswer
from evalsuite.store.place import Place

VARIABLE = "EVALSUITE_SHARED"
#: Largest archive [bytes]: twice a reference of the most pixels that a picture may have.
LARGEST = 16 << 30


class Shared:
    """Archives of entries at a URL. Safe among threads, processes and machines.

    warn: told each kind of trouble once, in one line. Raises EvalsuiteError for a URL that can never work."""

    def __init__(self, url: str, warn: Callable[[str], None] = lambda text: None) -> None:
        self.place = Place(url, VARIABLE)
        self.url = self.place.url
        self._asking = Asking(f"shared store {self.place.shown}", self.place.discreet, warn)
        self._damaged: set[str] = set()

    def has(self, kind: str, key: str) -> bool:
        """Whether an archive of the entry is there; nothing is fetched."""
        try:
            return self._asking.ask("look", self.place.size, _name(kind, key)) is not None
        except NoAnswer:
            return False

    def fetch(self, kind: str, key: str, folder: Path) -> bool:
        """Fill an empty folder with an entry's files; False where there is no whole one, then rests may lie in it. Uses
        `<folder>.zip` meanwhile. Raises OSError when the folder's disk is full."""
        name, archive = _name(kind, key), folder.with_name(f"{folder.name}.zip")
        try:
            if self._asking.left("read") or (size := self._asking.ask("look", self.place.size, name)) is None:
                return False
            if size > LARGEST:
                raise Damaged(f"{size} bytes")
            self._asking.ask("read", self.place.get, name, archive, size=size)
            unpack(archive, folder, f"{kind}/{key}")
            return True
        except NoAnswer:
            return False
        except Damaged as error:
            self._damaged.add(name)
            self._asking.tell("damaged", f"{name} is damaged ({self.place.discreet(str(error))}); made anew and replaced")
            return False
        finally:
            archive.unlink(missing_ok=True)

    def send(self, kind: str, key: str, folder: Path, archive: Path, *, anew: bool = False) -> bool:
        """Put an entry there unless it is; whether that was done. archive: a name to pack it under, on a disk with room.
        anew: also where it is."""
        name = _name(kind, key)
        anew = anew or name in self._damaged
        try:
            if self._asking.left("write") or (not anew and self._asking.ask("look", self.place.size, name) is not None):
                return False
            made = folder.stat().st_ino
            pack(folder, archive, f"{kind}/{key}")
            if folder.stat().st_ino != made:  # another run's --no-cache has put its own in place meanwhile, and sends that
                return False
            self._asking.ask("write", self.place.put, archive, name, size=archive.stat().st_size)
            return True
        except NoAnswer:
            return False
        except OSError as error:
            self._asking.tell(("pack", error.errno), f"nothing sent there ({archive.parent}: {error.strerror or error})")
            return False
        finally:
            archive.unlink(missing_ok=True)

    def facts(self) -> dict:
        """{"url": without credentials, "entries", "megabytes", "problem": why it cannot be listed, or None}."""
        sizes, problem = {}, None
        try:
            sizes = Asking("", self.place.discreet, lambda text: None).ask("look", self.place.sizes)
        except NoAnswer as error:
            problem = str(error)
        files = [size for name, size in sizes.items() if re.fullmatch(r"\w+/\w+/\w+\.zip", name)]
        megabytes = round(sum(files) / 1e6, 1)
        return {"url": self.place.shown, "entries": len(files), "megabytes": megabytes, "problem": problem}


def checks() -> list[dict]:
    """What `doctor` says of $EVALSUITE_SHARED: {name, ok, text, fix}, nothing where it is not set."""
    url = os.environ.get(VARIABLE)
    if not url:
        return []
    try:
        found = Shared(url).facts()
    except EvalsuiteError as error:
        return [{"name": "Shared store", "ok": False, "text": str(error), "fix": f"another {VARIABLE}, or none"}]
    text = f"{found['url']}: " + (found["problem"] or f"{found['entries']} entries, {found['megabytes']} MB")
    return [{"name": "Shared store", "ok": not found["problem"], "text": text, "fix": f"another {VARIABLE}, or none"}]


def _name(kind: str, key: str) -> str:
    return f"{kind}/{key[:2]}/{key}.zip"
