"""Which assumption costs a technique most, and where: the ledgers of a run's cells in one table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence


def causes(cells: Sequence[Mapping]) -> list[dict]:
    """A row a technique: {"technique", "cells": how many count, "undecided": how many do not, as noise could make their error 0,
    "causes": [{"rung", "fraction": {"value", "ci95"}, "largest": {"cell", "fraction"}, "order": …}]}, causes from the costliest
    down. fraction: of the mean squared error, averaged over the cells, each counting alike and 0 where it has no such rung, so
    that fractions add up to 1; its interval is that of the references' noise. largest: the cell where the cause's share is
    largest. order: by how much the share changes at most when assumptions are given up in another order; None where no other
    order is known."""
    found = []
    for technique in dict.fromkeys(cell["technique"] for cell in cells if cell.get("ledger")):
        own = [cell for cell in cells if cell["technique"] == technique and cell.get("ledger")]
        decided = [cell for cell in own if _decided(cell)]
        rungs: dict[str, list[tuple[str, Mapping]]] = {}
        for cell in decided:
            for rung in cell["ledger"]:
                rungs.setdefault(rung["rung"], []).append((cell["id"], rung))
        rows = [_row(name, entries, len(decided)) for name, entries in rungs.items()]
        rows.sort(key=lambda row: -row["fraction"]["value"])
        found.append(
            {"technique": technique, "cells": len(decided), "undecided": len(own) - len(decided), "causes": rows},
        )
    return found


def _decided(cell: Mapping) -> bool:
    """Whether there is an error to split: its mean square is above 0 whatever the noise."""
    low = cell["metrics"]["mse"]["ci95"][0]
    return low is not None and low > 0 and cell["ledger_total"] > 0


def _row(name: str, entries: Sequence[tuple[str, Mapping]], cells: int) -> dict:
    fractions = [rung["fraction"] for _, rung in entries]
    halves = [0.5 * (rung["fraction_ci95"][1] - rung["fraction_ci95"][0]) for _, rung in entries]
    mean, half = sum(fractions) / cells, math.sqrt(sum(h * h for h in halves)) / cells
    cell, rung = max(entries, key=lambda entry: entry[1]["fraction"])
    others = [abs(one["other_order"]["fraction"] - one["fraction"]) for _, one in entries if "other_order" in one]
    return {
        "rung": name,
        "fraction": {"value": mean, "ci95": [mean - half, mean + half]},
        "largest": {"cell": cell, "fraction": rung["fraction"]},
        "order": max(others, default=None),
    }


def sentence(row: Mapping) -> str:
    """A technique's costliest assumption in words."""
    if not row["causes"]:
        return f"{row['technique']}: no error beyond the references' noise."
    first = row["causes"][0]
    share, (low, high) = first["fraction"]["value"], first["fraction"]["ci95"]
    worst = first["largest"]
    return (
        f"{row['technique']}: {first['rung']} costs most, {share:.0%} of the squared error [{low:.1%}, {high:.1%}] on average "
        f"over {row['cells']} cell{'s' if row['cells'] != 1 else ''}, most in {worst['cell']} ({worst['fraction']:.0%})."
    )
