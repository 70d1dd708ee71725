"""What a claim's measurement says of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

HOLDS, LIMITS, FAILS, UNTESTED = "holds", "holds within limits", "does not hold", "cannot be tested here"


@dataclass(frozen=True)
class Finding:
    """measured: figures in words, with their intervals where noise has a part. why: the limits, or why not. numbers: the same for
    programs. Every verdict but UNTESTED rests on numbers. Raises ValueError for one that does not."""

    verdict: str
    measured: str
    why: str = ""
    numbers: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.verdict != UNTESTED and not self.numbers:
            raise ValueError(f"{self.verdict} without a number")
        if self.verdict in (LIMITS, FAILS, UNTESTED) and not self.why:
            raise ValueError(f"{self.verdict} without a reason")
