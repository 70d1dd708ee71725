"""001 Fig 9 and 10: a prefiltered map, and things that are drawn with it.

The map is shown as the paper shows it, as dual paraboloids with as many texels as a cube map with faces of FACE² texels, each
texel the lobe's integral about its direction (`math.lobe_field`); between them it is looked up bilinearly. Truth is the integral
at every pixel.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.image.color import tone_map
from evalsuite.math import lobe_field, paraboloid
from evalsuite.report.figures import beside
from evalsuite.report.figures.map_pictures import panel
from evalsuite.report.figures.rendered import ERROR, Rendered

Float = NDArray[np.float64]

FACE = 64
SIDES = {paraboloid.FRONT: "the map, +z", paraboloid.BACK: "the map, −z"}


def data(cells: Rendered, exponent: str, *properties: str) -> dict[str, Any]:
    """exponent: N of the Phong lobe cos^N, 1 for irradiance. properties: as for `beside`. What `beside` draws, with the two
    halves of the map before it, and its RMS error over the sphere relative to the mean."""
    shown = beside.data(cells, *properties)
    environment = cells.environment()
    lobe = lobe_field.phong(environment.radiance, float(exponent))

    def exact(directions: Float) -> Float:
        return lobe(directions.reshape(-1, 3) @ environment.to_world).reshape(directions.shape)

    border = 2.0
    size = 2 * int(np.ceil(paraboloid.matched_radius(FACE) + border))
    texels = paraboloid.DualParaboloid([exact(paraboloid.texel_directions(size, border))], border)
    height, width = shown["image"][0].pixels.shape[:2]
    pixels = min(height, width)
    c = (np.arange(pixels) + 0.5) * 2 / pixels - 1
    x, y = c[None, :], -c[:, None]
    inside = x**2 + y**2 <= 1
    pictures, squared, truths, weights = [], 0.0, 0.0, 0.0
    omega = (4.0 / (1.0 + x**2 + y**2) ** 2 * inside)[..., None]
    for half in SIDES:
        directions = paraboloid.paraboloid_to_direction(half, x, y)
        found, truth = texels.bilinear(directions, hemisphere=np.full(inside.shape, half)), exact(directions)
        squared, truths = squared + (omega * (found - truth) ** 2).sum(), truths + (omega * truth).sum()
        weights += 3 * omega.sum()
        pictures.append((found, truth))
    mean, rms = truths / weights, np.sqrt(squared / weights)
    exposure = 0.5 / np.median([truth[inside] for _, truth in pictures])
    said = f"map of {size}² texels: RMS {100 * rms / mean:.2g} %"
    columns: dict[str, list] = {"image": [], "truth": [], "error": []}
    for found, truth in pictures:
        relative = (found - truth).mean(-1) / np.maximum(truth.mean(-1), 0.01 * mean)
        for name, colours, caption in (("image", tone_map(found, exposure), ""), ("truth", tone_map(truth, exposure), ""),
                                       ("error", ERROR.colours(relative), said)):  # fmt: skip
            columns[name].append(panel(_framed(np.where(inside[..., None], colours, 1.0), height, width), caption))
    return shown | {
        "titles": [*SIDES.values(), *shown["titles"]],
        **{name: made + shown[name] for name, made in columns.items()},
        "truths": "truth",
        "note": "Truth: of the map the lobe's integral about each pixel's direction in float64, else Mitsuba 3.",
        "measured": {"exponent": float(exponent), "map_size": size, "map_relative_rms": float(rms / mean)},
    }


def _framed(colours: Float, height: int, width: int) -> Float:
    """In the middle of a white picture of this size."""
    out = np.ones((height, width, 3))
    top, left = (height - len(colours)) // 2, (width - len(colours)) // 2
    out[top : top + len(colours), left : left + len(colours)] = colours
    return out


draw = beside.draw
