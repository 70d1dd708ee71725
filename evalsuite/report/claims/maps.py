"""Claims about how maps sample the directions (Heidrich's course notes; Heidrich and Seidel 1998)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from evalsuite.math import cubemap, hierarchical, paraboloid
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures.circle_distortion import projected
from evalsuite.report.figures.sampling_rates import ratio, whole

#: Off a stated number by less than this is rounding in the paper, and a map's finite texels in ours.
CLOSE = 0.01
#: The notes' table of §3.2.5: exponent → filter sizes, shrink factors. The circles of its maps of 512 × 1024 texels fit it with
#: a radius of 256, so that the border of 64 lies around them.
CIRCLE, CUTOFF, TAPS = 256.0, 0.1, 7
TABLE = {10: ((174, 260), (32, 64)), 50: ((78, 136), (16, 32)), 100: ((56, 100), (8, 16)), 250: ((36, 66), (8, 16)),
         500: ((26, 48), (4, 8))}  # fmt: skip


def _ratio(found: float, stated: float, words: str) -> Finding:
    off = abs(found / stated - 1)
    numbers = {"ratio": found, "stated": stated}
    measured = f"{words}: largest over smallest texel {found:.4g}, stated {stated:.4g}"
    return (
        Finding(HOLDS, measured, "", numbers) if off < CLOSE else Finding(FAILS, measured, f"off by {100 * off:.2g} %", numbers)
    )


def cube() -> Finding:
    """Solid angle of a cube map's texel, centre of a face over corner: 3√3."""
    return _ratio(ratio(cubemap.texel_solid_angles(1024)), 3 * 3**0.5, "faces of 1024² texels")


def paraboloid_map() -> Finding:
    """Solid angle of a paraboloid map's texel, centre over rim: 4."""
    size = 2048
    return _ratio(
        ratio(paraboloid.texel_solid_angles(size)[whole(size, 0.0)]), 4.0, f"maps of {size}² texels, those whole in the circle"
    )


def circle() -> Finding:
    """Circles about the rim, r in radii of the map: how much farther they reach inwards than outwards, from projected points."""
    radii = (0.1, 0.25, 0.5, 0.75, 1.0)
    found = {f"{r:g}": projected(r) for r in radii}
    measured = "distortion at the rim " + ", ".join(f"{100 * a:.3g} % for r = {r}" for r, a in found.items())
    reach = max((r for r in np.linspace(0.01, 1, 100) if projected(float(r)) <= 0.25), default=0.0)
    numbers = {"distortion_of_radius": found, "radius_at_25_percent": float(reach)}
    if reach >= 1:
        return Finding(HOLDS, measured, "", numbers)
    if reach < 0.25:
        return Finding(FAILS, measured, f"25 % are passed at r = {reach:.2f} already", numbers)
    return Finding(LIMITS, measured, f"up to r = {reach:.2f} of the map's radius; larger circles pass 25 %", numbers)


def radii() -> Finding:
    """The smallest filter's radius over the largest's: 1 : 2."""
    found = {str(n): hierarchical.radius(0, n, CUTOFF) / hierarchical.radius(1, n, CUTOFF) for n in TABLE}
    numbers = {"small_over_large": found, "stated": 0.5}
    measured = "small over large radius " + ", ".join(f"{r:.3g} for N = {n}" for n, r in found.items())
    values = list(found.values())
    if all(abs(r - 0.5) < 0.5 * CLOSE for r in values):
        return Finding(HOLDS, measured, "", numbers)
    narrow = hierarchical.radius(0, 1e6, CUTOFF) / hierarchical.radius(1, 1e6, CUTOFF)
    if abs(narrow - 0.5) < CLOSE and all(a > b for a, b in pairwise(values)):
        return Finding(LIMITS, measured, f"goes to 1 : 2 as lobes get narrow ({narrow:.3f} for N = 10⁶)", numbers)
    return Finding(FAILS, measured, "does not go to 1 : 2 either", numbers)


def _table(column: int) -> Finding:
    rows, wrong = {}, []
    for n, stated in TABLE.items():
        sizes = [hierarchical.filter_size(hierarchical.radius(which, n, CUTOFF), CIRCLE) for which in (0, 1)]
        found = tuple(sizes if column == 0 else (2 ** hierarchical.shrink_level(size, TAPS) for size in sizes))
        rows[str(n)] = {"measured": list(found), "stated": list(stated[column])}
        if found != stated[column]:
            wrong.append(f"N = {n}: {found[0]} and {found[1]}, stated {stated[column][0]} and {stated[column][1]}")
    measured = "; ".join(f"N = {n}: {r['measured'][0]} / {r['measured'][1]}" for n, r in rows.items())
    if not wrong:
        return Finding(HOLDS, measured, "", {"rows": rows})
    verdict = LIMITS if len(wrong) <= 1 else FAILS
    return Finding(verdict, measured, "another value for " + "; ".join(wrong), {"rows": rows})


def filter_sizes() -> Finding:
    """The notes' ten filter sizes: 2 ⌈R r⌉ texels of a map whose circle has a radius of R = 256 texels."""
    return _table(0)


def shrink_factors() -> Finding:
    """The notes' ten shrink factors: the first power of two at which the filter fits 7 taps."""
    return _table(1)
