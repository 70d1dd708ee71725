"""What a run found, in words, for the top of its page: each sentence with its numbers, their 95 % intervals and where they stand.

Nothing is said that the references' noise could turn round: where intervals leave an order open, the sentence says "undecided".
Each interval is one by itself; that all of many hold at once is less sure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from evalsuite.report.findings.errors import against_each_truth, exact, largest, without_score
from evalsuite.report.findings.orders import crossings, disagreements, inconclusive
from evalsuite.report.findings.parts import Finding, Part
from evalsuite.report.findings.reasons import constants, costliest

__all__ = ["MOST", "Finding", "Part", "findings"]

#: The most that stand at the top of a page.
MOST = 8
#: In no order; their findings' weights order them.
MAKERS: tuple[Callable[[Mapping], Iterator[Finding]], ...] = (
    without_score, constants, largest, costliest, against_each_truth, crossings, disagreements, inconclusive, exact,
)  # fmt: skip


def findings(results: Mapping) -> list[Finding]:
    """The findings of a run (as in results.json), the heaviest first, at most `MOST`."""
    found = [one for make in MAKERS for one in make(results)]
    return sorted(found, key=lambda one: -one.weight)[:MOST]
