"""A Dask scheduler and workers on this machine, each a process that a test may kill."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

from distributed import Client


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


class LocalDask:
    """`workers`: their processes, each of one thread and without a nanny, so that who is killed stays dead."""

    def __init__(self, folder: Path, workers: int = 2, path: Path | None = None) -> None:
        self.folder, self.port, self.workers = folder, free_port(), []
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.environment = os.environ | ({"PYTHONPATH": str(path)} if path else {})
        self.start_scheduler()
        for _ in range(workers):
            self.start_worker()
        if workers:
            self.wait(workers)

    def _start(self, *words: str) -> subprocess.Popen:
        command = [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:], "--no-dashboard"]
        log = open(self.folder / f"dask-{words[0]}.log", "a")
        return subprocess.Popen(command, env=self.environment, stdout=log, stderr=log, start_new_session=True)

    def start_scheduler(self) -> None:
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port))

    def start_worker(self) -> subprocess.Popen:
        options = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self.folder / "dask"))
        self.workers.append(self._start("worker", self.address, *options))
        return self.workers[-1]

    def wait(self, workers: int, limit_s: float = 60.0) -> None:
        with Client(self.address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=limit_s)

    def busy(self, count: int = 1) -> dict[str, int]:
        """Process id of each worker that has a task, once `count` have."""
        with Client(self.address, timeout=60, set_as_default=False) as client:
            for _ in range(600):
                found = [worker for worker, keys in client.processing().items() if keys]
                if len(found) >= count:
                    return client.run(os.getpid, workers=found)
                time.sleep(0.05)
        raise TimeoutError("no worker has a task")

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
