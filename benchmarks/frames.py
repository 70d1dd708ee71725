"""Frames a second of each technique at 1080p, by the GPU's own timer queries. Software renderers have no say here."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from benchmarks.command import evalsuite
from benchmarks.figure import Figure, NotMeasured
from evalsuite.execute.local import Lane

TITLE = "Frames a second at 1080p"
PASSES = 16  # sub-pixel passes of a run, each a frame


def measure(quick: bool) -> list[Figure]:
    """`cost.gpu_ms` of a run over the sphere in the office; a technique that cannot draw it is left out."""
    lane = Lane("gpu")
    try:
        gl = lane.call("evalsuite.gpu.worker:probe")
    finally:
        lane.close()
    if gl["software"]:
        raise NotMeasured(f"{gl['renderer']} is no GPU")
    return rates(("glossy-mcguire", "split-sum") if quick else ("*",), "1920x1080", str(gl["renderer"]))


def rates(techniques: tuple[str, ...], size: str, renderer: str) -> list[Figure]:
    """Frames a second of techniques by name or glob, from a run with as little of a reference as there is."""
    with tempfile.TemporaryDirectory() as place:
        chosen = [word for technique in techniques for word in ("-t", technique)]
        words = ["run", "accuracy", "--scene", "sphere", "--env", "office", *chosen, "--size", size, "--target", "unoccluded"]
        evalsuite([*words, "--target-error", "0.9", "--cap", "32", "--no-ledger", "--out", f"{place}/out"], Path(place, "store"))
        cells = json.loads(Path(place, "out", "results.json").read_text())["cells"]
    figures = []
    for cell in cells:
        if cell["status"] == "scored" and cell["cost"]["gpu_ms"] > 0:
            low, high = cell["cost"]["gpu_ms_ci95"]
            ends = (1e3 / high, 1e3 / max(low, 1e-6))
            name = "/".join(cell["id"].split("/")[1:3])
            figures.append(Figure(f"{name}, {size}", 1e3 / cell["cost"]["gpu_ms"], ends, PASSES, "fps", None, renderer))
    return figures
