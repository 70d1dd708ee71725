"""How long the program takes to say what it can do: heavy modules must load when they are used, not before."""

from __future__ import annotations

import subprocess
import sys

from benchmarks import timing
from benchmarks.figure import Figure, Limit

TITLE = "`evalsuite --help`"


def measure(quick: bool) -> list[Figure]:
    """Wall time of the process, files warm; beside it that of a Python that does nothing."""

    def start(*words: str) -> None:
        subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL, stdin=subprocess.DEVNULL)

    ours, bare = timing.rounds_of(lambda: start("-m", "evalsuite.cli", "--help"), lambda: start("-c", ""), 5 if quick else 20)
    value, ci95 = timing.mean(ours)
    return [Figure("`evalsuite --help`", value, ci95, len(ours), "s", Limit(0.3), f"bare Python {timing.typical(bare)}")]
