"""Asking a place that may not answer: each sort of trouble is told once, in one line; who fails too often is asked no more."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from evalsuite.store.claims import FULL

#: Failures in a row after which a run asks no more for this, and for nothing more when it was only asked what is there.
FAILURES = 3
#: Longest that an answer may take [s], and for what is moved besides the least rate [bytes/s].
LIMIT_S, RATE = 60.0, 1e6
#: An answer later than this [s] is worth a word.
SLOW_S = 15.0
#: Kinds of requests, in words.
_DONE = {"look": "asked", "read": "read", "write": "written"}
_GOES_ON = "; the run goes on with the local store"


class NoAnswer(Exception):
    """Trouble that was told; its text says which."""


class Asking:
    """Safe among threads. name: of the place, for messages. discreet: a library's words without secrets, in one line."""

    def __init__(self, name: str, discreet: Callable[[str], str], warn: Callable[[str], None]) -> None:
        self._name, self._discreet, self._warn = name, discreet, warn
        self._told: set[object] = set()
        self._failed: Counter[str] = Counter()
        self._lock = threading.Lock()

    def left(self, doing: str) -> bool:
        """Whether it is asked no more. doing: "look", "read" or "write"."""
        return max(self._failed["look"], self._failed[doing]) >= FAILURES

    def ask(self, doing: str, function: Callable, *arguments: object, size: int = 0) -> Any:
        """What the place answers. size: bytes to be moved. Raises NoAnswer where it does not, OSError when there is no room for
        what is read."""
        if self.left(doing):
            raise NoAnswer(f"not {_DONE[doing]} any more")
        began, limit = time.monotonic(), LIMIT_S + size / RATE
        try:
            found = _within(limit, function, *arguments)
        except TimeoutError as error:
            raise self._trouble(doing, TimeoutError(f"no answer in {time.monotonic() - began:.0f} s")) from error
        except Exception as error:
            if doing == "read" and isinstance(error, OSError) and error.errno in FULL:
                raise
            raise self._trouble(doing, error) from error
        with self._lock:
            self._failed[doing] = 0
        took = time.monotonic() - began
        if took > SLOW_S + size / RATE:
            self.tell("slow", f"slow, {took:.0f} s for {size / 1e6:.1f} MB")
        return found

    def tell(self, kind: object, text: str) -> None:
        """Warn of something, once of its kind."""
        with self._lock:
            fresh = kind not in self._told
            self._told.add(kind)
        if fresh:
            self._warn(f"{self._name}: {text}")

    def _trouble(self, doing: str, error: Exception) -> NoAnswer:
        why = (isinstance(error, OSError) and error.strerror) or str(error) or type(error).__name__
        what = f"cannot be {_DONE[doing]} ({self._discreet(why)})"
        self.tell((doing, type(error), getattr(error, "errno", None)), what + _GOES_ON)
        with self._lock:
            self._failed[doing] += 1
            over = self._failed[doing] >= FAILURES
        if over:
            self.tell((doing, "over"), f"not {_DONE[doing]} any more in this run, after {FAILURES} failures in a row")
        return NoAnswer(what)


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
