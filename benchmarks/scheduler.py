"""Many cells on many workers, both simulated: what the scheduler and the run itself take, and from where on they are too slow.

A simulated cell asks of the cluster what the smallest real one does: a chunk of passes, then a comparison, then a ledger, each
after the last has come back; as many cells are under way as a run would have. A worker waits instead of rendering and answers
with as many bytes as asked for. The scheduler is a real one in a process of its own, and so are the connections; the workers
share one process.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks import simulated
from benchmarks.figure import Figure, NotMeasured
from benchmarks.local_dask import LocalDask

TITLE = "Simulated cells on simulated workers"
TASKS = 3  # of a cell


def measure(quick: bool) -> list[Figure]:
    """10⁵ cells on 1000 workers, tasks that take no time, so that only overhead is left; quick: 2000 on 100."""
    cells, count = (2000, 100) if quick else (100_000, 1000)
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        dask = LocalDask(Path(folder), 0)
        crowd = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.simulated", dask.address, str(count)], stderr=subprocess.DEVNULL
        )
        try:
            dask.wait(count, 900.0)
            figures += _driven(dask, count, cells, 0.0, 1000)
            figures += _driven(dask, count, cells // 20, 2.0, 1000)
            figures += _driven(dask, count, cells // 100, 2.0, 786_432)
        finally:
            crowd.kill()
            dask.close()
    return figures


def _driven(dask: LocalDask, workers: int, cells: int, seconds: float, answer: int) -> list[Figure]:
    import psutil

    from evalsuite.execute.cluster import ClusterWorkers
    from evalsuite.store.cache import Store

    scheduler, us = psutil.Process(dask.scheduler.pid), psutil.Process()
    with tempfile.TemporaryDirectory() as store, ClusterWorkers(dask.address, Store(Path(store)), simulated.task) as made:
        pool = made.passes
        if pool.width != workers:
            raise NotMeasured(f"{pool.width} workers of {workers} came")

        def cell(_: int) -> None:
            pool.call("benchmarks:passes", seconds, answer)
            pool.call("benchmarks:comparison", seconds, 1000)
            pool.call("benchmarks:ledger", seconds, 1000)

        before, started = [sum(p.cpu_times()[:2]) for p in (scheduler, us)], time.perf_counter()
        with ThreadPoolExecutor(made.cells) as threads:
            list(threads.map(cell, range(cells)))
        wall = time.perf_counter() - started
        busy = [sum(p.cpu_times()[:2]) - b for p, b in zip((scheduler, us), before, strict=True)]
        memory = [p.memory_info().rss / 1e6 for p in (scheduler, us)]
    tasks = TASKS * cells
    what = f"{cells} cells, {workers} workers, tasks of {seconds:g} s that answer {answer / 1000:.3g} kB"
    beside = (
        f"{tasks / wall:.0f} tasks a second, {cells / wall:.1f} cells; {tasks * seconds / wall / workers:.0%} of the workers "
        f"busy; memory: scheduler {memory[0]:.0f} MB, run {memory[1]:.0f} MB"
    )
    found = [("wall time", wall / cells), ("scheduler's processor", busy[0] / cells), ("run's processor", busy[1] / cells)]
    return [Figure(f"{what}: {name} a cell", 1000 * value, (1000 * value,) * 2, 1, "ms", None, beside) for name, value in found]
