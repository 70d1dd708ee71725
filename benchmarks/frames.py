"""Frames a second of each technique at 1080p, by the GPU's own timer queries, and how near they come to the card's bandwidth.

The card's limit is what a plain copy between two large buffers reads and writes a second. Of a frame only the bytes count that it
cannot do without: the writing of its two float colour attachments. What it reads of maps comes out of caches, mostly, and is not
known. So a share is a lower bound: near 1 nothing but memory decides, far below it something else does. Software renderers
have no say here.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np

from benchmarks import timing
from benchmarks.command import evalsuite
from benchmarks.figure import Figure, NotMeasured
from evalsuite.execute.local import Lane

TITLE = "Frames a second at 1080p"
PASSES = 16  # sub-pixel passes of a run, each a frame
PIXEL_BYTES = 2 * 4 * 4  # of two RGBA attachments of 32-bit floats (`gpu.passes.Stage`)
COPY_BYTES = 2**28


def measure(quick: bool) -> list[Figure]:
    """`cost.gpu_ms` of a run over the sphere in the office; a technique that cannot draw it is left out."""
    lane = Lane("gpu")
    try:
        gl = lane.call("evalsuite.gpu.worker:probe")
        if gl["software"]:
            raise NotMeasured(f"{gl['renderer']} is no GPU")
        speeds = lane.call("benchmarks.frames:copies", COPY_BYTES)
    finally:
        lane.close()
    chosen = ("glossy-mcguire", "split-sum") if quick else ("*",)
    speed = copying(speeds, str(gl["renderer"]))
    return [speed, *rates(chosen, (1920, 1080), str(gl["renderer"]), speed.value)]


def copies(size: int, count: int = PASSES) -> list[float]:
    """Bytes a second that copies of a buffer of `size` bytes to another read and write. In a worker process."""
    from evalsuite.gpu import context
    from evalsuite.gpu.passes import timed

    gl = context.get()
    source, target = gl.buffer(np.random.default_rng(0).bytes(size)), gl.buffer(reserve=size)  # pages of zeros may be shared
    milliseconds = [timed(lambda: gl.copy_buffer(target, source, size)) for _ in range(count + 1)][1:]
    context.check_errors("copying a buffer")
    return [2 * size / (1e-3 * ms) for ms in milliseconds]


def copying(speeds: list[float], renderer: str) -> Figure:
    """The card's bandwidth."""
    value, ends = timing.mean([speed * 1e-9 for speed in speeds])
    return Figure("a plain copy, read and written", value, ends, len(speeds), "GB/s", None, renderer)


def rates(techniques: tuple[str, ...], size: tuple[int, int], renderer: str, bandwidth: float) -> list[Figure]:
    """Frames a second of techniques by name or glob, from a run with as little of a reference as there is; beside each its least
    share of the bandwidth [GB/s]."""
    width, height = size
    with tempfile.TemporaryDirectory() as place:
        chosen = [word for technique in techniques for word in ("-t", technique)]
        words = ["run", "accuracy", "--scene", "sphere", "--env", "office", *chosen, "--target", "unoccluded"]
        words += ["--size", f"{width}x{height}"]
        evalsuite([*words, "--target-error", "0.9", "--cap", "32", "--no-ledger", "--out", f"{place}/out"], Path(place, "store"))
        cells = json.loads(Path(place, "out", "results.json").read_text())["cells"]
    figures = []
    for cell in cells:
        if cell["status"] == "scored" and cell["cost"]["gpu_ms"] > 0:
            low, high = cell["cost"]["gpu_ms_ci95"]
            ends = (1e3 / high, 1e3 / max(low, 1e-6))
            name = "/".join(cell["id"].split("/")[1:3])
            fps = 1e3 / cell["cost"]["gpu_ms"]
            written = fps * width * height * PIXEL_BYTES * 1e-9
            beside = f"writes {written:.3g} GB/s, {written / bandwidth:.1%} of a copy's; {renderer}"
            figures.append(Figure(f"{name}, {width} × {height}", fps, ends, PASSES, "fps", None, beside))
    return figures
