"""A small report with a store of its own, run in process groups that can be killed whole."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Set
from pathlib import Path

from small_scene import scene_xml
from steady import facts

from evalsuite.store.cache import Store

REPORT = """
size = [24, 24]
[[group]]
scenes = ["small.xml"]
techniques = ["diffuse-sh9"]
targets = ["unoccluded", "direct"]
"""


class Bench:
    """A report of two cells in a folder: scene, report, store and output."""

    whole = 0  # entries of a store before anything is compared
    earlier: Set[Path] = frozenset()

    def __init__(self, folder: Path, inputs: Path | None = None) -> None:
        """inputs: the folder of another bench, for the very same scene and report."""
        self.folder, self.cache, self.out, self.inputs = folder, folder / "cache", folder / "out", inputs or folder
        if inputs is None:
            (folder / "small.xml").write_text(scene_xml(material="subject"))
            (folder / "small.toml").write_text(REPORT)

    def start(self, out: Path | None = None, *options: str) -> subprocess.Popen:
        words = ["run", "small.toml", "--target-error", "0.001", "--jobs", "1", "--out", str(out or self.out), *options]
        with (self.folder / "said.txt").open("w") as said:
            return subprocess.Popen(
                [sys.executable, "-m", "evalsuite.cli", *words],
                cwd=self.inputs,
                env=os.environ | {"EVALSUITE_CACHE": str(self.cache), "COLUMNS": "200"},
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                start_new_session=True,
            )

    def complete(self, out: Path | None = None, *options: str) -> tuple[dict, float]:
        """What a run that nobody disturbs ends with, and how long it takes [s]."""
        started = time.monotonic()
        code = self.start(out, *options).wait(timeout=300)
        assert code == 0, self.said()
        return facts(out or self.out), time.monotonic() - started

    def kill(self, when: Callable[[], bool]) -> str:
        """Start a run, kill its whole group as soon as `when`; what it was at."""
        self.earlier = set(self.cache.glob(".runs/*"))
        began, process = time.time(), self.start()
        while process.poll() is None and not when():
            time.sleep(0.0005)
        phase = self.phase(began) if process.poll() is None else "ended before"
        os.killpg(process.pid, signal.SIGKILL) if process.poll() is None else None
        process.wait()
        return phase

    def phase(self, began: float) -> str:
        results = self.out / "results.json"
        if (self.out / ".changing").exists():
            return "writing pictures"
        if results.exists() and results.stat().st_mtime > began:
            return "writing the page"
        if not self.working():
            return "starting"
        return "rendering" if len(self.inodes()) < self.whole else "comparing and finding"

    def working(self) -> bool:
        """Whether the run has claimed the store; a killed one's claim lies there until then."""
        return bool(set(self.cache.glob(".runs/*")) - self.earlier)

    def inodes(self) -> dict[Path, int]:
        """Every entry, as this very folder."""
        return {folder: folder.stat().st_ino for _, folder in Store(self.cache).entries()}

    def verify(self) -> subprocess.CompletedProcess:
        return self.upkeep("verify")

    def upkeep(self, *words: str) -> subprocess.CompletedProcess:
        """`evalsuite cache …`."""
        command = [sys.executable, "-m", "evalsuite.cli", "cache", *words]
        return subprocess.run(command, env=os.environ | {"EVALSUITE_CACHE": str(self.cache)}, capture_output=True, text=True)

    def said(self) -> str:
        """What the last run printed."""
        return (self.folder / "said.txt").read_text()

    def undisturbed(self) -> tuple[dict, float]:
        found = self.complete()
        self.whole = sum(kind not in ("comparison", "chain", "findings") for kind, _ in Store(self.cache).entries())
        self.wipe()
        return found

    def wipe(self) -> None:
        shutil.rmtree(self.cache)
        shutil.rmtree(self.out)

    def leftovers(self) -> list[Path]:
        """What a run must not leave behind when it ends."""
        found = [*self.cache.glob(".runs/*"), *self.cache.rglob(".new-*"), *self.cache.rglob(".gone-*")]
        return [*found, *self.cache.glob("partial/*"), *self.out.rglob(".*-*"), *self.out.glob(".changing")]
