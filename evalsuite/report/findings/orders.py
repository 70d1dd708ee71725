"""Findings on who is better: crossovers, metrics that disagree, orders that noise could change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from evalsuite.report.findings.parts import LINES, Finding, Part, capital, count_of, name_of, scored
from evalsuite.report.numbers import measured, plain


def crossings(results: Mapping) -> Iterator[Finding]:
    """Where one technique overtakes another; the headline is the narrowest interval against one truth."""
    found = (results.get("envelopes") or {}).get("crossovers", [])
    decided = [one for one in found if one["decided"]]
    if not found:
        return
    if not decided:
        one = found[0]
        words = f"All {len(found)} are undecided: noise could move each out of its sweep; {_crossing(one)}"
        yield Finding("Crossovers", ((words, "#envelopes"), (".", "")), 35.0, undecided=True)
        return
    decided.sort(key=lambda one: (not one["same_truth"], (one["ci95"][1] - one["ci95"][0]) / abs(one["value"] or 1.0)))
    tail = f". {len(decided)} of {len(found)} crossovers are decided." if len(found) > 1 else "."
    lines = tuple(((_crossing(one), "#envelopes"), (".", "")) for one in decided[:LINES])
    yield Finding("Crossovers", ((_crossing(decided[0]), "#envelopes"), (tail, "")), 65.0, lines)


def _crossing(one: Mapping) -> str:
    at = ", ".join(f"{name} {plain(value)}" for name, value in one["at"].items())
    words = (
        f"along {one['axis']}, {one['better_below']} is nearer to the truth below {measured(one)}, {one['better_above']} above"
    )
    truth = "" if one["same_truth"] else ", each against its own truth"
    return capital(f"{words} ({', '.join(filter(None, (one['scene'], one['environment'], one['target'], at)))}{truth})")


def disagreements(results: Mapping) -> Iterator[Finding]:
    """The strongest pair that two metrics order differently, both beyond doubt."""
    flips = (results.get("rankings") or {}).get("flips", [])
    cells = {cell["id"]: cell for cell in scored(results)}
    flips = [flip for flip in flips if flip["a"] in cells and flip["b"] in cells and flip["strength"] > 0]
    if not flips:
        return
    one = flips[0]
    a, b = cells[one["a"]], cells[one["b"]]

    def clause(side: str) -> str:
        metric = next((m for m in one[side] if m != "rel_bias"), one[side][0])
        unit = "%" if metric in ("rel_rmse", "rel_bias") else ""
        return f"{metric}: {measured(a['metrics'][metric], unit)} beside {measured(b['metrics'][metric], unit)}"

    parts = (
        name_of(a), (f" is nearer to the truth by {clause('prefer_a')}, but ", ""), name_of(b),
        (f" by {clause('prefer_b')} (first figure: the former). ", ""),
        (f"{count_of(len(flips), 'pair')} of this kind", "#rankings"), (".", ""),
    )  # fmt: skip
    yield Finding("Metrics disagree", parts, 55.0)


def inconclusive(results: Mapping) -> Iterator[Finding]:
    """Neighbours whose order noise could change; the headline pair has the most of its error at stake."""
    pairs = [pair for group in results.get("comparisons") or [] for pair in group["pairs"]]
    pairs = [pair for pair in pairs if pair["difference"]["value"] != 0 or pair["decided"]]  # the same picture twice has no order
    open_ = [pair for pair in pairs if not pair["decided"]]
    cells = {cell["id"]: cell for cell in scored(results)}
    open_ = [pair for pair in open_ if pair["better"] in cells and pair["worse"] in cells]
    if not open_:
        return
    open_.sort(key=lambda pair: -_at_stake(cells, pair))
    lines = tuple(_pair(cells, pair) for pair in open_[:LINES])
    head = (
        f"{len(open_)} of {len(pairs)} neighbours in order of mean squared error: noise could change which is better. First ",
        "",
    )
    yield Finding("Orders that noise could change", (head, *lines[0]), 50.0, lines, undecided=True)


def _at_stake(cells: Mapping[str, Mapping], pair: Mapping) -> float:
    """How much of the worse one's squared error the interval of the difference leaves open."""
    error = (cells[pair["worse"]]["metrics"].get("mse") or {}).get("value")
    low, high = pair["difference"]["ci95"]
    return (high - low) / error if error else 0.0


def _pair(cells: Mapping[str, Mapping], pair: Mapping) -> tuple[Part, ...]:
    worse, better = (name_of(cells[pair[side]]) for side in ("worse", "better"))
    return worse, (" less ", ""), better, (f": {measured(pair['difference'])} radiance².", "")
