"""Runs for the gate, of pictures whose distance to the truth is known by construction, and a gate to hold them against."""

from __future__ import annotations

import sys
from pathlib import Path

from evalsuite.commands_gate import bless
from evalsuite.compare.run_folder import Run
from evalsuite.gate import baseline as baselines
from evalsuite.gate.verdict import judge
from evalsuite.store import results as store_results

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "report"))
import two_runs as two

MESA, NVIDIA = {"gl_renderer": "llvmpipe", "git": "aaaa"}, {"gl_renderer": "NVIDIA H100", "git": "bbbb"}


def write(folder: Path, cells: dict[str, tuple | str], host: dict = MESA, **other) -> Path:
    """A run of cells: scene → (picture, reference), or a status."""
    made = []
    for scene, what in cells.items():
        if isinstance(what, str):
            names = {"id": two.name(scene), "technique": "glossy-mcguire", "target": "direct"}
            made.append(names | {"status": what, "message": "why", "metrics": {}, "images": {}})
        else:
            made.append(two.cell(folder, two.name(scene), *what, **other))
    folder.mkdir(exist_ok=True)
    return two.run(folder, made, host=host)


class Gate:
    """A baseline in a folder of its own; every call writes another run."""

    def __init__(self, folder: Path) -> None:
        self.home, self.path, self.runs = folder, folder / "small.baseline.json", 0

    @property
    def pictures(self) -> list[Path]:
        return sorted(self.path.with_suffix("").glob("*.exr"))

    def folder(self, cells: dict, **other) -> Path:
        self.runs += 1
        return write(self.home / f"run {self.runs}", cells, **other)

    def bless(self, cells: dict, *patterns: str, reason: str | None = None, dry_run: bool = False, **other) -> list[dict]:
        return bless(self.path, self.folder(cells, **other), patterns, reason=reason, dry_run=dry_run)

    def check(self, cells: dict, complete: bool = True, **other) -> dict[str, dict]:
        """scene → row."""
        return self.judge(self.folder(cells, **other), complete)

    def judge(self, folder: Path, complete: bool = True) -> dict[str, dict]:
        rows = judge(Run(folder, store_results.read(folder)), baselines.read(self.path), complete)
        return {row["id"].split("/")[0]: row for row in rows}
