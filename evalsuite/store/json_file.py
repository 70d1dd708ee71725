"""JSON files that others may have written or changed."""

from __future__ import annotations

import json
import math
from pathlib import Path

#: Longest whole number [digits]; nothing here counts further.
DIGITS = 19


def read_json(path: Path) -> object:
    """What a file holds. Raises OSError for one that cannot be read, ValueError for one that is no JSON: of another encoding,
    nested without end, or with numbers that are not finite, which Python would otherwise take."""
    try:
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_none, parse_float=_finite, parse_int=_whole)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _none(word: str) -> object:
    raise ValueError(f"the number {word}")


def _finite(word: str) -> float:
    value = float(word)
    return value if math.isfinite(value) else _none(word)


def _whole(word: str) -> int:
    return int(word) if len(word) <= DIGITS else _none(word[:40])
