"""Worker processes. Native code (Mitsuba, OpenGL, FLIP) can abort, hang or run out of memory; it runs here, never in the
main process, and a death costs the one task that caused it.

A `Lane` is one worker process that does one task at a time. One process per lane, because a death breaks the whole
`ProcessPoolExecutor` it happens in.
"""

from __future__ import annotations

import atexit
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from concurrent.futures.process import BrokenProcessPool
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue

from evalsuite.errors import WorkerFailed

#: Longest that one task may take [s]. A reference advances in chunks well below it, so that only a hang gets here.
TASK_LIMIT_S = 1800.0
#: Cells under way at a time, of which each holds some ten megabytes.
MOST_CELLS = 1024


def _start_worker(log: str, threads: int | None) -> None:
    """First thing in a worker: native libraries print to a log instead of the user's terminal, Ctrl-C is the parent's to
    handle, and a worker whose parent was killed ends itself."""
    if threads and not os.environ.get("EVALSUITE_THREADS"):
        os.environ["EVALSUITE_THREADS"] = str(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    os.dup2(descriptor, 1)
    os.dup2(descriptor, 2)
    parent = multiprocessing.parent_process()

    def end_with_parent() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()


def _invoke(function: str, *arguments: object) -> object:
    module, name = function.split(":")
    return getattr(import_module(module), name)(*arguments)


class Lane:
    """One worker process, restarted after a death.

    submit("package.module:function", *arguments) returns a Future (a name, so that the main process need not import what
    the worker runs). EvalsuiteError raised by the function arrives as it is, a death or a hang arrives as WorkerFailed
    with the last line that the process wrote. threads: of Mitsuba in it, where no EVALSUITE_THREADS says otherwise.
    """

    width, cores = 1, os.cpu_count() or 1

    def __init__(self, name: str, limit_s: float = TASK_LIMIT_S, threads: int | None = None) -> None:
        self.name, self._limit_s, self._threads = name, limit_s, threads
        self._queue = ThreadPoolExecutor(1, thread_name_prefix=name)
        self._pool: ProcessPoolExecutor | None = None
        handle, self._log = tempfile.mkstemp(prefix=f"evalsuite-{name}-", suffix=".log")
        os.close(handle)
        self._closed = False
        atexit.register(self.close)

    def submit(self, function: str, *arguments: object) -> Future:
        return self._queue.submit(self._run, function, arguments)

    def call(self, function: str, *arguments: object) -> object:
        return self.submit(function, *arguments).result()

    def _run(self, function: str, arguments: tuple) -> object:
        if self._closed:
            raise WorkerFailed(self.name, "no worker", "a running one", "the run was interrupted")
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            with _importable_main():
                self._pool = ProcessPoolExecutor(
                    1, mp_context=context, initializer=_start_worker, initargs=(self._log, self._threads)
                )
                future = self._pool.submit(_invoke, function, *arguments)
        else:
            future = self._pool.submit(_invoke, function, *arguments)
        processes = list((self._pool._processes or {}).values())
        try:
            return future.result(self._limit_s)
        except BrokenProcessPool:
            codes = _exit_codes(processes)
            self._stop()
            raise WorkerFailed(
                f"{self.name} worker",
                f"a dead process ({_describe_exit(codes)}{self._last_words()})",
                "a result",
                "this cell is lost, the others go on; `evalsuite doctor` tests the machine",
            ) from None
        except FutureTimeout:
            self._stop()
            raise WorkerFailed(
                f"{self.name} worker", f"no answer in {self._limit_s:.0f} s", "a result", "this cell is lost, the others go on"
            ) from None
        except MemoryError:
            raise WorkerFailed(
                f"{self.name} worker", "out of memory", "enough memory for the task", "use a smaller --size or environment"
            ) from None

    def _last_words(self) -> str:
        try:
            lines = Path(self._log).read_text(errors="replace").strip().splitlines()
        except OSError:
            return ""
        return f"; its last line was: {lines[-1][:200]}" if lines else ""

    def _stop(self) -> None:
        pool, self._pool = self._pool, None
        if pool is None:
            return
        processes = list((pool._processes or {}).values())
        for process in processes:
            process.kill()
        pool.shutdown(wait=True, cancel_futures=True)

    def close(self) -> None:
        """End the worker now; tasks still queued fail."""
        if self._closed:
            return
        self._closed = True
        self._queue.shutdown(wait=False, cancel_futures=True)
        self._stop()
        Path(self._log).unlink(missing_ok=True)


def _exit_codes(processes: list) -> list[int]:
    """The executor's own thread reaps the process too, and whoever comes second sees no code until the first has filed it."""
    for _ in range(100):
        codes = [process.exitcode for process in processes if process.exitcode is not None]
        if codes:
            return codes
        time.sleep(0.02)
    return []


def _describe_exit(codes: list[int]) -> str:
    if not codes:
        return "no exit code"
    code = codes[0]
    try:
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
    except ValueError:
        return f"exit code {code}"


class _importable_main:
    """A spawned process re-imports `__main__` by its file; `python -`, notebooks and consoles have none that exists."""

    def __enter__(self) -> None:
        self._main = sys.modules["__main__"]
        self._file = getattr(self._main, "__file__", None)
        self._hide = self._file is not None and not os.path.exists(self._file)
        if self._hide:
            del self._main.__file__

    def __exit__(self, *_: object) -> None:
        if self._hide:
            self._main.__file__ = self._file


class Pool:
    """`width` lanes that take tasks as they become free; same interface as one. cores: that all of them have."""

    def __init__(self, name: str, width: int, threads: int | None = None) -> None:
        self.width, self.cores = width, os.cpu_count() or 1
        self._lanes = [Lane(name if width == 1 else f"{name}-{k}", threads=threads) for k in range(width)]
        self._free: SimpleQueue[Lane] = SimpleQueue()
        for lane in self._lanes:
            self._free.put(lane)
        self._queue = ThreadPoolExecutor(width, thread_name_prefix=name)

    def submit(self, function: str, *arguments: object) -> Future:
        return self._queue.submit(self._on_a_free_lane, function, arguments)

    def call(self, function: str, *arguments: object) -> object:
        return self.submit(function, *arguments).result()

    def _on_a_free_lane(self, function: str, arguments: tuple) -> object:
        lane = self._free.get()
        try:
            return lane.call(function, *arguments)
        finally:
            self._free.put(lane)

    def close(self) -> None:
        self._queue.shutdown(wait=False, cancel_futures=True)
        for lane in self._lanes:
            lane.close()


class Workers:
    """The workers of a run: `gpu` for OpenGL, which uses all cores by itself; `reference` for Mitsuba, `jobs` processes that
    share the cores (by default one that uses all); the same as `passes` for the samples of references; `formulas` for techniques
    in float64; `compare` for comparisons. cells: how many cells are worth having under way at a time."""

    def __init__(self, jobs: int | None = None) -> None:
        cores = os.cpu_count() or 1
        self.gpu, self.formulas = Lane("gpu"), Lane("formulas")
        self.reference = Pool("reference", jobs or 1, threads=-(-cores // jobs) if jobs else None)
        self.passes = self.reference
        self.compare = Pool("compare", max(1, jobs or cores))

    @property
    def cells(self) -> int:
        return min(2 + self.compare.width, 8) if self.passes.width == 1 else min(2 + 2 * self.passes.width, MOST_CELLS)

    def close(self) -> None:
        for lane in (self.gpu, self.reference, self.formulas, self.compare):
            lane.close()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
