"""What a run with `--budget` spent, in a line of the page's head."""

from __future__ import annotations

from collections.abc import Mapping


def fact(results: Mapping) -> list[tuple[str, str]]:
    """Name and words, none for a run without a budget."""
    budget = results.get("budget")
    if not budget:
        return []
    spent = len(budget["spent"])
    references = "1 fresh reference" if spent == 1 else f"{spent} fresh references"
    before, after = budget["undecided_before"], budget["undecided_after"]
    words = f"{budget['taken_s']:.0f} of {budget['asked_s']:.0f} s, {references}; undecided pairs: {before} before, {after} after"
    return [("budget", words)]
