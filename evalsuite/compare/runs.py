"""Which of two runs is nearer to the truth, cell by cell, and whether noise could say otherwise.

Cells of one id belong together. With a and b the two pictures and R the reference:

- `identical`: the pictures are the same but for the rounding of floats, and so is the truth but for its noise;
- `paired`: both runs have the very same reference, whose noise then moves both errors alike: `decide.difference`;
- `independent`: references of other seeds. Each mse has its own interval, and that of their difference is, with distances to the
  ends in place of standard deviations, √(below_b² + above_a²) downwards and √(above_b² + below_a²) upwards (Zou and Donner,
  Statistics in Medicine 27, 2008);
- `worst case`: other references of one seed, which share an unknown part of their samples: distances are added instead. The
  difference then is not 0 where the two intervals lie apart.

Where the truth itself changed by more than noise (another material, another light), errors are divided by their own truth's mean
before: `rel_rmse`².
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from evalsuite.compare import decide
from evalsuite.compare.comparison import mean_square, noisy_picture
from evalsuite.compare.error_map import ROUNDING
from evalsuite.compare.run_folder import Run, changes, differ
from evalsuite.compare.statistics import Metric, Noisy

VERDICTS = ("closer", "further", "undecided", "unchanged", "unscored")
#: Metrics told beside the verdict.
TOLD = ("rel_rmse", "rel_bias", "flip", "ssim")
#: Half widths of the 95 % interval beyond which two references are of another truth: some six standard deviations, as many
#: cells ask and each says so on its own.
BEYOND = 3.0


def compare_runs(a: Run, b: Run) -> dict:
    """`cells`, `only_a`, `only_b`, `counts` and `changes` of comparison.json (docs/compare-runs.md). Raises EvalsuiteError for
    pictures that cannot be read."""
    first, second = a.cells, b.cells
    cells = [compare_cell(a, first[name], b, cell) for name, cell in second.items() if name in first]
    return {
        "counts": {verdict: sum(cell["verdict"] == verdict for cell in cells) for verdict in VERDICTS},
        "only_a": [name for name in first if name not in second],
        "only_b": [name for name in second if name not in first],
        "changes": differ(a.results.get("host") or {}, b.results.get("host") or {}),
        "cells": cells,
    }


def compare_cell(run_a: Run, a: Mapping, run_b: Run, b: Mapping) -> dict:
    """One cell of comparison.json. Raises EvalsuiteError for pictures that cannot be read."""
    row = {name: b.get(name) for name in ("id", "scene", "environment", "technique", "parameters", "target")}
    row |= {
        "changes": changes(a, b),
        "verdict": "unscored",
        "basis": None,
        "quantity": None,
        "difference": None,
        "relative": None,
        "reference": None,
        "disagree": [],
    }
    of_metrics, of_cost = ([cell.get(key) or {} for cell in (a, b)] for key in ("metrics", "cost"))
    row["metrics"] = {name: dict(zip("ab", (m.get(name) for m in of_metrics), strict=True)) for name in TOLD}
    row["gpu_ms"] = dict(zip("ab", (cost.get("gpu_ms") for cost in of_cost), strict=True))
    if not a["status"] == b["status"] == "scored":
        return row
    basis, quantity, difference, reference = _decide(run_a, a, run_b, b)
    row["reference"] = reference
    if basis == "identical":
        row["verdict"] = "unchanged"
    else:
        low, high = difference.ci95
        row["verdict"] = "closer" if high < 0 else "further" if low > 0 else "undecided"
    row["disagree"] = _disagree(row["verdict"], row["metrics"])
    return row | {
        "basis": basis,
        "quantity": quantity,
        "difference": difference.to_json(),
        "relative": _relative(difference, a.get("metrics") or {}, quantity),
    }


def _decide(run_a: Run, a: Mapping, run_b: Run, b: Mapping) -> tuple[str, str, Metric, str]:
    """(basis, quantity, its difference b − a, how the references compare)."""
    images = run_a.picture(a, "image"), run_b.picture(b, "image")
    means = run_a.picture(a, "reference"), run_b.picture(b, "reference")
    sigmas = run_a.picture(a, "standard_error"), run_b.picture(b, "standard_error")
    masks = run_a.picture(a, "mask"), run_b.picture(b, "mask")
    noises = (run.picture(cell, "image_standard_error", optional=True) for run, cell in ((run_a, a), (run_b, b)))
    if len({picture.shape for picture in (*images, *means, *sigmas, *masks)}) > 1:
        return *apart(a, b, "rel_rmse"), "another size"
    inside = (masks[0][..., 0] > 0.5) & (masks[1][..., 0] > 0.5)
    if not inside.any():
        return *apart(a, b, "rel_rmse"), "no pixel in common"
    # Seeds of the signs that are drawn: no two pictures have one noise, but for a reference that is the same.
    truths = [noisy_picture(mean, sigma, seed)[inside] for seed, mean, sigma in zip((0, 3), means, sigmas, strict=True)]
    same = all(np.array_equal(*pair) for pair in (means, sigmas))
    if not same and another(*truths):
        return *apart(a, b, "rel_rmse"), "another truth"
    reference = "same" if same else "other samples"
    pictures = [
        noisy_picture(image, noise, seed)[inside] for seed, (image, noise) in enumerate(zip(images, noises, strict=True), 1)
    ]
    off, least = np.abs(pictures[0].mean - pictures[1].mean), 4 * ROUNDING * np.abs(truths[0].mean).mean()
    step = max(run_a.step(a), run_b.step(b)) * np.abs(pictures[0].mean)
    if off.mean() <= least and (off <= np.maximum(least, step)).all():
        return "identical", "mse", Metric(0.0, (0.0, 0.0)), reference
    if same:
        return "paired", "mse", decide.difference(*pictures, truths[0]), reference
    return *apart(a, b, "mse"), reference


def another(first: Noisy, second: Noisy) -> bool:
    """Whether two references differ by more than their noise: their mean squared difference, freed of it, is above 0."""
    found = mean_square(first, second)
    return found.value > BEYOND * (found.ci95[1] - found.value)


def apart(a: Mapping, b: Mapping, metric: str) -> tuple[str, str, Metric]:
    """(basis, quantity, difference b − a) from each side's own interval; metric: `mse`, or `rel_rmse` for its square."""
    power = 2 if metric == "rel_rmse" else 1
    (va, la, ua), (vb, lb, ub) = (_ends((cell.get("metrics") or {}).get(metric), power) for cell in (a, b))
    alike = a.get("seed") == b.get("seed")

    def width(x: float, y: float) -> float:
        return x + y if alike else math.hypot(x, y)

    difference = Metric(vb - va, (vb - va - width(vb - lb, ua - va), vb - va + width(ub - vb, va - la)))
    return "worst case" if alike else "independent", "rel_rmse²" if power == 2 else metric, difference


def _disagree(verdict: str, metrics: Mapping) -> list[str]:
    """Which of FLIP and SSIM contradict the verdict, their two intervals apart."""
    names = []
    for name, sign in (("flip", 1.0), ("ssim", -1.0)):
        ends = [sorted(sign * end for end in m["ci95"]) for m in metrics[name].values() if m and None not in m["ci95"]]
        if len(ends) == 2:
            (a_low, a_high), (b_low, b_high) = ends
            if (verdict == "closer" and b_low > a_high) or (verdict == "further" and b_high < a_low):
                names.append(name)
    return names


def _ends(metric: Mapping | None, power: int) -> tuple[float, float, float]:
    if not metric or metric["value"] is None:
        return math.nan, -math.inf, math.inf
    low, high = metric["ci95"]
    return metric["value"] ** power, 0.0 if low is None else low**power, math.inf if high is None else high**power


def _relative(difference: Metric, metrics: Mapping, quantity: str) -> dict | None:
    """The difference over A's own squared error, which is taken as it stands; None where that is 0."""
    whole, *_ = _ends(metrics.get("mse"), 1) if quantity == "mse" else _ends(metrics.get("rel_rmse"), 2)
    if not whole > 0:
        return None
    return Metric(difference.value / whole, tuple(end / whole for end in difference.ci95)).to_json()
