"""001 Fig 13: a dual paraboloid map unfiltered, and filtered for Phong's N = 100 by three methods.

The notes' maps: 128 × 256 texels, both halves, with a border of 16. *Classic* sums all of the environment for each texel of the
map (here the spectral integral, `math.lobe_field`). *Hierarchical*, which the notes show without describing it, is here a tree
whose nodes are opened near the lobe only (`math.cube_tree`). *Hardware* is §3.2.5 as published: cut at 0.1, 7 × 7 texels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.image.color import tone_map
from evalsuite.math import cube_tree, hierarchical, lobe_field, paraboloid, phong, radial_lobe
from evalsuite.report.figures import grids
from evalsuite.report.figures.map_pictures import panel
from evalsuite.report.figures.rendered import ERROR
from evalsuite.report.figures.sphere_view import cube

Float = NDArray[np.float64]

MAP, SIZE, BORDER, EXPONENT, CUTOFF, TAPS = "office", 128, 16.0, 100.0, 0.1, 7
#: Width of the tree's faces [texels].
FACE = 128


def data() -> dict[str, Any]:
    """The four maps, (2, 128, 128, 3) each, and RMS off the classic method within the circles relative to the mean."""
    from evalsuite.scene import builtin
    from evalsuite.scene.environment import evaluate, read_environment

    environment = read_environment(builtin.environment_path(MAP))
    spacing = np.pi / environment.radiance.shape[0]
    counts = paraboloid.subsamples_per_texel(SIZE, BORDER, spacing)
    unfiltered = paraboloid.resample(lambda d: evaluate(environment, d), SIZE, BORDER, counts)
    directions = paraboloid.texel_directions(SIZE, BORDER)
    axes = directions.reshape(-1, 3)
    classic = lobe_field.phong(environment.radiance, EXPONENT)(axes @ environment.to_world).reshape(directions.shape)
    tree = cube_tree.build(cube(MAP, FACE).levels[0])

    def value(which: NDArray[np.int64], to_light: Float) -> Float:
        return phong.phong_lobe(EXPONENT, (to_light * axes[which]).sum(-1))

    light, whole = tree.integrate(axes, value, 1.0 / np.sqrt(EXPONENT + 1), radial_lobe.OPENING)
    levels = paraboloid.weighted_mips(unfiltered, BORDER)
    maps = {
        "unfiltered": unfiltered,
        "classic": classic,
        "hierarchical": (light / whole).reshape(directions.shape),
        "hardware": hierarchical.prefilter(levels, BORDER, EXPONENT, CUTOFF, TAPS),
    }
    weight = np.broadcast_to(paraboloid.texel_solid_angles(SIZE, BORDER)[None, ..., None], classic.shape)
    mean = float((weight * classic).sum() / weight.sum())
    off = {name: float(np.sqrt((weight * (one - classic) ** 2).sum() / weight.sum()) / mean) for name, one in maps.items()}
    measured = {"environment": MAP, "exponent": EXPONENT, "relative_rms": off}
    return {"maps": maps, "mean": mean, "off": off, "measured": measured}


def draw(data: dict[str, Any]) -> grids.Grid:
    classic, exposure = data["maps"]["classic"], 0.5 / np.median(data["maps"]["classic"])
    rows: list[list[grids.Panel | None]] = [[], [], [], []]
    for name, one in data["maps"].items():
        for half in (0, 1):
            rows[half].append(panel(tone_map(one[half, ::-1], exposure)))
            relative = ((one - classic) / np.maximum(classic, 0.01 * data["mean"]))[half, ::-1].mean(-1)
            said = f"RMS {round(100 * data['off'][name], 1):g} % of the mean" if half else ""
            rows[2 + half].append(None if name == "classic" else panel(ERROR.colours(relative), said))
    note = (f"N = {EXPONENT:g}; each map {SIZE} × {2 * SIZE} texels with a border of {BORDER:g}. Environment: {MAP}, a stand-in. "
            "Errors are those off the classic method, whose integral is exact to 3·10⁻⁵; no noise.")  # fmt: skip
    names = ("+z", "−z", "error, +z", "error, −z")
    return grids.Grid([grids.Block(rows, "", tuple(data["maps"]), names)], scale=ERROR, width=6.5, note=note)
