"""Pictures of another renderer as a run of one cell, held in memory, so that the same gate judges them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.comparison import Comparison
from evalsuite.compare.run_folder import Run
from evalsuite.image.rounding import bits_in


@dataclass(frozen=True)
class Pictures(Run):
    """pictures: name → (H, W, 3), as the files of a cell are named."""

    pictures: Mapping[str, NDArray]

    def picture(self, cell: Mapping, name: str, optional: bool = False) -> NDArray[np.float64] | None:
        found = self.pictures.get(name)
        return None if found is None else found.astype(np.float64)

    def step(self, cell: Mapping) -> float:
        return 2.0 ** -bits_in(self.pictures["image"])


def run_of(
    cell: Mapping[str, object],
    image: NDArray,
    reference: NDArray,
    standard_error: NDArray,
    mask: NDArray[np.bool_],
    comparison: Comparison,
    host: Mapping[str, object],
) -> Pictures:
    """One cell: id, technique, target, seed, target_error and all_parameters are `cell`'s, the scores `comparison`'s.

    image, reference, standard_error: (H, W, 3) radiance; mask: (H, W)."""
    scored = {"status": "scored", "message": "", "mask_pixels": int(mask.sum()), "images": {}}
    scored |= {"metrics": {name: metric.to_json() for name, metric in comparison.metrics.items()}}
    pictures = {"image": np.asarray(image, np.float32), "reference": reference, "standard_error": standard_error}
    pictures["mask"] = np.repeat(mask[..., None].astype(np.float32), 3, axis=2)
    return Pictures(None, {"host": dict(host), "cells": [{**cell, **scored}]}, pictures)
