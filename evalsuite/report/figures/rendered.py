"""What the cells behind a figure have become: found by what they are, with their pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr
from evalsuite.image.color import tone_map
from evalsuite.report import scales
from evalsuite.report.figures.grids import Panel
from evalsuite.report.numbers import measured
from evalsuite.scene.environment import read_environment
from evalsuite.scene.model import Environment

#: All error maps have this scale, so that figures compare: (image − truth) / truth.
ERROR = scales.diverging(1.0, "(image − truth) / truth", percent=True)


@dataclass(frozen=True)
class Rendered:
    """cells: of results.json, of this figure alone. directory: that their pictures are relative to. stand_ins: what of the
    paper's was replaced, in words: {"the Uffizi gallery": "office"}. maps: files of the environments that the cells name.
    best: ids of cells at the best value of a free parameter, as a search found it."""

    directory: Path
    cells: Sequence[Mapping]
    stand_ins: Mapping[str, str] = field(default_factory=dict)
    maps: Mapping[str, Path] = field(default_factory=dict)
    best: frozenset[str] = frozenset()

    def cell(self, **wanted: Any) -> Mapping:
        """The one cell with these values: scene, technique, target, environment or a parameter. Raises EvalsuiteError where it
        has no score, with the reason, and LookupError where none or several are meant."""
        found = [c for c in self.cells if all(_value(c, name) == value for name, value in wanted.items())]
        if len(found) != 1:
            raise LookupError(f"{len(found)} cells with {wanted}")
        if found[0]["status"] != "scored":
            raise EvalsuiteError(found[0]["id"], found[0]["message"] or found[0]["status"], "a scored cell for the figure",
                                 found[0].get("reproduce", ""))  # fmt: skip
        return found[0]

    def values(self, name: str) -> list[Any]:
        """What the cells have for a property, each once, in their order."""
        return list(dict.fromkeys(_value(cell, name) for cell in self.cells if _value(cell, name) is not None))

    def read(self, cell: Mapping, name: str) -> NDArray[np.float32]:
        """A picture of a cell, (H, W, 3) linear Rec.709."""
        return exr.read(self.directory / cell["images"][name])

    def environment(self) -> Environment:
        """The one environment of all cells. Raises LookupError where they name none or several, EvalsuiteError for a map that
        cannot be read."""
        names = self.values("environment")
        if len(names) != 1:
            raise LookupError(f"environments {names}")
        return read_environment(self.maps[names[0]])

    def note(self, text: str = "") -> str:
        """What stands beneath the figure: text, and what stands in for what."""
        replaced = "; ".join(f"{ours} for {theirs}" for theirs, ours in self.stand_ins.items())
        brackets = "Brackets: 95 %."
        return " ".join(filter(None, [text, brackets, f"Stand-ins: {replaced}." if replaced else ""]))

    def picture(self, cell: Mapping, name: str = "image", exposure: float | None = None, caption: str = "") -> Panel:
        """Image or reference as it is shown: × exposure (the cell's own unless given), clamped, sRGB."""
        tone = tone_map(self.read(cell, name), exposure or cell["exposure"])
        return Panel(np.round(255 * tone).astype(np.uint8), caption)

    def error(self, cell: Mapping) -> Panel:
        """(image − reference) / reference over the object, grey off it, with relative RMSE and its 95 % interval beneath."""
        image, reference = self.read(cell, "image"), self.read(cell, "reference")
        mask = self.read(cell, "mask").mean(-1) > 0.5
        floor = 0.01 * max(float(reference[mask].mean()) if mask.any() else 0.0, 1e-12)
        relative = ((image - reference) / np.maximum(reference, floor)).mean(-1)
        colours = ERROR.colours(relative)
        colours[~mask] = 0.82
        return Panel(np.round(255 * colours).astype(np.uint8), said(cell))


def said(cell: Mapping, name: str = "rel_rmse", unit: str = "%") -> str:
    """A metric with its interval, as a panel's caption."""
    return measured(cell["metrics"][name], unit)


def _value(cell: Mapping, name: str) -> Any:
    if name in ("scene", "technique", "target", "environment", "id"):
        return cell.get(name)
    return (cell.get("parameters") or {}).get(name)
