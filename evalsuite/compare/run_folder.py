"""A run's folder as it lies on disk: results.json and its pictures, checked where they are read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr
from evalsuite.store.results import check_cells


@dataclass(frozen=True)
class Run:
    """directory: the run's folder, which holds the pictures. results: its results.json."""

    directory: Path
    results: Mapping

    @property
    def cells(self) -> dict[str, Mapping]:
        """id → cell. Raises EvalsuiteError where results.json holds something else."""
        check_cells(f"{self.directory}/results.json", self.results.get("cells"))
        return {cell["id"]: cell for cell in self.results["cells"]}

    def step(self, cell: Mapping) -> float:
        """How far, relative, rounding in the folder may carry apart two pixels that were almost equal."""
        return 2.0 ** -exr.significant_bits(self._place(cell, "image"))

    def picture(self, cell: Mapping, name: str, optional: bool = False) -> NDArray[np.float64] | None:
        """One of a cell's pictures, (H, W, 3). Raises EvalsuiteError where it is missing, damaged or outside the folder."""
        if optional and (cell.get("images") or {}).get(name) is None:
            return None
        return exr.read(self._place(cell, name)).astype(np.float64)

    def _place(self, cell: Mapping, name: str) -> Path:
        path = (cell.get("images") or {}).get(name)
        place = self.directory / str(path)
        if path is None or not place.resolve().is_relative_to(self.directory.resolve()):
            raise EvalsuiteError(
                self.directory / "results.json", f"{path!r} as {name} of {cell['id']}", "a picture in its folder"
            )
        return place


def changes(a: Mapping, b: Mapping) -> list[dict]:
    """What is stated otherwise in the two cells."""
    names = ("status", "message", "target_error", "seed", "mask_pixels")
    stated = differ({k: a.get(k) for k in names}, {k: b.get(k) for k in names})
    return stated + differ(a.get("all_parameters") or {}, b.get("all_parameters") or {})


def differ(a: Mapping, b: Mapping) -> list[dict]:
    """[{"what", "a", "b"}] of the names whose values differ."""
    return [{"what": name, "a": a.get(name), "b": b.get(name)} for name in {**a, **b} if a.get(name) != b.get(name)]
