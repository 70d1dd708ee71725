"""Whether shadows are softer than the reference's, and what makes them so (environment maps as area lights, §5).

Across a shadow's border of width W and height D, the squared gradient sums to D²/W: of two pictures of one border the ratio of
their mean squared gradients is the inverse ratio of its widths. Between the picture and the whole truth stand two others of
Mitsuba's: the same discs with and without the shadow of the rest.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evalsuite.compare.regions import ORDER
from evalsuite.report.claims.intervals import above, below
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.numbers import measured

Float = NDArray[np.float64]

#: From the picture to the whole truth: what each step gives up.
STEPS = {
    "wedges": ("image", "discs"),
    "no shadow of the rest": ("discs", "discs-shadowed"),
    "flat discs": ("discs-shadowed", "direct"),
}
WHOLE = "whole"
#: Borders less than this many times as wide are slightly softer.
SLIGHTLY = 2.0
#: Sides of the blocks of pixels that the bootstrap draws, and its draws.
BLOCK, DRAWS = 8, 2000
#: Derivative along one axis of (H, W, C), mean of three along the other [1/pixel].
PREWITT = tuple(np.array([-1.0, 0.0, 1.0]).reshape(shape) * np.ones((3, 3, 1)) / 6.0 for shape in ((3, 1, 1), (1, 3, 1)))


def softer(cells: Rendered) -> Finding:
    """Width of shadows' borders, picture over Mitsuba's whole truth: the inverse ratio of mean squared gradients (3 × 3 pixels,
    freed of noise) in the penumbrae of the lights, off silhouettes; and of each step between the two. Maps with small bright
    lights, which alone cast shadows with borders. Brackets: bootstrap over blocks of 8 × 8 pixels."""
    found = {f"{scene} in {env}": _widths(cells, scene, env) for scene in cells.values("scene") for env in cells.values("env")}
    whole = {name: of[WHOLE] for name, of in found.items()}
    text = "times as wide: " + ", ".join(f"{measured(metric)} ({name})" for name, metric in whole.items())
    text += "; by " + ", ".join(f"{step} {_ends(of[step]['value'] for of in found.values())}" for step in STEPS)
    wider, narrower = ([name for name, m in whole.items() if test(m, 1.0)] for test in (above, below))
    numbers = {"width_over_truth": found, "slightly": SLIGHTLY}
    if not wider:
        return Finding(FAILS if narrower else LIMITS, text, "borders are no wider" if narrower else "noise decides", numbers)
    if len(wider) == len(whole) and all(below(m, SLIGHTLY) for m in whole.values()):
        return Finding(HOLDS, text, _cause(found), numbers)
    much = [name for name, m in whole.items() if above(m, SLIGHTLY)]
    rest = [name for name in whole if name not in wider]
    parts = [f"softer in {len(wider)} of {len(whole)}", f"twice as wide or more: {', '.join(much)}" if much else "",
             f"not surely: {', '.join(rest)}" if rest else "", _cause(found)]  # fmt: skip
    return Finding(LIMITS, text, "; ".join(filter(None, parts)), numbers)


def _widths(cells: Rendered, scene: str, env: str) -> dict[str, dict]:
    """Ratio of widths of the whole and of each step, with intervals, under one map."""
    one = {target: cells.cell(scene=scene, env=env, target=target) for target in ("direct", "discs-shadowed", "discs")}
    sets = cells.read(one["direct"], "regions")
    sets = np.asarray(sets if sets.ndim == 2 else sets[..., 0]).astype(int)
    reached = ndimage.binary_dilation(_has(sets, "penumbra"), np.ones((3, 3)))  # by the operator
    inside = reached & ~_has(sets, "silhouette")
    squared = {"image": _squared_gradient(cells.read(one["direct"], "image"), None)}
    for target, cell in one.items():
        squared[target] = _squared_gradient(cells.read(cell, "reference"), cells.read(cell, "standard_error"))
    ends = {WHOLE: ("image", "direct"), **STEPS}
    return {name: _ratio(squared[truth], squared[picture], inside) for name, (picture, truth) in ends.items()}


def _has(sets: NDArray[np.int_], region: str) -> NDArray[np.bool_]:
    return (sets >> ORDER.index(region) & 1).astype(bool)


def _squared_gradient(picture: Float, standard_error: Float | None) -> Float:
    """(H, W) |∇L|² [radiance² / pixel²] by Prewitt's operator, summed over channels, less what noise adds to it."""
    picture = np.asarray(picture, np.float64)
    squared = sum(np.square(ndimage.correlate(picture, k)) for k in PREWITT)
    if standard_error is not None:
        variance = np.square(np.asarray(standard_error, np.float64))
        squared = squared - sum(ndimage.correlate(variance, np.square(k)) for k in PREWITT)
    return squared.sum(-1)


def _ratio(above_line: Float, below_line: Float, inside: NDArray[np.bool_]) -> dict[str, object]:
    """Σ above / Σ below over the pixels inside, {"value", "ci95"}; an end is None where the denominator may be 0."""
    rows, columns = np.nonzero(inside)
    block = rows // BLOCK * inside.shape[1] + columns // BLOCK
    _, block = np.unique(block, return_inverse=True)
    sums = np.stack([np.bincount(block, values[inside]) for values in (above_line, below_line)])
    counts = np.random.default_rng(0).multinomial(sums.shape[1], np.full(sums.shape[1], 1.0 / sums.shape[1]), DRAWS)
    first, second = sums @ counts.T
    ratios = np.where(second > 0, first / np.where(second > 0, second, 1.0), np.inf)
    low, high = np.percentile(ratios, (2.5, 97.5), method="nearest")
    total = sums.sum(1)
    return {"value": float(total[0] / total[1]) if total[1] > 0 else None,
            "ci95": [float(max(low, 0.0)), float(high) if np.isfinite(high) else None]}  # fmt: skip


def _ends(values: object) -> str:
    known = [v for v in values if v is not None]
    return f"{min(known):.2f} to {max(known):.2f}" if known else "—"


def _cause(found: Mapping[str, Mapping]) -> str:
    """The step that widens borders most where it surely does, by map."""
    by_step = {step: [name for name, of in found.items() if above(of[step], 1.0)] for step in STEPS}
    said = [f"{step} ({', '.join(names)})" for step, names in by_step.items() if names]
    return f"what surely widens them: {'; '.join(said)}" if said else "no single step surely widens them"
