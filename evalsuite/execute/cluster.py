"""Workers on many machines, through a Dask scheduler (`--scheduler`).

Mitsuba's passes, formulas and comparisons go there. Scenes are loaded and pictures drawn on this machine: one GPU for all cells.

A task is a function of its arguments and nothing else, so it may be sent twice, and whoever answers first counts. A worker that
dies costs Dask's own second try; one that dawdles is overtaken; when the scheduler is lost, open tasks are sent again to the one
that comes back, or are done here.
"""

from __future__ import annotations

import contextlib
import logging
import os
import threading
import time
import uuid
from collections import defaultdict, deque
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError, ThreadPoolExecutor
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from evalsuite.errors import EvalsuiteError, MachineLacks, WorkerFailed
from evalsuite.execute import there
from evalsuite.execute.local import Lane, Pool, Workers
from evalsuite.scene.model import Scene
from evalsuite.store.cache import Store

#: How long to wait for a scheduler, at the start and when it is lost [s].
CONNECT_S, RECONNECT_S = 15.0, 60.0
#: A task is sent a second time when it has taken this many times what others took, and so long at least [s].
DAWDLES, DAWDLES_S = 5.0, 20.0


@dataclass(eq=False)
class _Task:
    function: str
    arguments: tuple
    future: Future = field(default_factory=Future)
    sent: list = field(default_factory=list)
    since: float = 0.0


class Cluster:
    """A pool of the workers of a Dask scheduler; same interface as `local.Pool`.

    store: whose entries the arguments name; told of a scheduler lost. run: what a worker does with a task. Raises MachineLacks
    without Dask, EvalsuiteError where nobody answers."""

    def __init__(self, address: str, store: Store, run: Callable = there.run) -> None:
        self.address, self._store, self._run = address, store, run
        self._client = _client(address)
        self._open: set[_Task] = set()
        self._lost: list[_Task] = []
        self._took: defaultdict[str, deque[float]] = defaultdict(lambda: deque(maxlen=100))
        self._scenes: dict[int, tuple[Scene, Any]] = {}
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._home: Pool | None = None
        #: Tasks that the workers which there are do at a time; 1 as long as there is none.
        self.width = 1
        self._count()
        self._fetching = ThreadPoolExecutor(16, thread_name_prefix="fetching")
        threading.Thread(target=self._watch, name="cluster", daemon=True).start()

    @property
    def cores(self) -> int:
        """That its workers have: one a task."""
        return self.width

    def submit(self, function: str, *arguments: object) -> Future:
        task = _Task(function, arguments)
        task.future.set_running_or_notify_cancel()
        with self._lock:
            self._open.add(task)
        self._send(task)
        return task.future

    def call(self, function: str, *arguments: object) -> object:
        return self.submit(function, *arguments).result()

    def close(self) -> None:
        """Take back what has not been done; tasks still open fail."""
        if self._ended.is_set():
            return
        self._ended.set()
        with self._lock:
            tasks, self._open = list(self._open), set()
        for task in tasks:
            _settle(task, WorkerFailed(self.address, "no answer", "one", "the run was interrupted"))
        if self._home is not None:
            self._home.close()
        self._fetching.shutdown(wait=False, cancel_futures=True)
        self._client.close(timeout=2)

    # ---- one task ---------------------------------------------------------------------------------------------------

    def _send(self, task: _Task, workers: list[str] | None = None) -> None:
        if self._home is not None:
            self._home.submit(task.function, *task.arguments).add_done_callback(lambda done: self._came(task, done))
            return
        try:
            arguments = [self._held(a) if isinstance(a, Scene) else there.sent(a, self._store) for a in task.arguments]
        except Exception as error:  # a scene that is gone, say
            self._finish(task, error)
            return
        key = f"evalsuite-{task.function.split(':')[1]}-{uuid.uuid4().hex}"
        placed = {"workers": workers, "allow_other_workers": True} if workers else {}
        task.since = time.monotonic()
        sent = self._client.submit(self._run, there.code(), task.function, *arguments, key=key, pure=False, **placed)
        task.sent.append(sent)
        # Dask calls back in a single thread, which must not wait until an answer is fetched.
        sent.add_done_callback(lambda done: self._fetching.submit(self._came, task, done))

    def _held(self, scene: Scene) -> Any:
        """A scene, tens of megabytes, is sent once for all tasks."""
        with self._lock:
            known = self._scenes.get(id(scene))
        if known is None or known[1].status in ("cancelled", "lost", "error"):
            known = (scene, self._client.scatter(scene, hash=False))
            with self._lock:
                if len(self._scenes) > 8:
                    self._scenes.clear()
                self._scenes[id(scene)] = known
        return known[1]

    def _came(self, task: _Task, done: Any) -> None:
        if task.future.done():
            return
        if isinstance(done, Future):  # done here
            error = done.exception()
            self._finish(task, error, None if error else done.result())
        elif done.status == "finished":
            try:
                result = done.result()
            except Exception:  # the worker that had it died before we did ask
                self._mislaid(task)
                return
            self._took[task.function].append(time.monotonic() - task.since)
            self._finish(task, None, result)
        elif done.status == "error":
            self._finish(task, _told(done.exception()))
        else:
            self._mislaid(task)

    def _mislaid(self, task: _Task) -> None:
        with self._lock:
            if task in self._open and task not in self._lost:
                self._lost.append(task)

    def _finish(self, task: _Task, error: BaseException | None, result: object = None) -> None:
        with self._lock:
            self._open.discard(task)
        _settle(task, error, result)
        for sent in task.sent:
            if not sent.done():
                sent.cancel()
        task.sent.clear()

    # ---- all tasks --------------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        while not self._ended.wait(0.5):
            with self._lock:
                lost, self._lost = self._lost, []
                waiting = list(self._open)
            if lost:
                self._again(lost)
            elif self._home is None:
                with contextlib.suppress(OSError, TimeoutError):  # a scheduler lost is for `_again`
                    self._count()
                    self._overtake(waiting)

    def _count(self) -> None:
        self._threads = self._client.nthreads()
        self.width = max(1, sum(self._threads.values()))

    def _again(self, tasks: list[_Task]) -> None:
        """Send again what was open when the scheduler went."""
        until = time.monotonic() + RECONNECT_S
        if self._client.status != "running":
            self._store.warn(f"{self.address}: connection lost; waiting {RECONNECT_S:.0f} s for the scheduler to come back")
        while self._client.status != "running" and time.monotonic() < until and not self._ended.is_set():
            time.sleep(0.2)
        if self._ended.is_set():
            return
        if self._client.status != "running":
            self._store.warn(f"{self.address}: no scheduler; going on with this machine alone")
            self._home = Pool("reference", os.cpu_count() or 1, threads=1)
            self.width = self._home.width
            with self._lock:  # also what was sent meanwhile
                tasks = list(self._open)
        for task in tasks:
            task.sent.clear()
            self._send(task)

    def _overtake(self, waiting: list[_Task]) -> None:
        """Where workers are idle, send them what another takes too long for."""
        if not 0 < len(waiting) < self.width:
            return
        now = time.monotonic()
        for task in waiting:
            took = list(self._took[task.function])
            limit = max(DAWDLES_S, DAWDLES * median(took)) if took else DAWDLES_S * DAWDLES
            if len(task.sent) == 1 and now - task.since > limit and not task.future.done():
                busy = {worker for worker, keys in self._client.processing().items() if keys}
                idle = [worker for worker in self._threads if worker not in busy]
                if not idle:
                    return
                self._send(task, idle)


class ClusterWorkers(Workers):
    """The workers of a run whose long tasks a Dask cluster does. Raises as `Cluster`."""

    def __init__(self, address: str, store: Store, run: Callable = there.run) -> None:
        self.cluster = Cluster(address, store, run)
        self.gpu, self.reference = Lane("gpu"), Pool("reference", 1)
        self.passes = self.formulas = self.compare = self.cluster

    def close(self) -> None:
        for pool in (self.cluster, self.gpu, self.reference):
            pool.close()


def _client(address: str) -> Any:
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
        from distributed.comm.registry import get_backend
    except ImportError:
        raise MachineLacks("--scheduler", "no Dask", "dask.distributed", "pip install 'evalsuite[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what there is to know we say, in a line
    started = "start one with `dask scheduler`, and `dask worker ADDRESS` on each machine"
    try:
        scheme, place = parse_address(address)  # first, as a client half made is hard to be rid of
        get_backend(scheme)
        if scheme in ("tcp", "tls"):
            parse_host_port(place)
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError) as error:
        text = str(error).splitlines()[0] if str(error) else "no answer"
        raise EvalsuiteError(
            f"--scheduler {address}", text, f"a Dask scheduler that answers within {CONNECT_S:.0f} s", started
        ) from error
    except (ValueError, TypeError) as error:
        raise EvalsuiteError(f"--scheduler {address}", str(error), "an address as tcp://HOST:8786", started) from error


def _settle(task: _Task, error: BaseException | None, result: object = None) -> None:
    try:
        task.future.set_exception(error) if error else task.future.set_result(result)
    except InvalidStateError:  # another was first
        pass


def _told(error: BaseException) -> BaseException:
    """Ours as they are; Dask's in our words."""
    if isinstance(error, EvalsuiteError):
        return error
    name = type(error).__name__
    if name == "KilledWorker":
        return WorkerFailed(
            "cluster", "workers that died", "a result", "this cell is lost, the others go on; see the workers' logs"
        )
    return WorkerFailed("cluster", f"{name}: {error}"[:300], "a result", "this cell is lost, the others go on")
