"""Who is better, by each metric: ranks with ties, rank flips, Kendall's τ. Pure, from finished cells that share a reference."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from evalsuite.compare.error_map import ROUNDING

#: Metrics that rank: name in results.json → whether less of it is better. `mse`, `rmse` and `rel_rmse` rank alike, as does
#: `psnr`, which is the logarithm of the first; `rel_bias` counts by its magnitude.
METRICS: Mapping[str, bool] = {
    "rel_rmse": True, "psnr": False, "relmse": True, "mae": True, "smape": True, "rel_bias": True, "max_abs": True,
    "p99_abs": True, "ssim": False, "flip": True, "flip_hdr": True, "delta_e2000": True,
}  # fmt: skip

#: (metric, id of a, id of b) → 95 % interval of the metric's a − b on their common reference, None where there is none.
Paired = Callable[[str, str, str], tuple[float, float] | None]


@dataclass(frozen=True, eq=False)
class Group:
    """Cells with the very same reference, and names that tell them apart: the technique with what it does not share."""

    scene: str
    target: str
    reference_id: str
    shared: Mapping[str, object]
    names: Mapping[str, str]
    cells: Mapping[str, Mapping]


def groups(cells: Iterable[Mapping]) -> list[Group]:
    """Scored cells by their reference, in the order of the run, at least two of them each."""
    by_reference: dict[str, list[Mapping]] = {}
    for cell in cells:
        if cell.get("status") == "scored" and cell.get("reference_id"):
            by_reference.setdefault(cell["reference_id"], []).append(cell)
    found = []
    for reference, members in by_reference.items():
        if len(members) > 1:
            stated = [cell.get("parameters") or {} for cell in members]
            shared = {k: v for k, v in stated[0].items() if all(k in s and s[k] == v for s in stated)}
            names = {
                cell["id"]: ", ".join([cell["technique"], *(f"{k} {v}" for k, v in own.items() if k not in shared)])
                for cell, own in zip(members, stated, strict=True)
            }
            first = members[0]
            by_id = {cell["id"]: cell for cell in members}
            found.append(Group(first["scene"], first["target"], reference, shared, names, by_id))
    return found


def score(cell: Mapping, metric: str) -> tuple[float, float, float] | None:
    """(value, low, high), less being better; None where the cell has no such number."""
    given = (cell.get("metrics") or {}).get(metric)
    if not given or (given["value"] is None and metric != "psnr"):
        return None
    # A psnr without value or upper end is that of pictures which noise cannot tell apart.
    value = math.inf if given["value"] is None else given["value"]
    low, high = (open_ if end is None else end for end, open_ in zip(given["ci95"], (-math.inf, math.inf), strict=True))
    if metric == "rel_bias":
        ends = sorted((abs(low), abs(high)))
        return abs(value), 0.0 if low <= 0 <= high else ends[0], ends[1]
    return (value, low, high) if METRICS[metric] else (-value, -high, -low)


def decide(group: Group, metric: str, a: str, b: str, paired: Paired | None = None) -> int:
    """−1 where cell a is better than b by this metric, 1 where b is, 0 where the intervals leave it open, or where both are off
    by no more than floats are rounded (`rel_rmse` up to `ROUNDING`).

    Intervals apart decide. Where they overlap, that of the paired difference does: the two share a reference, whose noise moves
    both alike."""
    exact = [score(group.cells[i], "rel_rmse") for i in (a, b)]
    if all(one is not None and one[2] <= ROUNDING for one in exact):
        return 0
    first, second = score(group.cells[a], metric), score(group.cells[b], metric)
    if first is None or second is None:
        return 0
    if first[2] < second[1] or second[2] < first[1]:
        return -1 if first[0] < second[0] else 1
    difference = paired(metric, a, b) if paired else None
    if difference and not difference[0] <= 0 <= difference[1]:
        return -1 if difference[1] < 0 else 1
    return 0


def rank(group: Group, paired: Paired | None = None) -> dict:
    """One group: `ranks`, `flips`, and `concordance` for `kendall`.

    ranks[metric][name] = [best, worst] rank: 1 + those that are better, the number of all − those that are worse. A flip is a
    pair a, b of which some metrics prefer a (`prefer_a`) and others b, all of them decided; `strength` is the smaller of the two
    sides' largest |ln| ratio of values, without `rel_bias`: near 0 its ratios say nothing, and a flip that rests on it alone has
    strength 0."""
    ids = list(group.cells)
    decided = {(metric, a, b): decide(group, metric, a, b, paired) for metric in METRICS for a, b in combinations(ids, 2)}
    ranks: dict[str, dict[str, list[int]]] = {}
    for metric in METRICS:
        if all(score(cell, metric) is None for cell in group.cells.values()):
            continue
        better, worse = dict.fromkeys(ids, 0), dict.fromkeys(ids, 0)
        for a, b in combinations(ids, 2):
            if sign := decided[metric, a, b]:
                winner, loser = (a, b) if sign < 0 else (b, a)
                better[loser] += 1
                worse[winner] += 1
        ranks[metric] = {group.names[i]: [1 + better[i], len(ids) - worse[i]] for i in ids}
    flips = []
    for a, b in combinations(ids, 2):
        prefer_a = [m for m in METRICS if decided[m, a, b] < 0]
        prefer_b = [m for m in METRICS if decided[m, a, b] > 0]
        if prefer_a and prefer_b:
            sides = ([_ratio(group, m, a, b) for m in side if m != "rel_bias"] for side in (prefer_a, prefer_b))
            strength = min(max(side, default=0.0) for side in sides)
            flips.append({
                "a": a, "b": b, "a_name": group.names[a], "b_name": group.names[b],
                "prefer_a": prefer_a, "prefer_b": prefer_b, "strength": strength,
            })  # fmt: skip
    facts = {"scene": group.scene, "target": group.target, "reference_id": group.reference_id, "shared": dict(group.shared)}
    return {**facts, "cells": group.names, "ranks": ranks, "flips": flips, "concordance": _concordance(group, decided)}


def _ratio(group: Group, metric: str, a: str, b: str) -> float:
    """|ln| of two values' ratio; of ssim, what is missing to 1; of psnr, as of the error behind it."""
    values = [abs(score(group.cells[i], metric)[0]) for i in (a, b)]
    if metric == "psnr":
        difference = abs(values[0] - values[1]) * math.log(10) / 20
        return difference if math.isfinite(difference) else 0.0
    if metric == "ssim":
        values = [1.0 - v for v in values]
    return abs(math.log(values[0] / values[1])) if min(values) > 0 else 0.0


def _concordance(group: Group, decided: Mapping) -> list[dict]:
    """For each two metrics the pairs that they order alike less those that they order otherwise (`value`: by the values, ties 0;
    `ci95`: with undecided pairs either way), and how many `pairs` there are. τ is their quotient."""
    found = []
    for m, n in combinations(METRICS, 2):
        pairs = [
            (a, b) for a, b in combinations(group.cells, 2)
            if None not in (score(group.cells[i], k) for i in (a, b) for k in (m, n))
        ]  # fmt: skip
        if pairs:
            agree = sum(decided[m, a, b] * decided[n, a, b] for a, b in pairs)
            open_ = sum(not (decided[m, a, b] and decided[n, a, b]) for a, b in pairs)
            value = sum(_sign(group, m, a, b) * _sign(group, n, a, b) for a, b in pairs)
            found.append({"metrics": [m, n], "value": value, "ci95": [agree - open_, agree + open_], "pairs": len(pairs)})
    return found


def _sign(group: Group, metric: str, a: str, b: str) -> int:
    first, second = score(group.cells[a], metric)[0], score(group.cells[b], metric)[0]
    return (first > second) - (first < second)


def kendall(ranked: Sequence[Mapping]) -> list[dict]:
    """Kendall's τ_a of each two metrics over the pairs of all groups: metrics, value, ci95, pairs. 1: they order every two
    techniques alike, −1: the other way round. The interval is what the undecided pairs leave open."""
    sums: dict[tuple[str, str], list[int]] = {}
    for group in ranked:
        for one in group["concordance"]:
            total = sums.setdefault(tuple(one["metrics"]), [0, 0, 0, 0])
            for k, part in enumerate((one["value"], *one["ci95"], one["pairs"])):
                total[k] += part
    return [{"metrics": list(key), "value": v / n, "ci95": [lo / n, hi / n], "pairs": n} for key, (v, lo, hi, n) in sums.items()]
