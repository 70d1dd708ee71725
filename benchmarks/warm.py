"""A whole report again, when nothing has changed: the store has every step, so that starting, reading and the page are left."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from benchmarks import timing
from benchmarks.command import evalsuite
from benchmarks.figure import Figure, Limit, NotMeasured

TITLE = "A run again, unchanged, over the first"
QUICK = ("--scene", "torus", "-t", "diffuse-sh9", "-t", "glossy-mcguire", "--size", "64x64")


def measure(quick: bool) -> list[Figure]:
    """`evalsuite run accuracy` at draft quality into an empty store and folder, and the same command again, twice a round."""
    words = ["run", "accuracy", "--quality", "draft", *(QUICK if quick else ())]
    first, again = [], []
    for _ in range(2 if quick else 3):
        with tempfile.TemporaryDirectory() as place:
            store, out = Path(place, "store"), Path(place, "out")
            command = [*words, "--out", str(out)]
            first.append(timing.seconds(lambda c=command, s=store: evalsuite(c, s)))
            times = [timing.seconds(lambda c=command, s=store: evalsuite(c, s)) for _ in range(2)]
            again.append(sum(times) / len(times))
            cells = json.loads((out / "results.json").read_text())["cells"]
    fresh = [cell["id"] for cell in cells if cell["status"] == "scored" and not cell["cost"]["cached"]]
    if fresh:
        raise NotMeasured(f"the run again made anew {', '.join(fresh[:3])}")
    value, (low, high) = timing.ratio(again, first)
    beside = f"first {timing.typical(first)}, again {timing.typical(again)}"
    return [
        Figure(
            f"{len(cells)} cells, draft: again over first",
            100 * value,
            (100 * low, 100 * high),
            len(first),
            "%",
            Limit(2.0),
            beside,
        )
    ]
