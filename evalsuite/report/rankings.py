"""Section "Where metrics disagree" of the page: rank flips with the pixels behind them, and how far metrics order alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.disagreement import nearer
from evalsuite.compare.ranking import METRICS
from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr, ldr
from evalsuite.report import scales
from evalsuite.report.scales import Scale
from evalsuite.store.results import slug

#: Groups whose ranks the page shows; results.json has all.
GROUPS = 12


@dataclass(frozen=True)
class Shown:
    """A rank flip as the page shows it. preview: PNG relative to the page, None where its pictures cannot be read, which
    `problem` then says. a_cell, b_cell: the cells' slugs."""

    flip: Mapping
    a_cell: str
    b_cell: str
    where: str
    preview: str | None
    scale: Scale | None
    width: int = 0
    height: int = 0
    problem: str = ""


def section(results: Mapping, directory: Path) -> dict[str, Any] | None:
    """Draw the flips' maps into `directory/rankings/`; {"flips", "left_out", "groups", "metrics", "tau" …} for the template, or
    None where no two cells share a reference. Raises EvalsuiteError if the folder cannot be written."""
    found = results.get("rankings")
    if not found:
        return None
    cells = {cell["id"]: cell for cell in results["cells"]}
    of_group = {group["reference_id"]: group for group in found["groups"]}
    flips = [_shown(flip, of_group[flip["reference_id"]], cells, directory) for flip in found["flips"] if flip.get("pixels")]
    tau = {frozenset(one["metrics"]): one for one in found["kendall"]}
    return {
        "flips": flips, "left_out": len(found["flips"]) - len(flips), "all_flips": len(found["flips"]),
        "all_groups": len(found["groups"]), "groups": [{**g, "where": _where(g)} for g in found["groups"][:GROUPS]],
        "metrics": [m for m in METRICS if any(m in one["metrics"] for one in found["kendall"])],
        "tau": lambda m, n: tau.get(frozenset((m, n))),
    }  # fmt: skip


def _where(group: Mapping) -> str:
    shared = ", ".join(f"{name} {value}" for name, value in group["shared"].items())
    return ", ".join(filter(None, (group["scene"], shared, group["target"])))


def _shown(flip: Mapping, group: Mapping, cells: Mapping[str, Mapping], directory: Path) -> Shown:
    a, b = cells[flip["a"]], cells[flip["b"]]
    words = flip, slug(a["id"]), slug(b["id"]), _where(group)
    try:
        pictures = [exr.read(directory / cell["images"][name]) for cell, name in ((a, "image"), (b, "image"), (a, "reference"))]
        masks = [exr.read(directory / cell["images"]["mask"])[..., 0] > 0.5 for cell in (a, b)]
    except EvalsuiteError as error:
        return Shown(*words, None, None, problem=str(error))
    values, scale = _map(*pictures, masks[0] & masks[1])
    preview = f"rankings/{slug(a['id'] + ' ' + b['id'])}.png"
    ldr.write_png(directory / preview, scale.colours(values))
    return Shown(*words, preview, scale, values.shape[1], values.shape[0])


def _map(a: NDArray, b: NDArray, reference: NDArray, mask: NDArray[np.bool_]) -> tuple[NDArray, Scale]:
    """(|a − R| − |b − R|) over the mean of R in the mask, 0 outside it; and its scale."""
    mean = float(reference[mask].mean(dtype=np.float64)) or 1.0
    values = np.where(mask, nearer(a.astype(np.float64), b, reference) / mean, 0.0)
    limit = scales.nice_limit(values[mask], 1e-6)
    words = "(|A − truth| − |B − truth|) / mean truth; blue: A nearer, red: B nearer"
    return values, scales.diverging(limit, words, percent=True)
