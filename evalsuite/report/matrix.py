"""The data of the page's overview: every score with its interval, compact enough to lie in the page for hundreds of cells."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from evalsuite.compare.regions import ORDER
from evalsuite.report import scales
from evalsuite.report.numbers import plain
from evalsuite.report.pictures import js_json
from evalsuite.store.results import slug

#: How a metric's colours run: "log" errors, less being better, on a logarithmic scale; "signed" about 0; "gain" more is better;
#: "likeness" more is better, and what is missing to 1 counts on a logarithmic scale.
KINDS = {"rel_bias": "signed", "bias": "signed", "psnr": "gain", "ssim": "likeness"}
#: Scores over the object, over the whole picture (their names end so in results.json), and over regions of the object.
OBJECT, FULL = "object", "full picture"
#: As many significant digits as the page could show.
DIGITS = 5
#: Those that order pictures of one reference alike, so that one verdict holds for all.
ALIKE = {"mse": "rel_rmse", "rmse": "rel_rmse", "bias": "rel_bias"}


def section(results: Mapping, metrics: Sequence[tuple[str, str, str]]) -> dict[str, object]:
    """`data`: JSON for a script element (no `<` in it), read by `static/scores.js`; `regions`, `targets` [(name, cells)], and
    whether any entry is `inconclusive`. metrics: (name, unit, what it says).

    The data's keys: metrics [name, unit, says, kind]; regions [name]; targets [name], the most frequent first; truths [name],
    references that several cells share; ramp, diverging: equidistant sRGB codes from the darkest to the brightest, and from too
    dark to too bright; cells [{slug, scene, technique, parameters {…}, target, truth, status, ms (GPU [ms] or null), scores}].
    scores[region][metric] is [value, low, high], with a fourth entry 1 where noise could change the cell's order with another of
    the same reference; an open end is null; 0 where there is no score."""
    cells = results.get("cells", [])
    present = [name for name in ORDER if any(name in (cell.get("regions") or {}) for cell in cells)]
    regions, names = [OBJECT, FULL, *present], [name for name, *_ in metrics]
    targets = _targets(cells)
    truths = _truths(cells)
    open_ = undecided(results, regions, names)
    index = {reference: k for k, reference in enumerate(truths)}
    data = {
        "metrics": [[name, unit, says, KINDS.get(name, "log")] for name, unit, says in metrics],
        "regions": regions,
        "targets": [name for name, _ in targets],
        "truths": list(truths.values()),
        "ramp": [code for _, code in scales.flip().stops],
        "diverging": [code for _, code in scales.diverging(1.0, "").stops],
        "cells": [
            {
                "slug": slug(cell["id"]), "scene": ", ".join(filter(None, (cell["scene"], environment(cell)))),
                "technique": cell["technique"], "parameters": stated(cell), "target": cell["target"],
                "truth": index.get(cell.get("reference_id")), "status": cell.get("status", ""),
                "ms": _rounded((cell.get("cost") or {}).get("gpu_ms")),
                "scores": [
                    [_score(scores(cell, region).get(name), (cell["id"], region, name) in open_) for name in names]
                    for region in regions
                ] if cell.get("metrics") else [],
            }
            for cell in cells
        ],
    }  # fmt: skip
    return {"data": js_json(data), "regions": regions, "targets": targets, "inconclusive": bool(open_)}


def environment(cell: Mapping) -> str:
    """The name of a cell's environment, "" for the scene's own."""
    return cell.get("environment") or (cell.get("parameters") or {}).get("env") or ""


def stated(cell: Mapping) -> dict[str, object]:
    """A cell's stated parameters but for its environment: numbers as they are, all else as text."""
    parameters = (cell.get("parameters") or {}).items()
    return {k: v if isinstance(v, int | float) and not isinstance(v, bool) else plain(v) for k, v in parameters if k != "env"}


def scores(cell: Mapping, region: str) -> Mapping[str, Mapping]:
    """name → value and interval over a region."""
    metrics = cell.get("metrics") or {}
    if region == OBJECT:
        return metrics
    if region == FULL:
        return {name.removesuffix("_full"): metric for name, metric in metrics.items() if name.endswith("_full")}
    return ((cell.get("regions") or {}).get(region) or {}).get("metrics", {})


def undecided(results: Mapping, regions: Sequence[str], names: Sequence[str]) -> set[tuple[str, str, str]]:
    """(cell, region, metric) of scores whose order with another cell's of the same reference noise could change: over the object
    as `rankings` says, where the reference's noise, common to both, counts once; elsewhere where two intervals overlap."""
    groups: dict[str, list[Mapping]] = {}
    for cell in results.get("cells", []):
        if cell.get("status") == "scored" and cell.get("reference_id"):
            groups.setdefault(cell["reference_id"], []).append(cell)
    found, ranked = set(), {}
    for group in (results.get("rankings") or {}).get("groups", []):
        for metric, ranks in group["ranks"].items():
            ranked[group["reference_id"], metric] = {i for i, name in group["cells"].items() if len(set(ranks[name])) > 1}
    for reference, cells in groups.items():
        for region in regions:
            for name in names:
                said = ranked.get((reference, ALIKE.get(name, name))) if region == OBJECT else None
                ties = said if said is not None else _overlapping(cells, region, name)
                found |= {(i, region, name) for i in ties}
    return found


def _overlapping(cells: Sequence[Mapping], region: str, name: str) -> Iterator[str]:
    ends = sorted((*_ends(scores(cell, region)[name], name), cell["id"]) for cell in cells if name in scores(cell, region))
    reach = -math.inf
    for k, (low, high, cell) in enumerate(ends):
        if low <= reach or (k + 1 < len(ends) and ends[k + 1][0] <= high):
            yield cell
        reach = max(reach, high)


def _ends(metric: Mapping, name: str) -> tuple[float, float]:
    low, high = (open_ if end is None else end for end, open_ in zip(metric["ci95"], (-math.inf, math.inf), strict=True))
    if KINDS.get(name) != "signed":
        return low, high
    ends = sorted((abs(low), abs(high)))
    return (0.0 if low <= 0 <= high else ends[0]), ends[1]


def _score(metric: Mapping | None, open_: bool) -> list | int:
    if not metric or metric["value"] is None:
        return 0
    return [_rounded(metric["value"]), *map(_rounded, metric["ci95"])] + [1] * open_


def _rounded(value: float | None) -> float | int | None:
    if value is None or not math.isfinite(value):
        return None
    value = float(f"{value:.{DIGITS}g}")
    return int(value) if value == int(value) and abs(value) < 1e15 else value


def _targets(cells: Sequence[Mapping]) -> list[tuple[str, int]]:
    """(target, how many cells), the most frequent first."""
    counts: dict[str, int] = {}
    for cell in cells:
        counts[cell["target"]] = counts.get(cell["target"], 0) + 1
    return sorted(counts.items(), key=lambda pair: -pair[1])


def _truths(cells: Sequence[Mapping]) -> dict[str, str]:
    """reference → its name, of those that several scored cells share: scene, target, material and the parameters in common."""
    groups: dict[str, list[Mapping]] = {}
    for cell in cells:
        if cell.get("status") == "scored" and cell.get("reference_id"):
            groups.setdefault(cell["reference_id"], []).append(cell)
    names: dict[str, str] = {}
    for reference, some in groups.items():
        if len(some) > 1:
            first = some[0]
            subject = next((m["plugin"] for m in first.get("mapping") or [] if m["material"] == "subject"), "")
            common = [f"{k} {v}" for k, v in stated(first).items() if all(stated(c).get(k) == v for c in some)]
            name = ", ".join(filter(None, (first["scene"], environment(first), first["target"], subject, *common)))
            taken = list(names.values())
            names[reference] = name if name not in taken else f"{name} #{sum(n.startswith(name) for n in taken) + 1}"
    return names
