"""Findings on errors by themselves: the largest, the best and worst against each truth, those that noise hides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from evalsuite.compare.error_map import ROUNDING
from evalsuite.report.findings.parts import ERROR, LINES, Finding, Part, end_of, name_of, scored
from evalsuite.report.numbers import measured, number, plain
from evalsuite.report.where import worst


def without_score(results: Mapping) -> Iterator[Finding]:
    """Cells that failed or whose pictures do not show the same geometry: these are counted, which needs no interval."""
    cells = results.get("cells", [])
    bad = [cell for cell in cells if cell.get("status") in ("failed", "uncertified")]
    if bad:
        words = {"failed": "failed", "uncertified": "not certified"}
        count = ", ".join(
            f"{sum(c['status'] == s for c in bad)} {w}" for s, w in words.items() if any(c["status"] == s for c in bad)
        )
        lines = tuple(
            ((c["id"], c["id"]), (f": {words[c['status']]}. {c.get('message') or ''}".rstrip(), "")) for c in bad[:LINES]
        )
        parts = (
            (f"{len(bad)} of {len(cells)} cells have no score ({count}); the first is ", ""),
            (bad[0]["id"], bad[0]["id"]),
            (".", ""),
        )
        yield Finding("Cells without a score", parts, 100.0, lines)


def largest(results: Mapping) -> Iterator[Finding]:
    """The cell of the largest relative error, and where on the object that error is."""
    cells = sorted(scored(results), key=lambda cell: -cell["metrics"][ERROR]["value"])
    if len(cells) < 2:
        return
    first, rival = cells[0], max(cells[1:], key=lambda cell: end_of(cell, 1))
    error = first["metrics"][ERROR]
    parts: tuple[Part, ...] = (name_of(first), (f": relative RMSE {measured(error, '%')}", ""))
    place = worst(first)
    if place:
        share = (
            f"{number(place['part'], '%', 2)} of the object's pixels, hold {measured(place['share'], '%')} of its squared error"
        )
        parts += ((f". Pixels of the {place['name']}, {share}", ""),)
    open_ = end_of(first, 0) <= end_of(rival, 1)
    if open_:
        beside = f" beside {measured(rival['metrics'][ERROR], '%')} of "
        parts = ((f"Undecided{beside}", ""), name_of(rival), (". By the values: ", ""), *parts)
    yield Finding("Largest error", (*parts, (".", "")), 80.0, undecided=open_)


def against_each_truth(results: Mapping) -> Iterator[Finding]:
    """Best and worst technique against each reference that several share; the headline has the most rivals."""
    by_id = {cell["id"]: cell for cell in scored(results)}
    lines, heads = [], []
    for group in (results.get("rankings") or {}).get("groups", []):
        cells = sorted((by_id[i] for i in group["cells"] if i in by_id), key=lambda cell: cell["metrics"][ERROR]["value"])
        if len(cells) < 2:
            continue
        ranks, count = group["ranks"].get(ERROR, {}), len(group["cells"])
        ends = [ranks.get(group["cells"][cells[k]["id"]]) for k in (0, -1)]
        best, most = ends[0] == [1, 1], ends[1] == [count, count]
        words = _where(group)
        sides = (*_side("best", cells[0], best), ("; ", ""), *_side("worst", cells[-1], most))
        line: tuple[Part, ...] = ((f"{words}, {count} cells: ", ""), *sides, (".", ""))
        lines.append(line)
        heads.append((best + most, count, line))
    if heads:
        decided, _, line = max(heads, key=lambda head: head[:2])
        sure = sum(head[0] == 2 for head in heads)
        tail = (f" Both ends are decided against {sure} of {len(heads)} references.", "") if len(heads) > 1 else ("", "")
        yield Finding("Best and worst against one truth", (*line, tail), 70.0, tuple(lines[:LINES]), undecided=decided == 0)


def exact(results: Mapping) -> Iterator[Finding]:
    """Cells without an error beyond the noise, and how large it could be at most."""
    cells = [cell for cell in scored(results) if end_of(cell, 0) <= 0 or end_of(cell, 1) <= ROUNDING]
    if cells:
        top = max(cells, key=lambda cell: end_of(cell, 1))
        count = f"{len(cells)} of {len(scored(results))} cells have no error beyond noise and rounding"
        error = f": relative RMSE {measured(top['metrics'][ERROR], '%')}."
        parts = ((f"{count}. The least sure is ", ""), name_of(top), (error, ""))
        lines = tuple((name_of(cell), (f": {measured(cell['metrics'][ERROR], '%')}.", "")) for cell in cells[:LINES])
        yield Finding("Right within the noise", parts, 45.0, lines)


def _side(word: str, cell: Mapping, decided: bool) -> tuple[Part, ...]:
    doubt = "" if decided else ", undecided"
    return (f"{word} ", ""), name_of(cell), (f" {measured(cell['metrics'][ERROR], '%')}{doubt}", "")


def _where(group: Mapping) -> str:
    shared = ", ".join(f"{name} {plain(value)}" for name, value in group["shared"].items())
    return ", ".join(filter(None, (group["scene"], shared, group["target"])))
