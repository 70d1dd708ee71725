"""Where m(s) errs, and under which maps (McGuire et al. 2013, §4): verdicts over `mcguire_errors`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from evalsuite.report.claims.intervals import above, below, geometric, mean
from evalsuite.report.claims.mcguire_errors import BUILT_IN, EXPONENTS, FLAT_BANDS, LOW_BANDS, MAPS, PLACES, errors
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.numbers import measured

Float = NDArray[np.float64]

LOBES = {"h, albedo 1": "lobe about h", "r": "lobe about r"}
BOXY = "coloured-cube"
#: Why places differ.
WIDTHS = "texels are a third as large at corners, which suits the narrower lobe about r, and centres the wider about h"


def centres_corners() -> Finding:
    """Error of the look-up at m(s) on the scene `sphere`, without grazing views, over thirteen maps turned at random: within 10°
    of the faces' corners over within 15° of their centres, and at s = 5 over s = 320. Brackets: over the maps."""
    found = {}
    for lobe in LOBES:
        by_place = {place: errors().error[lobe, place] for place in PLACES}
        found[lobe] = {
            "corner_over_centre": geometric(_of_maps(by_place["corner"] / by_place["centre"])),
            "low_over_high": geometric(_of_maps(by_place["anywhere"][..., :1] / by_place["anywhere"][..., -1:])),
        }
    text = "; ".join(
        f"{LOBES[lobe]}: corners over centres {measured(of['corner_over_centre'])}, s = {EXPONENTS[0]} over s = {EXPONENTS[-1]} "
        f"{measured(of['low_over_high'])}" for lobe, of in found.items()
    )  # fmt: skip
    places = [of["corner_over_centre"] for of in found.values()]
    exponents = [of["low_over_high"] for of in found.values()]
    if all(above(m, 1.0) for m in places + exponents):
        return Finding(HOLDS, text, "", found)
    parts = [
        _said(places, 1.0, "corners are worse than centres", "corners are better than centres"),
        _said(exponents, 1.0, "low exponents are worse than high ones", "low exponents are better than high ones"),
    ]
    some = any(above(m, 1.0) for m in places + exponents)
    return Finding(LIMITS if some else FAILS, text, "; ".join([*parts, WIDTHS]), found)


def flat_boxy() -> Finding:
    """Error at m(s) on the scene `sphere`, maps turned at random. Its growth with what eight built-in maps vary in degrees 1 and
    2 (slope between logarithms); noise of degree 4, 8, 16, flat at low frequencies, over noise of degree 1, 2 and the same
    contrast; and the c of least error in m(s) + c among six coloured walls, above 0 where the published level is too shiny.
    Brackets: over the maps, else over turns."""
    made = errors()
    rows = {name: k for k, name in enumerate(MAPS)}
    natural = [rows[name] for name in BUILT_IN]
    found: dict[str, dict] = {}
    for lobe in LOBES:
        error = np.log(made.error[lobe, "anywhere"])
        flat, low = (error[[rows[name] for name in bands]].mean((0, 2)) for bands in (FLAT_BANDS, LOW_BANDS))
        found[lobe] = {
            "slope": _slope(np.log(made.low[natural]), error[natural].mean((1, 2))),
            "flat_over_low": geometric(np.exp(flat - low)),
            "c_boxy": mean(made.best[lobe][rows[BOXY]].mean(-1)),
            "error": dict(zip(MAPS, np.exp(error.mean((1, 2))).tolist(), strict=True)),
        }
    text = "; ".join(
        f"{LOBES[lobe]}: error goes with variation to the power {measured(of['slope'])}, flat over varying noise "
        f"{measured(of['flat_over_low'])}, six walls need c = {measured(of['c_boxy'])}" for lobe, of in found.items()
    )  # fmt: skip
    numbers = {**found, "variation_of_degrees_1_and_2": dict(zip(MAPS, made.low.tolist(), strict=True))}
    slopes, noises, offsets = ([of[key] for of in found.values()] for key in ("slope", "flat_over_low", "c_boxy"))
    agrees = [above(m, 0.0) for m in slopes] + [below(m, 1.0) for m in noises] + [above(m, 0.0) for m in offsets]
    if all(agrees):
        return Finding(HOLDS, text, "", numbers)
    parts = [
        _said(slopes, 0.0, "maps that vary more at low frequencies are worse", "they are no worse"),
        _said(noises, 1.0, "of equal contrast, flat noise is worse", "flat noise is better"),
        _said(offsets, 0.0, "the published level is too shiny among six walls", "it is too dull"),
    ]
    return Finding(LIMITS if any(agrees) else FAILS, text, "; ".join(parts), numbers)


def _said(by_lobe: list[Mapping], limit: float, over: str, under: str) -> str:
    """One sentence of both lobes, or of each where they differ. over, under: what an interval above, below the limit says."""
    said = [over if above(m, limit) else under if below(m, limit) else f"open whether {over}" for m in by_lobe]
    if len(set(said)) == 1:
        return f"{said[0]} for either lobe"
    return ", ".join(f"{text} for the {LOBES[lobe]}" for lobe, text in zip(LOBES, said, strict=True))


def _of_maps(ratios: Float) -> Float:
    """One ratio a map: the geometric mean over turns and exponents."""
    return np.exp(np.log(ratios).mean((1, 2)))


def _slope(x: Float, y: Float) -> dict[str, object]:
    """Of the straight line of least squares, with Student's interval."""
    from scipy.stats import linregress, t

    line = linregress(x, y)
    half = float(t.ppf(0.975, len(x) - 2) * line.stderr)
    return {"value": float(line.slope), "ci95": [float(line.slope) - half, float(line.slope) + half]}
