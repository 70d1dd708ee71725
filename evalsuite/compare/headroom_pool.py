"""Headroom over many cells: the best parameter pooled, the best single constant, and what was found in one sentence.

Maps are what the cells are a sample of; exponents under one map share its structure. Pooled best: the cells' best values under
each map by random effects (DerSimonian and Laird 1986), those means again over the maps, with the interval of Hartung and
Knapp (2001), which counts few maps as few. Cells whose best is open (`at_bound`) have no value to pool and are counted instead.
Values are counted from the published choice, which for a bias differs from cell to cell; whole numbers are not pooled.
Best single constant: of least mean RMSE over the published choice's, in all cells, open ones too; its interval is the bootstrap's
over maps, which few maps make too narrow rather than too wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator
from scipy.special import stdtrit

from evalsuite.compare.statistics import Z95, Metric

BOOTSTRAPS = 2000
GRID = 801
#: The two lobes that McGuire et al.'s level is held against, by technique.
ABOUT_H, ABOUT_R = "glossy-mcguire", "glossy-boxmip-lod"


def random_effects(values: Sequence[float], errors: Sequence[float]) -> tuple[Metric, float, float]:
    """Mean of effects that differ among themselves: (value with 95 % interval, its standard error, between-effect standard
    deviation τ). errors: standard errors of the values. One value keeps its own interval."""
    y, v = np.asarray(values, np.float64), np.square(np.asarray(errors, np.float64)) + 1e-12
    if len(y) == 1:
        error = sqrt(v[0])
        return Metric(y[0], (y[0] - Z95 * error, y[0] + Z95 * error)), error, 0.0
    w = 1.0 / v
    fixed = (w * y).sum() / w.sum()
    spread = (w * np.square(y - fixed)).sum() - (len(y) - 1)
    between = max(0.0, spread / (w.sum() - np.square(w).sum() / w.sum()))
    w = 1.0 / (v + between)
    mean = float((w * y).sum() / w.sum())
    scatter = (w * np.square(y - mean)).sum() / (len(y) - 1)
    error = sqrt(max(scatter, 1.0) / w.sum())  # never below what the errors alone say
    half = float(stdtrit(len(y) - 1, 0.975)) * error
    return Metric(mean, (mean - half, mean + half)), error, sqrt(between)


def pooled(best: Mapping[str, Sequence[tuple[float, float]]]) -> dict[str, object]:
    """Of each map's (value, standard error) pairs: {"value", "ci95", "between_maps"}, and `by_map`."""
    by_map = {name: random_effects(*zip(*pairs, strict=True)) for name, pairs in best.items() if pairs}
    if not by_map:
        return {"value": None, "ci95": [None, None], "between_maps": None, "by_map": {}}
    mean, _, between = random_effects([m.value for m, *_ in by_map.values()], [error for _, error, _ in by_map.values()])
    return mean.to_json() | {"between_maps": between, "by_map": {name: m.to_json() for name, (m, *_) in by_map.items()}}


def best_constant(cells: Mapping[str, Sequence[Mapping]], seed: int = 0) -> dict[str, object] | None:
    """The one value of least mean RMSE ratio over all cells (map → entries of `headroom`), within the range that all drew:
    {"value", "ci95", "rmse_ratio": {value, ci95}, "at_end"}; None where they share no range."""
    flat = [entry for entries in cells.values() for entry in entries]
    ends = [[f(point["value"] - entry["published"] for point in entry["drawn"]) for entry in flat] for f in (min, max)]
    low, high = max(ends[0]), min(ends[1])
    if not low < high:
        return None
    grid = np.linspace(low, high, GRID)
    curves = [np.mean([_ratio(entry, grid) for entry in entries], axis=0) for entries in cells.values() if entries]
    by_map, counts = np.stack(curves), np.array([len(entries) for entries in cells.values() if entries])

    def least(weights: NDArray) -> tuple[float, float]:
        curve = weights @ by_map / weights.sum()
        return float(grid[curve.argmin()]), float(curve.min())

    value, ratio = least(counts)
    random = np.random.default_rng(seed)
    draws = random.multinomial(len(counts), np.full(len(counts), 1 / len(counts)), BOOTSTRAPS) * counts
    found = np.array([least(weights) for weights in draws])
    (lo, rlo), (hi, rhi) = np.percentile(found, (2.5, 97.5), axis=0)
    return {
        "value": value,
        "ci95": [float(lo), float(hi)],
        "rmse_ratio": {"value": ratio, "ci95": [float(rlo), float(rhi)]},
        "at_end": value in (low, high),
    }


def _ratio(entry: Mapping, grid: NDArray) -> NDArray:
    """RMSE of a cell over that of the published choice, between the drawn values by Akima splines of the mean square."""
    points = [(point["value"] - entry["published"], max(point["mse"], 0.0)) for point in entry["drawn"]]
    squares = dict(points)
    return np.sqrt(np.maximum(Akima1DInterpolator(*zip(*points, strict=True))(grid), 0.0) / max(squares[0.0], 1e-300))


def summary(cells: Sequence[Mapping]) -> dict[str, object] | None:
    """`headroom_summary` of results.json from its cells; None where no cell has a headroom."""
    groups: dict[tuple[str, str], dict[str, list[tuple[Mapping, Mapping]]]] = {}
    for cell in cells:
        for entry in cell.get("headroom") or []:
            place = groups.setdefault((cell["technique"], entry["parameter"]), {})
            place.setdefault(f"{cell['scene']}/{cell['environment'] or 'own'}", []).append((cell, entry))
    if not groups:
        return None
    pools = [_pool(technique, parameter, by_map) for (technique, parameter), by_map in groups.items()]
    h, r = (groups.get((name, "lod_offset"), {}) for name in (ABOUT_H, ABOUT_R))
    difference = pooled(_differences(h, r))
    out: dict[str, object] = {"pools": pools, "difference": difference if difference["value"] is not None else None}
    named = {pool["technique"]: pool for pool in pools if pool["parameter"] == "lod_offset"}
    return out | {"sentence": _sentence(named.get(ABOUT_H), named.get(ABOUT_R), out["difference"])}


def _pool(technique: str, parameter: str, by_map: Mapping[str, Sequence[tuple[Mapping, Mapping]]]) -> dict[str, object]:
    entries = {name: [entry for _, entry in pairs] for name, pairs in by_map.items()}
    flat = [entry for some in entries.values() for entry in some]
    biases = [cell["metrics"]["rel_bias"]["value"] for some in by_map.values() for cell, _ in some]
    regrets = np.array([entry["regret"]["value"] for entry in flat if entry["regret"]["value"] is not None])
    return {
        "technique": technique,
        "parameter": parameter,
        "unit": flat[0]["unit"],
        "maps": len(entries),
        "cells": len(flat),
        "open_cells": sum(entry["at_bound"] for entry in flat),
        "best": pooled(
            {name: [_measured(e) for e in some if not (e["at_bound"] or e["whole"])] for name, some in entries.items()}
        ),
        "best_constant": None if flat[0]["whole"] else best_constant(entries),
        "rel_bias": float(np.median([b for b in biases if b is not None] or [0.0])),
        "regret": {"median": float(np.median(regrets)), "range": [float(regrets.min()), float(regrets.max())]}
        if len(regrets)
        else None,
    }


def _measured(entry: Mapping) -> tuple[float, float]:
    """Best value less the published one, and its standard error."""
    lo, hi = entry["best_ci95"]
    return entry["best"] - entry["published"], (hi - lo) / (2.0 * Z95)


def _differences(first: Mapping, second: Mapping) -> dict[str, list[tuple[float, float]]]:
    """Best about h less best about r, under the same map and of the same exponent, where neither is open."""
    out: dict[str, list[tuple[float, float]]] = {}
    for name in first:
        others = {_exponent(cell): entry for cell, entry in second.get(name, [])}
        for cell, entry in first[name]:
            other = others.get(_exponent(cell))
            if other is not None and not entry["at_bound"] and not other["at_bound"]:
                (a, da), (b, db) = _measured(entry), _measured(other)
                out.setdefault(name, []).append((a - b, sqrt(da * da + db * db)))
    return out


def _exponent(cell: Mapping) -> object:
    return (cell.get("all_parameters") or cell["parameters"]).get("exponent")


def _sentence(h: Mapping | None, r: Mapping | None, difference: Mapping | None) -> str | None:
    """What McGuire's constant is, as found; None without both lobes."""
    if not (h and r and h["best"]["value"] is not None and r["best"]["value"] is not None):
        return None
    text = "; ".join(f"for the lobe about {axis} c = {_signed(pool['best'])} levels ({pool['cells'] - pool['open_cells']} of "
                     f"{pool['cells']} cells have a best value, under {len(pool['best']['by_map'])} maps)"
                     for axis, pool in (("h", h), ("r", r)))  # fmt: skip
    text = f"Best constant in McGuire's level m = log₂(w√3) − ½ log₂(s + 1) + c: {text}"
    if difference:
        lo, hi = difference["ci95"]
        verdict = "holds" if lo <= 1.0 <= hi else "does not hold"
        text += f"; under the same map and exponent they differ by {_signed(difference)}, which {verdict} the 1 level of s ≈ 4N"
    bias = " and ".join(f"{100 * pool['rel_bias']:+.0f} % about {axis}" for axis, pool in (("h", h), ("r", r)))
    return f"{text}. At the cells' own c the picture's mean is off by {bias} (median): a level answers that too, not width alone."


def _signed(metric: Mapping) -> str:
    value, (lo, hi) = metric["value"], metric["ci95"]
    return f"{value:+.2f} [{lo:+.2f}, {hi:+.2f}]".replace("-", "−")
