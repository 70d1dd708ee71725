"""Who uses a store now, and in which order its entries were used last.

Order is kept by a clock that only goes forward: a tick is the time of day, or a nanosecond after the last tick where the time of
day has been set back. `.clock` bears the last one as its modification time, an entry that of its last use.

A running process has a folder `.runs/<tick>-<id>/` with a lock that it holds as long as it lives, however it ends, and fills new
entries there. What has been used since the oldest living run began is in use; the folder of a dead one is swept away.
"""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import threading
import time
import uuid
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from evalsuite.image.files import UNFINISHED

#: What a folder that others may fill and we may only read answers.
READ_ONLY = (errno.EROFS, errno.EACCES, errno.EPERM)
FULL = (errno.ENOSPC, errno.EDQUOT)


def tick(root: Path) -> int:
    """A moment [ns since 1970] later than all before it in this store, whatever the machine's clock does. Raises OSError."""
    clock = root / ".clock"
    try:
        last = clock.stat().st_mtime_ns
    except FileNotFoundError:
        clock.touch()
        last = 0
    now = max(time.time_ns(), last + 1)
    os.utime(clock, ns=(now, now))
    return now


@contextmanager
def exclusive(root: Path) -> Iterator[None]:
    """Alone among all processes and threads that look for, place and remove entries; held for microseconds."""
    with _threads, FileLock(root / ".lock", poll_interval=0.002, mode=0o666):
        yield


_threads = threading.Lock()  # waiting for it costs less than polling a file


class Claim:
    """A process's use of a store, from now to its end. Raises OSError when there is no way to a store.

    problem: why it cannot be written, or None. What is made for a read-only store meanwhile goes to a temporary folder; a full
    disk is for the user to clear, so `room` raises it."""

    def __init__(self, root: Path) -> None:
        self.root, self.problem = root, None
        try:
            root.mkdir(parents=True, exist_ok=True)
            with exclusive(root):
                sweep(root)
                self.begun = tick(root)
                self.folder = root / ".runs" / f"{self.begun}-{uuid.uuid4().hex[:8]}"
                self.folder.mkdir(parents=True)
                self._lock = FileLock(self.folder / "lock", timeout=0, thread_local=False)
                self._lock.acquire()
            weakref.finalize(self, _end, self.folder, self._lock, os.getpid())
        except OSError as error:
            if error.errno not in (*READ_ONLY, *FULL):
                raise
            self.problem = error
            self._spare = tempfile.TemporaryDirectory(prefix="evalsuite-") if error.errno in READ_ONLY else None
            self.folder = Path(self._spare.name) if self._spare else root

    @property
    def keeps(self) -> bool:
        """Whether what is made stays in the store."""
        return self.problem is None

    def room(self) -> Path:
        """A new empty folder of this process's own, on the store's disk where that can be written. Raises OSError."""
        if self.problem and not self._spare:
            raise self.problem
        folder = self.folder / uuid.uuid4().hex[:12]
        folder.mkdir()
        return folder

    def use(self, place: Path) -> bool:
        """Note that an entry is used now; False when there is none."""
        if not place.is_dir():
            return False
        if not self.keeps:
            return True
        with exclusive(self.root):
            return touch(place, tick(self.root))


def touch(place: Path, moment: int) -> bool:
    try:
        os.utime(place, ns=(moment, moment))
    except FileNotFoundError:
        return False
    return True


def living(root: Path) -> list[int]:
    """When each running process began, by the store's clock. Only within `exclusive`: to ask for a lock is to hold it a while."""
    return [int(folder.name.split("-")[0]) for folder in _runs(root) if _lives(folder)]


def sweep(root: Path) -> int:
    """Remove what killed processes left half done; returns how many there were. Only within `exclusive`."""
    dead = [folder for folder in _runs(root) if not _lives(folder)]
    for folder in dead:
        shutil.rmtree(folder, ignore_errors=True)
    # A worker's file does not say whose it is.
    leftovers = [] if living(root) else list(root.glob(f"partial/{UNFINISHED}*"))
    for leftover in leftovers:
        leftover.unlink(missing_ok=True)
    return len(dead) + len(leftovers)


def _runs(root: Path) -> list[Path]:
    return [folder for folder in (root / ".runs").glob("*-*") if folder.name.split("-")[0].isdigit()]


def _lives(folder: Path) -> bool:
    try:
        with FileLock(folder / "lock", timeout=0):
            return False
    except Timeout:
        return True
    except OSError:  # another's folder that we cannot open, or one just gone
        return folder.exists()


def _end(folder: Path, lock: FileLock, owner: int) -> None:
    if os.getpid() != owner:  # a fork's end is not ours
        return
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        lock.release()
