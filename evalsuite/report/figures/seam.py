"""002 Fig 7: where the two paraboloid maps meet on the sphere, near by, with the curve and without; and what the ring is for.

The scene is `sphere72`; its camera is that of `sphere_view`. The seam is where r_z = 0 in the map's frame, the world's own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evalsuite.math import phong
from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR, Rendered
from evalsuite.report.figures.sphere_view import rays

#: Half the width of the band that counts as the seam, and of the crop's side the part of the picture's.
BAND, PART = 3, 4
SEGMENTS, DRAWS = 24, 400


def data(cells: Rendered) -> dict[str, Any]:
    """Of each cell (a ring around the circles, or none): the picture, crops of it, and the error in the band along the seam over
    that elsewhere on the sphere."""
    rings = cells.values("ring")
    found = [cells.cell(ring=ring) for ring in rings]
    image = cells.read(found[0], "image")
    height, width = image.shape[:2]
    box = _box(height, width)
    rows, ratios = [], {}
    for cell in found:
        image, truth, error = cells.picture(cell), cells.picture(cell, "reference"), cells.error(cell)
        drawn = image.crop(box, 0)
        curve = _seam(width, height, drawn.pixels.shape[0] // box[3])
        x, y, w, h = (n * (drawn.pixels.shape[0] // box[3]) for n in box)
        pixels = drawn.pixels.copy()
        pixels[curve[y : y + h, x : x + w]] = grids.CROPS[1]
        ratios[f"{cell['parameters']['ring']:g}"] = ratio = _band(cells, cell)
        lo, hi = ratio["ci95"]
        said = f"{ratio['value']:.3g} [{lo:.3g} … {hi:.3g}] × elsewhere"
        rows.append([
            image.marked(box), grids.Panel(pixels, "the seam", frame=0), drawn, truth.crop(box, 0),
            error.crop(box, 0, said),
        ])  # fmt: skip
    return {"cells": cells, "rows": rows, "names": [f"ring of {r:g} texels" for r in rings],
            "measured": {"seam_error_over_elsewhere": ratios, "band_pixels": BAND}}  # fmt: skip


def draw(data: dict[str, Any]) -> grids.Grid:
    columns = ("real time", "seam drawn in", "real time", "Mitsuba 3", "error")
    note = data["cells"].note(f"Beneath errors: mean |error| within {BAND} pixels of the seam over that elsewhere on the sphere.")
    return grids.Grid([grids.Block(data["rows"], "", columns, data["names"])], scale=ERROR, width=8.0, note=note)


def _reflected(width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    normal, to_view, hit = rays(width, height)
    return phong.reflect(to_view, normal)[..., 2], hit


def _box(height: int, width: int) -> grids.Box:
    """Round the seam's point nearest to the sphere's middle."""
    z, hit = _reflected(width, height)
    y, x = np.nonzero(_crossing(z, hit))
    near = np.argmin((x - width / 2) ** 2 + (y - height / 2) ** 2)
    side = max(height // PART, 1)
    left, top = (int(np.clip(c - side // 2, 0, n - side)) for c, n in ((x[near], width), (y[near], height)))
    return left, top, side, side


def _seam(width: int, height: int, factor: int) -> NDArray[np.bool_]:
    """Where the curve is, in a picture enlarged by a factor; about a pixel of it wide."""
    z, hit = _reflected(width * factor, height * factor)
    return ndimage.binary_dilation(_crossing(z, hit), iterations=max(1, factor // 4))


def _crossing(z: NDArray[np.float64], hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    front = z >= 0
    there = np.zeros(z.shape, bool)
    there[:-1] |= front[:-1] != front[1:]
    there[:, :-1] |= front[:, :-1] != front[:, 1:]
    return there & hit


def _band(cells: Rendered, cell: Any) -> dict[str, Any]:
    """Mean |error| in the band over that elsewhere, with a 95 % interval: both resampled by sectors of the picture."""
    image, truth = cells.read(cell, "image"), cells.read(cell, "reference")
    mask = cells.read(cell, "mask").mean(-1) > 0.5
    height, width = mask.shape
    z, hit = _reflected(width, height)
    band = ndimage.binary_dilation(_crossing(z, hit), iterations=BAND) & mask
    error = np.abs(image - truth).mean(-1)
    y, x = np.mgrid[:height, :width]
    sector = ((np.arctan2(y - height / 2, x - width / 2) / (2 * np.pi) + 0.5) * SEGMENTS).astype(int) % SEGMENTS
    parts = np.stack([np.bincount(sector[of], error[of] if values else None, SEGMENTS)
                      for of in (band, mask & ~band) for values in (True, False)])  # fmt: skip

    def ratio(of: NDArray) -> NDArray:
        inside, n, outside, m = of
        return (inside / np.maximum(n, 1)) / np.maximum(outside / np.maximum(m, 1), 1e-30)

    picks = np.random.default_rng(0).integers(0, SEGMENTS, (DRAWS, SEGMENTS))
    low, high = np.percentile(ratio(parts[:, picks].sum(-1)), (2.5, 97.5))
    return {"value": float(ratio(parts.sum(-1))), "ci95": [float(low), float(high)]}
