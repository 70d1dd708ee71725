"""A cell's pictures of two runs side by side, and where one is closer to the truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.disagreement import nearer
from evalsuite.compare.run_folder import Run
from evalsuite.image import ldr
from evalsuite.image.color import tone_map
from evalsuite.report import scales
from evalsuite.report.pictures import Picture
from evalsuite.store.results import slug


def prepare(row: Mapping, a: Run, b: Run, directory: Path) -> list[Picture]:
    """Write A, B, their reference or references and the map of what is closer into `directory/pictures/`; nothing for a cell that
    is unchanged or has no score. Raises EvalsuiteError for pictures that cannot be read and a folder that cannot be written."""
    if row["verdict"] in ("unchanged", "unscored"):
        return []
    first, second = a.cells[row["id"]], b.cells[row["id"]]
    exposure = float(first.get("exposure") or 1.0)
    look = scales.radiance(exposure)
    arrays = {
        "a": (a.picture(first, "image"), "A", "picture of run A"),
        "b": (b.picture(second, "image"), "B", "picture of run B"),
    }
    if row["reference"] in ("same", "other samples"):
        truth = b.picture(second, "reference")
        which = "Mitsuba's" if row["reference"] == "same" else "Mitsuba's in run B"
        arrays["reference"] = truth, "Reference", which
    else:
        arrays["reference-a"] = a.picture(first, "reference"), "Reference of A", "Mitsuba's in run A"
        arrays["reference-b"] = b.picture(second, "reference"), "Reference of B", "Mitsuba's in run B"
    made = [(name, title, shows, tone_map(picture, exposure), look) for name, (picture, title, shows) in arrays.items()]
    if "reference" in arrays:
        inside = (a.picture(first, "mask")[..., 0] > 0.5) & (b.picture(second, "mask")[..., 0] > 0.5)
        values, scale = _map(arrays["a"][0], arrays["b"][0], truth, inside)
        made.append(
            ("change", "Closer or further", "blue: B is closer to the reference, red: further", scale.colours(values), scale)
        )
    pictures = []
    for name, title, shows, encoded, scale in made:
        preview = f"pictures/{slug(row['id'])}/{name}.png"
        ldr.write_png(directory / preview, encoded)
        pictures.append(Picture(name, title, shows, preview, encoded.shape[1], encoded.shape[0], scale))
    return pictures


def _map(a: NDArray, b: NDArray, reference: NDArray, inside: NDArray[np.bool_]) -> tuple[NDArray, scales.Scale]:
    """(|b − R| − |a − R|) over the mean of R in the mask, 0 outside it; and its scale."""
    mean = float(reference[inside].mean()) or 1.0
    values = np.where(inside, nearer(b, a, reference) / mean, 0.0)
    words = "(|B − reference| − |A − reference|) / mean reference; blue: B closer, red: B further"
    return values, scales.diverging(scales.nice_limit(values[inside], 1e-6), words, percent=True)
