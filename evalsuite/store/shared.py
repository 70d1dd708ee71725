"""The store's second tier: entries in a place that other machines see too, any that fsspec knows.

Each is one archive, `<url>/<kind>/<key[:2]>/<key>.zip`, there whole or not at all. An entry's name decides its content: what one
has sent the others need not. No run rests on the place: what goes wrong there is told in one line, and the run goes on with its
local store.
"""

from __future__ import annotations

import os
import re
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from evalsuite.errors import EvalsuiteError
from evalsuite.store.archive import Damaged, pack, unpack
from evalsuite.store.claims import FULL
from evalsuite.store.place import Place

VARIABLE = "EVALSUITE_SHARED"
#: Failures in a row to read, or to write, after which a run leaves it.
FAILURES = 3
#: Longest that an answer may take [s], and for what is moved besides the least rate [bytes/s].
LIMIT_S, RATE = 60.0, 1e6
#: An answer later than this [s] is worth a word.
SLOW_S = 15.0
#: Largest archive [bytes]: twice a reference of the most pixels that a picture may have.
LARGEST = 16 << 30


class Shared:
    """Archives of entries at a URL. Safe among threads, processes and machines.

    warn: told each kind of trouble once, in one line. Raises EvalsuiteError for a URL that can never work."""

    def __init__(self, url: str, warn: Callable[[str], None] = lambda text: None) -> None:
        self.place, self.warn = Place(url, VARIABLE), warn
        self.url = self.place.url
        self._told: set[object] = set()
        self._failed: Counter[str] = Counter()
        self._damaged: set[str] = set()
        self._lock = threading.Lock()

    def has(self, kind: str, key: str) -> bool:
        """Whether an archive of the entry is there; nothing is fetched."""
        return self._ask("read", self.place.size, _name(kind, key)) is not None

    def fetch(self, kind: str, key: str, folder: Path) -> bool:
        """Fill an empty folder with an entry's files; False where there is no whole one, then rests may lie in it. Uses
        `<folder>.zip` meanwhile. Raises OSError when the folder's disk is full."""
        name, archive = _name(kind, key), folder.with_name(f"{folder.name}.zip")
        size = self._ask("read", self.place.size, name)
        if size is None:
            return False
        try:
            if size > LARGEST:
                raise Damaged(f"{size} bytes")
            if not self._ask("read", self.place.get, name, archive, size=size):
                return False
            unpack(archive, folder, f"{kind}/{key}")
        except Damaged as error:
            with self._lock:
                self._damaged.add(name)
            self._tell("damaged", f"{name} is damaged ({self.place.discreet(str(error))}); made anew and replaced")
            return False
        finally:
            archive.unlink(missing_ok=True)
        return True

    def send(self, kind: str, key: str, folder: Path, archive: Path, *, anew: bool = False) -> bool:
        """Put an entry there unless it is; whether that was done. archive: a name to pack it under, on a disk with room.
        anew: also where it is."""
        name = _name(kind, key)
        if self._failed["write"] >= FAILURES or (not anew and name not in self._damaged and self.has(kind, key)):
            return False
        try:
            made = folder.stat().st_ino
            pack(folder, archive, f"{kind}/{key}")
            # Another run's --no-cache may have put its own in place meanwhile, and then sends that.
            size = archive.stat().st_size
            return folder.stat().st_ino == made and bool(self._ask("write", self.place.put, archive, name, size=size))
        except OSError as error:
            self._tell(("pack", error.errno), f"nothing sent there ({archive.parent}: {error.strerror or error})")
            return False
        finally:
            archive.unlink(missing_ok=True)

    def facts(self) -> dict:
        """{"url": without credentials, "entries", "megabytes", "problem": why it cannot be listed, or None}."""
        problems: list[str] = []
        sizes = Shared(self.url, problems.append)._ask("read", self.place.sizes) or {}
        files = [size for name, size in sizes.items() if re.fullmatch(r"\w+/\w+/\w+\.zip", name)]
        about = {"url": self.place.shown, "entries": len(files), "megabytes": round(sum(files) / 1e6, 1)}
        return about | {"problem": problems[0] if problems else None}

    def _ask(self, doing: str, function: Callable, *arguments: object, size: int = 0) -> Any:
        """What the place answers; None where it does not, which is told. Raises OSError when the local disk is full."""
        if self._failed[doing] >= FAILURES:
            return None
        began, limit = time.monotonic(), LIMIT_S + size / RATE
        try:
            found = _within(limit, function, *arguments)
        except TimeoutError:
            self._trouble(doing, TimeoutError(f"no answer in {limit:.0f} s"))
        except Exception as error:
            if doing == "read" and isinstance(error, OSError) and error.errno in FULL:
                raise
            self._trouble(doing, error)
        else:
            with self._lock:
                self._failed[doing] = 0
            took = time.monotonic() - began
            if took > SLOW_S + size / RATE:
                self._tell("slow", f"slow, {took:.0f} s for {size / 1e6:.1f} MB")
            return found
        return None

    def _trouble(self, doing: str, error: Exception) -> None:
        done = {"read": "read", "write": "written"}[doing]
        why = (isinstance(error, OSError) and error.strerror) or str(error) or type(error).__name__
        kind = (doing, type(error), getattr(error, "errno", None))
        self._tell(kind, f"cannot be {done} ({self.place.discreet(why)}); the run goes on with the local store")
        with self._lock:
            self._failed[doing] += 1
            over = self._failed[doing] >= FAILURES
        if over:
            self._tell((doing, "over"), f"not {done} any more in this run, after {FAILURES} failures in a row")

    def _tell(self, kind: object, text: str) -> None:
        with self._lock:
            fresh = kind not in self._told
            self._told.add(kind)
        if fresh:
            self.warn(f"shared store {self.place.shown}: {text}")


def checks() -> list[dict]:
    """What `doctor` says of $EVALSUITE_SHARED: {name, ok, text, fix}, nothing where it is not set."""
    url = os.environ.get(VARIABLE)
    if not url:
        return []
    try:
        found = Shared(url).facts()
    except EvalsuiteError as error:
        return [{"name": "Shared store", "ok": False, "text": str(error), "fix": f"another {VARIABLE}, or none"}]
    text = found["problem"] or f"{found['url']}: {found['entries']} entries, {found['megabytes']} MB"
    return [{"name": "Shared store", "ok": not found["problem"], "text": text, "fix": f"another {VARIABLE}, or none"}]


def _name(kind: str, key: str) -> str:
    return f"{kind}/{key[:2]}/{key}.zip"


def _within(limit: float, function: Callable, *arguments: object) -> Any:
    """What a function returns or raises; TimeoutError after `limit` seconds, and it is left to itself."""
    answer: Future = Future()

    def ask() -> None:
        try:
            answer.set_result(function(*arguments))
        except BaseException as error:
            answer.set_exception(error)

    threading.Thread(target=ask, daemon=True).start()
    return answer.result(limit)
