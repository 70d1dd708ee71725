"""SIGKILL at any moment loses nothing: what was stored is used, the next run ends with the very same results."""

from __future__ import annotations

import random
import time
from collections import Counter
from collections.abc import Callable

import pytest
from bench import Bench
from steady import different

KILLS, IN_A_ROW, SEED = 200, 10, 20


@pytest.fixture
def bench(tmp_path) -> Bench:
    return Bench(tmp_path)


def test_kills_at_chosen_moments(bench):
    expected, _ = bench.undisturbed()
    moments = {
        "an entry half filled": lambda: any(bench.cache.glob(".runs/*/????????????/*")),
        "a reference on its way": lambda: any(bench.cache.glob("partial/*")) or any(bench.cache.glob("reference/*/*")),
        "pictures half written": lambda: (bench.out / ".changing").exists(),
    }
    for name, moment in moments.items():
        assert bench.kill(moment) != "ended before", name
        stored = bench.inodes()
        assert not set(stored) - set(bench.inodes())
    found, _ = bench.complete(None, "--missing-only")
    assert not different(found, expected)
    assert stored.items() <= bench.inodes().items(), "an entry was lost, or made again"
    assert not bench.leftovers()
    assert bench.verify().returncode == 0


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_two_hundred_kills_at_random_times(bench):
    """Each continues with the store and the folder that the last left; both are wiped after ten. Half of them any time, half once
    the run has begun to work: starting takes as long as this small report does."""
    expected, duration = bench.undisturbed()
    chance, phases, completed = random.Random(SEED), Counter(), 0
    for number in range(KILLS):
        delay = chance.uniform(0.0, duration)
        phases[bench.kill(after(delay) if number % 2 else after(0.6 * delay, bench.working))] += 1
        stored = bench.inodes() if bench.cache.exists() else {}
        if (number + 1) % IN_A_ROW == 0:
            found, _ = bench.complete(None, "--missing-only")
            assert not different(found, expected), f"after kill {number + 1}"
            assert stored.items() <= bench.inodes().items(), f"an entry was lost, or made again, after kill {number + 1}"
            assert not bench.leftovers()
            assert bench.verify().returncode == 0
            bench.wipe()
            completed += 1
            print(
                f"{number + 1} kills within {duration:.1f} s: {dict(phases)}; {completed} runs completed, all alike", flush=True
            )
    assert phases.total() == KILLS and len(phases) > 2, "the kills missed the work"


def after(delay: float, begun: Callable[[], bool] = lambda: True) -> Callable[[], bool]:
    """A time [s] after `begun`."""
    since: list[float] = []

    def over() -> bool:
        if not since and begun():
            since.append(time.monotonic())
        return bool(since) and time.monotonic() >= since[0] + delay

    return over
