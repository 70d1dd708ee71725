"""References on two Dask workers of one thread each beside one of them, and what a task costs beside its work.

The references are those of four scenes and targets, rendered at the same time as a run would, in the rounds and chunks of a
run. Before the clock starts each worker has loaded the scenes and compiled their kernels.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks import timing
from benchmarks.figure import Figure, Limit, NotMeasured
from benchmarks.local_dask import LocalDask
from evalsuite import references
from evalsuite.execute.cluster import Cluster
from evalsuite.execute.local import Pool
from evalsuite.scene import builtin
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import Store

TITLE = "Two workers beside one"
REFERENCES = (("still-life", "path"), ("organic", "path"), ("torus", "direct"), ("sphere", "unoccluded"))
CALLS = 200


def nothing() -> None:
    """A task without work."""


def measure(quick: bool) -> list[Figure]:
    """256² to 1 %, four rounds; quick: 128², three."""
    size, error, rounds = ((128, 128), 0.01, 3) if quick else ((256, 256), 0.01, 4)
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder, "store"), shared="")
        clusters = []
        try:
            for count in (1, 2):
                Path(folder, str(count)).mkdir()
                dask = LocalDask(Path(folder, str(count)), count, Path.cwd())
                clusters.append((dask, Cluster(dask.address, store)))
            one, two = (pool for _, pool in clusters)
            if (one.width, two.width) != (1, 2):
                raise NotMeasured("a worker did not come")
            alone, both = timing.rounds_of(
                lambda: _rendered(one, size, error, Path(folder)), lambda: _rendered(two, size, error, Path(folder)), rounds
            )
            there, here = _tasks(two, rounds)
        finally:
            for dask, pool in clusters:
                pool.close()
                dask.close()
    value, ci95 = timing.ratio(alone, both)
    beside = f"one {timing.typical(alone)}, two {timing.typical(both)}"
    what = f"{len(REFERENCES)} references of {size[0]}² to {error:.1%}, one worker over two"
    found = [Figure(what, value, ci95, rounds, "×", Limit(1.8, True), beside)]
    for name, times in (("Dask", there), ("processes of this machine", here)):
        value, ci95 = timing.mean(times)
        found.append(Figure(f"an empty task, {name}", 1000 * value, tuple(1000 * end for end in ci95), rounds, "ms"))
    return found


def _rendered(pool: Cluster, size: tuple[int, int], error: float, folder: Path) -> None:
    def one(scene: str, target: str) -> None:
        source = SceneSource(builtin.scenes_directory() / f"{scene}.xml", size=size)
        plan = {"target": target, "target_error": error, "cap": 1 << 15, "seed": 0}
        partial = folder / f"{scene}-{target}-{pool.width}"
        references.sampled(pool, source, size, plan, np.ones(size[::-1], bool), partial, lambda state, error: None)
        partial.unlink()

    with ThreadPoolExecutor(len(REFERENCES)) as threads:
        for done in [threads.submit(one, *asked) for asked in REFERENCES]:
            done.result()


def _tasks(pool: Cluster, rounds: int) -> tuple[list[float], list[float]]:
    """Seconds that an empty task takes, of many sent at once, on both workers and on as many processes here."""
    local = Pool("empty", pool.width, threads=1)

    def calls(of: Cluster | Pool) -> None:
        for done in [of.submit("benchmarks.workers:nothing") for _ in range(CALLS)]:
            done.result()

    try:
        times = timing.rounds_of(lambda: calls(pool), lambda: calls(local), max(rounds, 3))
    finally:
        local.close()
    return tuple([t / CALLS for t in side] for side in times)
