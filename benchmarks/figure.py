"""A measured figure, its limit, and whether it keeps it."""

from __future__ import annotations

from dataclasses import dataclass


class NotMeasured(Exception):
    """A benchmark needs what this machine has not; its text says what, and how to get it."""


@dataclass(frozen=True)
class Limit:
    """What a figure must not exceed, or with `least` must reach."""

    value: float
    least: bool = False

    def kept(self, value: float) -> bool:
        """Whether a value is on the right side."""
        return value >= self.value if self.least else value <= self.value


@dataclass(frozen=True)
class Figure:
    """what: says what is measured. value, ci95: in `unit` ("" for a ratio). rounds: how often. limit: None where none is asked
    for. beside: absolute times, which hold for this machine alone."""

    what: str
    value: float
    ci95: tuple[float, float]
    rounds: int
    unit: str = ""
    limit: Limit | None = None
    beside: str = ""

    @property
    def verdict(self) -> str:
        """kept or missed, by the value; with ≈ where its interval reaches to the other side. Without a limit, nothing."""
        if self.limit is None:
            return ""
        kept = self.limit.kept(self.value)
        sure = all(self.limit.kept(end) == kept for end in self.ci95)
        return ("" if sure else "≈ ") + ("kept" if kept else "missed")

    @property
    def missed(self) -> bool:
        """Whether the value is on the wrong side of its limit."""
        return self.limit is not None and not self.limit.kept(self.value)

    def to_json(self) -> dict[str, object]:
        """Plain JSON."""
        limit = self.limit and {"value": self.limit.value, "least": self.limit.least}
        return vars(self) | {"ci95": list(self.ci95), "limit": limit, "verdict": self.verdict}
