"""A store's upkeep: find what its disk has damaged, make room without taking from a running process what it uses."""

from __future__ import annotations

import math
import re
import shutil
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.store import checksums
from evalsuite.store.cache import PARTIAL, Store, unwritable
from evalsuite.store.checksums import Damage
from evalsuite.store.claims import exclusive, living, sweep

_UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12, "KI": 2**10, "MI": 2**20, "GI": 2**30, "TI": 2**40}

#: What is on its way out.
_GONE = ".gone-"


@dataclass(frozen=True)
class Held:
    """Something of a store. used: its last use by the store's clock [ns], 0 for what no run reads any more. size: bytes."""

    path: Path
    used: int
    size: int


def bytes_of(text: str) -> int:
    """ "10GB", "500 MB", "2GiB" or a plain number, in bytes. Raises EvalsuiteError."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMGT]I?)?B?", text.strip().upper())
    if not found:
        raise EvalsuiteError(f"--max-size {text}", "no size", "a number and a unit, as 10GB, 500MB or 2GiB")
    return int(float(found[1]) * _UNITS[found[2] or ""])


def things(store: Store) -> Iterator[Path]:
    """Entries and references on their way."""
    yield from (folder for _, folder in store.entries())
    yield from sorted(store.root.glob("partial/[!.]*"))


def verify(paths: Iterable[Path]) -> Iterator[tuple[Path, list[Damage] | None]]:
    """Each with what is damaged about it; None for what an earlier version left without sums, which is never read."""
    for path in paths:
        try:
            if path.is_dir():
                yield path, checksums.damages(path)
            elif path.suffix != PARTIAL:
                yield path, None
            else:
                whole = checksums.unseal(path.read_bytes()) is not None
                yield path, [] if whole else [Damage(path, "other bytes", "those that its own SHA-256 is of")]
        except FileNotFoundError:  # a run or a prune was quicker
            continue
        except OSError as error:
            yield path, [Damage(path, error.strerror or str(error), "a file that reads")]


def remove(store: Store, paths: Iterable[Path]) -> None:
    """Take damaged ones out: the next run makes them anew. Raises Unwritable."""
    with _alone(store):
        for path in paths:
            _away(path)


def prune(store: Store, most: int, *, dry_run: bool = False) -> dict:
    """Remove what was used least recently until the store holds at most `most` bytes, and what killed processes left behind.
    What a living process has used stays, and all references on their way while one lives. Needs no space. Raises Unwritable.

    Returns bytes before and after, and counts: removed, kept_in_use, left_by_killed."""
    swept, others = 0, []
    if store.root.is_dir():
        with _alone(store):
            swept = 0 if dry_run else _sweep(store)
            others = living(store.root)
    since = min(others, default=math.inf)
    held = sorted((h for path in things(store) if (h := _held(path))), key=lambda h: (h.used, str(h.path)))
    before = total = sum(h.size for h in held)
    removed, in_use = 0, 0
    for one in held:
        if total <= most:
            break
        if one.used >= since or (others and one.path.suffix == PARTIAL):
            in_use += 1
            continue
        if not dry_run:
            with _alone(store):
                now = _held(one.path)
                if now is None or now.used != one.used:  # used since we looked
                    in_use += 1
                    continue
                _away(one.path)
        removed, total = removed + 1, total - one.size
    return {
        "before": before,
        "after": total,
        "removed": removed,
        "kept_in_use": in_use,
        "left_by_killed": swept,
        "dry_run": dry_run,
    }


@contextmanager
def _alone(store: Store) -> Iterator[None]:
    try:
        with exclusive(store.root):
            yield
    except OSError as error:
        raise unwritable(store.root, error) from error


def _sweep(store: Store) -> int:
    leftovers = list(store.root.glob(f"[!.]*/*/{_GONE}*"))
    for leftover in leftovers:
        shutil.rmtree(leftover, ignore_errors=True)
    return sweep(store.root) + len(leftovers)


def _held(path: Path) -> Held | None:
    try:
        if path.is_file():
            return Held(path, path.stat().st_mtime_ns if path.suffix == PARTIAL else 0, path.stat().st_size)
        size = sum(file.stat().st_size for file in path.iterdir())
        return Held(path, path.stat().st_mtime_ns if (path / checksums.SUMS).exists() else 0, size)
    except FileNotFoundError:
        return None


def _away(path: Path) -> None:
    """Out of its place in one step, so that nobody finds half an entry."""
    gone = path.with_name(f"{_GONE}{uuid.uuid4().hex[:8]}")
    try:
        path.rename(gone)
    except FileNotFoundError:
        return
    shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
    with suppress(OSError):  # others are there
        path.parent.rmdir()
