"""Whether a constant environment comes out exact (McGuire et al. 2013, §5)."""

from __future__ import annotations

import numpy as np

from evalsuite.report.claims.intervals import above, below
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.numbers import measured

#: What a run keeps of its pictures (docs/results.md); of their mean it keeps more.
EXACT, EXACT_MEAN = 2.0**-9, 1e-5
#: A picture's mean is that of Mitsuba to less than this.
CLOSE = 0.01
MATTE = "diffuse-topmip"


def exact(cells: Rendered) -> Finding:
    """The scene `sphere` under radiance 1 from everywhere. Largest distance of the pictures from k_L, k_G or their sum; and their
    mean less that of Mitsuba's integral of Eq 13, relative. Brackets: Mitsuba's noise."""
    off, mean_off, bias = {}, {}, {}
    for cell in cells.cells:
        cell = cells.cell(id=cell["id"])
        name = _name(cell)
        inside = cells.read(cell, "mask").mean(-1) > 0.999
        weights = cell["all_parameters"]
        k = sum(
            np.asarray(weights.get(key, 0.0), np.float64)
            for key in ("reflectance", "diffuse_reflectance", "specular_reflectance")
        )
        off[name] = float(np.abs(cells.read(cell, "image")[inside] - k).max())
        mean_off[name] = abs(cell["mean_image"] - float(np.mean(k)))
        bias[name] = {key: cell["metrics"]["rel_bias"][key] for key in ("value", "ci95")}
    off_mean, off_most = max(mean_off.values()), max(*off.values(), EXACT)
    means = ", ".join(f"{measured(metric, '%')} ({name})" for name, metric in bias.items())
    text = f"off k by {off_mean:.1g} in the mean, by {off_most:.1g} at most; over Mitsuba's mean: {means}"
    numbers = {"largest_from_k": off, "mean_from_k": mean_off, "rel_bias": bias, "exact": EXACT, "close": CLOSE}
    if max(off.values()) > EXACT or max(mean_off.values()) > EXACT_MEAN:
        return Finding(FAILS, text, "the look-up of a constant map is not the constant", numbers)
    wrong = [name for name, metric in bias.items() if above(metric, CLOSE) or below(metric, -CLOSE)]
    if not wrong:
        return Finding(HOLDS, text, "", numbers)
    why = ("the look-up is exact for weights of k; the glossy part of Eq 13 is not: (s + 8)/8 makes its albedo k_G seen from the "
           "front alone, and towards the rim it falls with n·v, where the horizon cuts the lobe too")  # fmt: skip
    return Finding(LIMITS if len(wrong) < len(bias) else FAILS, text, why, numbers)


def _name(cell: dict) -> str:
    exponent = cell["parameters"].get("exponent")
    return cell["technique"] + (f", s = {exponent:g}" if exponent is not None else "")
