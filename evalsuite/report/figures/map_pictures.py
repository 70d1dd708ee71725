"""001 Fig 1, 5 and 6, 002 Fig 1, 4 and 5: the textures of a sphere map and of a dual paraboloid map of one environment, and
how far a look-up in them is from the environment, in every direction.

Both hold as many texels as a cube map with faces of FACE² texels; each texel is its mean radiance over its solid angle, and
look-ups are bilinear. Truth is the environment's own bilinear radiance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.image.color import tone_map
from evalsuite.math import paraboloid, sphere, sphere_map
from evalsuite.report.figures import grids
from evalsuite.report.figures.rendered import ERROR

Float = NDArray[np.float64]

FACE = 64
#: Of the error maps, a direction a pixel; the same all over the sphere but for sin θ.
HEIGHT = 128


def data(kind: str, name: str) -> dict[str, Any]:
    """kind: sphere or paraboloid. name: of a built-in environment. The textures, the error over directions, and its RMS over the
    sphere relative to the mean radiance."""
    from evalsuite.scene import builtin
    from evalsuite.scene.environment import evaluate, read_environment

    environment = read_environment(builtin.environment_path(name))
    spacing = np.pi / environment.radiance.shape[0]

    def lookup(directions: Float) -> Float:
        return evaluate(environment, directions)

    y, x = np.meshgrid((np.arange(HEIGHT) + 0.5) / HEIGHT, (np.arange(2 * HEIGHT) + 0.5) / (2 * HEIGHT), indexing="ij")
    directions = sphere.latlong_to_direction(x, y)
    truth = lookup(directions)
    if kind == "sphere":
        radius = sphere_map.matched_radius(FACE)
        size = 2 * int(np.ceil(radius + 2))
        border = 0.5 * size - radius
        texels = sphere_map.resample(lookup, size, border, sphere_map.subsamples(size, border, spacing))
        maps, found = texels[None], sphere_map.map_lookup(texels, border, directions)
    else:
        radius = paraboloid.matched_radius(FACE)
        size = 2 * int(np.ceil(radius + 2))
        border = 0.5 * size - radius
        maps = paraboloid.resample(lookup, size, border, paraboloid.subsamples_per_texel(size, border, spacing))
        found = paraboloid.DualParaboloid([maps], border).bilinear(directions)
    weight = np.sin(np.pi * y)[..., None] / np.sin(np.pi * y).sum()
    mean = float((weight * truth).sum() / 3)
    rms = float(np.sqrt((weight * (found - truth) ** 2).sum() / 3))
    exposure = 0.5 / np.median(truth.mean(-1))
    relative = (found - truth).mean(-1) / np.maximum(truth.mean(-1), 0.01 * mean)
    return {
        "kind": kind,
        "name": name,
        "maps": [panel(tone_map(one[::-1], exposure)) for one in maps],
        "truth": panel(tone_map(truth, exposure), "the environment, latitude over longitude"),
        "error": panel(ERROR.colours(relative), f"looked up: RMS {100 * rms / mean:.3g} % of the mean radiance"),
        "measured": {"environment": name, "texels": int(6 * FACE**2), "map_size": size, "relative_rms": rms / mean},
    }


def panel(colours: NDArray, caption: str = "") -> grids.Panel:
    """Of display values 0 … 1, (H, W, 3)."""
    return grids.Panel(np.round(255 * np.clip(colours, 0, 1)).astype(np.uint8), caption)


def draw(data: dict[str, Any]) -> grids.Grid:
    one = data["kind"] == "sphere"
    names = ("seen along v₀ in a small mirror ball",) if one else ("towards the viewer", "away from the viewer")
    maps = grids.Block([data["maps"]], "Sphere map" if one else "Dual paraboloid map", names)
    over = grids.Block([[data["truth"]], [data["error"]]], "Truth and error over all directions")
    stand_in = ", a stand-in" if data["name"] == "office" else ""
    note = f"Environment: {data['name']}{stand_in}. {data['measured']['texels']} texels, as a cube map with faces of {FACE}²."
    return grids.Grid([maps, over], scale=ERROR, width=7.0 if one else 9.0, note=note)
