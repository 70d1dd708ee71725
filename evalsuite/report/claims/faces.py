"""Whether a cube map's six faces show in a reflection (Kautz, Daubert, Seidel 2004, Fig 4).

Hardware blends neighbouring faces' last texels, so no step need remain where faces show. What remains is a pattern: the radiance
keeps to six values, one a face. The measure is the part of the picture's variance that lies between the faces of the direction
looked up, less the same between the faces of cubes turned at random: 0 where the picture does not know how the cube stands.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from evalsuite.math import cubemap, phong
from evalsuite.report.claims.intervals import above, below, mean
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures import sphere_view
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.numbers import measured

Float = NDArray[np.float64]

TURNS = 200
#: Radiance that varies by less than this part of its mean shows nothing.
VISIBLE = 0.01
BOX, ACROSS = "glossy-boxmip", "glossy-boxmip-seamless"


def show(cells: Rendered) -> Finding:
    """At b = 9.4, on the scene `sphere` over five maps: the part of the picture's variance between the six faces, less the mean
    of the same for 200 cubes turned at random; the picture's contrast, its standard deviation over its mean; the same of
    Mitsuba's picture. Brackets: over the maps."""
    maps = cells.values("env")
    names = {BOX: (BOX, "image"), ACROSS: (ACROSS, "image"), "truth": (BOX, "reference")}
    pattern: dict[str, list[float]] = {name: [] for name in (BOX, "truth", "beyond truth")}
    contrast: dict[str, list[float]] = {name: [] for name in names}
    for env in maps:
        for name, (technique, picture) in names.items():
            cell = cells.cell(technique=technique, env=env)
            radiance, mask = cells.read(cell, picture).astype(np.float64), cells.read(cell, "mask").mean(-1) > 0.999
            contrast[name].append(float(radiance[mask].std(0).mean() / max(radiance[mask].mean(), 1e-30)))
            if name in pattern:
                pattern[name].append(_pattern(radiance, mask))
        pattern["beyond truth"].append(pattern[BOX][-1] - pattern["truth"][-1])
    found: Mapping[str, Mapping] = {
        "variance_between_faces_beyond_turned_cubes": {name: mean(values) for name, values in pattern.items()},
        "contrast": {name: mean(values) for name, values in contrast.items()},
    }
    faces, contrasts = found.values()
    text = (f"part of the variance between the faces beyond that of turned cubes: box-filtered {measured(faces[BOX], '%')}, "
            f"Mitsuba {measured(faces['truth'], '%')}; contrast: box-filtered {measured(contrasts[BOX], '%')}, across faces "
            f"{measured(contrasts[ACROSS], '%')}, Mitsuba {measured(contrasts['truth'], '%')}")  # fmt: skip
    numbers = {**found, "maps": maps, "visible": VISIBLE}
    shows = above(faces[BOX], 0.0) and above(faces["beyond truth"], 0.0) and above(contrasts[BOX], VISIBLE)
    vanishes = below(contrasts[ACROSS], VISIBLE)
    if shows and vanishes:
        why = (
            "filtered across faces, the last level passes into the mean of the sphere: nothing shows, though Mitsuba has contrast"
        )
        return Finding(HOLDS, text, why, numbers)
    reasons = [] if shows else ["the picture does not keep to the six faces more than the truth does"]
    reasons += [] if vanishes else ["filtered across faces, the picture still varies"]
    return Finding(LIMITS if shows or vanishes else FAILS, text, "; ".join(reasons), numbers)


def _pattern(radiance: Float, mask: NDArray[np.bool_]) -> float:
    """Variance between the faces over all variance, less its mean over turned cubes. radiance: (H, W, 3) of the scene `sphere`,
    whose pixels see equal solid angles of r but for perspective."""
    normal, to_view, hit = sphere_view.rays(*radiance.shape[1::-1])
    inside = mask & hit
    values = radiance[inside]
    values = values - values.mean(0)
    r = phong.reflect(to_view, normal)[inside]
    total = np.square(values).sum()
    if total == 0:
        return 0.0

    def between(directions: Float) -> float:
        face = cubemap.direction_to_face(directions)[0]
        count = np.bincount(face, minlength=6)
        sums = np.stack([np.bincount(face, channel, 6) for channel in values.T], -1)
        return float((np.square(sums) / np.maximum(count, 1)[:, None]).sum() / total)

    turned = [between(turn.apply(r)) for turn in Rotation.random(TURNS, random_state=0)]
    return between(r) - float(np.mean(turned))
