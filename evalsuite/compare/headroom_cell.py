"""A cell's headroom from its files: what a worker process runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import headroom
from evalsuite.compare.headroom_search import Range
from evalsuite.compare.mask import whole_pixels
from evalsuite.compare.statistics import Noisy
from evalsuite.image import exr


def error_of(image_folder: str, reference_folder: str, coverage: NDArray[np.float32]) -> float:
    """Debiased mean square error [radiance²] of an image entry over the object mask; see `compare.cell.compare_cell`."""
    mask = _mask(image_folder, coverage)
    return headroom.mean_square(exr.read(Path(image_folder) / "image.exr")[mask], _truth(reference_folder, mask))


def headroom_of(where: Range, folders: Mapping[float, str], reference_folder: str, coverage: NDArray[np.float32]) -> dict:
    """`compare.headroom.headroom` of drawn candidates (value → image entry), as JSON."""
    mask = _mask(folders[where.published], coverage)
    pictures = {value: exr.read(Path(folder) / "image.exr")[mask] for value, folder in folders.items()}
    return headroom.headroom(where, pictures, _truth(reference_folder, mask)).to_json()


def _mask(image_folder: str, coverage: NDArray[np.float32]) -> NDArray[np.bool_]:
    with np.load(Path(image_folder) / "scored.npz") as data:
        return whole_pixels(np.minimum(data["scored"], coverage))


def _truth(reference_folder: str, mask: NDArray[np.bool_]) -> Noisy:
    with np.load(Path(reference_folder) / "halves.npz") as halves:
        a, b = halves["a"][mask], halves["b"][mask]
    return headroom.reference((a, b), exr.read(Path(reference_folder) / "standard_error.exr")[mask])
