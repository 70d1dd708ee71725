"""Building the page of a finished run: previews, the viewer's pixels, the cells' pages, the overview and its plots."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

from benchmarks import timing
from benchmarks.command import evalsuite
from benchmarks.figure import Figure
from evalsuite.report import page

TITLE = "Building the page"
CELLS = (
    "--scene",
    "sphere",
    "--env",
    "office",
    "-t",
    "glossy-mcguire",
    "-t",
    "glossy-boxmip",
    "-p",
    "exponent=5,10,20,50,100,500",
)


def measure(quick: bool) -> list[Figure]:
    """Seconds a cell of 256² (quick: 64²), all anew and when nothing has changed."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place, "out")
        words = ["run", "accuracy", *CELLS, "--out", str(out), "--no-ledger"]
        evalsuite([*words, *(("--size", "64x64") if quick else ())], Path(place, "store"))
        results = json.loads((out / "results.json").read_text())
        count, rounds = len(results["cells"]), 3 if quick else 7
        anew, unchanged = [], []
        for _ in range(rounds + 1):
            for made in ("cells", "static"):
                shutil.rmtree(out / made)
            anew.append(timing.seconds(lambda: page.write(results, out)) / count)
            unchanged.append(timing.seconds(lambda: page.write(results, out)) / count)
    figures = []
    for what, times in (("all anew", anew[1:]), ("nothing changed", unchanged[1:])):
        value, ci95 = timing.mean(times)
        beside = f"{count} cells, and the overview shared among them"
        figures.append(Figure(f"a cell, {what}", value, ci95, rounds, "s", None, beside))
    return figures
