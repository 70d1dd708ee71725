"""Simulated Dask workers: `python -m benchmarks.simulated ADDRESS COUNT`.

Each is a Dask worker of its own with a connection of its own, all in one process; they wait where a real one would render."""

from __future__ import annotations

import asyncio
import sys

import numpy as np

#: What a worker watches of its machine: a thousand of them on one would do nothing else.
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "60s",
    "distributed.admin.system-monitor.interval": "1h",
    "distributed.admin.system-monitor.disk": False,
    "distributed.admin.system-monitor.gil.enabled": False,
}


async def task(expected: object, function: str, seconds: float, answer: int) -> np.ndarray:
    """In the place of `execute.there.run`: takes `seconds` and answers with so many bytes."""
    await asyncio.sleep(seconds)
    return np.zeros(answer, np.uint8)


async def workers(address: str, count: int) -> None:
    """Run them until the scheduler goes."""
    import dask
    from distributed import Worker

    with dask.config.set(QUIET):
        made = [Worker(address, nthreads=1, memory_limit=0, dashboard=False) for _ in range(count)]
        for first in range(0, count, 50):
            await asyncio.gather(*made[first : first + 50])
        await asyncio.gather(*(worker.finished() for worker in made))


if __name__ == "__main__":
    asyncio.run(workers(sys.argv[1], int(sys.argv[2])))
