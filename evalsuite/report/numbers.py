"""Figures, intervals and parameters as words: one way to write them in tables, sentences and plots."""

from __future__ import annotations

import math
from collections.abc import Mapping


def number(value: float | None, unit: str = "", digits: int = 3, resolve: float = 0.0) -> str:
    """A figure for a table: significant digits, more if needed to show a difference of `resolve`; — for none."""
    if value is None or not math.isfinite(value):
        return "—"
    factor = 100 if unit == "%" else 1
    magnitude = abs(value) * factor
    if magnitude == 0:
        text = "0"
    elif 1e-3 <= magnitude < 1e5:
        decimals = digits - 1 - math.floor(math.log10(magnitude))
        if resolve > 0:
            decimals = max(decimals, min(-math.floor(math.log10(resolve * factor)), 6))
        text = f"{magnitude:.{max(0, decimals)}f}"
    else:
        text = f"{magnitude:.{digits - 1}e}"
    return ("−" if value < 0 and text.strip("0.") else "") + text + (f" {unit}" if unit else "")


def interval(metric: Mapping | None, unit: str = "") -> str:
    """lo … hi, with enough digits to tell them apart; an open end is ∞."""
    if not metric:
        return ""
    lo, hi = metric["ci95"]
    if lo == hi and lo is not None:
        return "no interval"
    width = hi - lo if lo is not None and hi is not None else 0.0
    first, last = (number(v, unit, resolve=width).replace(f" {unit}", "") for v in (lo, hi))
    return f"{'−∞' if lo is None else first} … {'∞' if hi is None else last}"


def measured(metric: Mapping, unit: str = "") -> str:
    """A figure with its 95 % interval, for a sentence: 2.31 % [2.28 … 2.35], on one line."""
    return f"{number(metric['value'], unit)} [{interval(metric, unit)}]".replace(" ", "\N{NO-BREAK SPACE}")


def estimate(metric: Mapping | None, unit: str = "") -> str:
    """`2.31 [2.20, 2.42] %`, digits enough to tell the ends apart; — where there is no number."""
    if not metric:
        return ""
    low, high = metric["ci95"]
    width = high - low if low is not None and high is not None else 0.0
    value, first, last = (number(v, unit, resolve=width).replace(" %", "") for v in (metric["value"], low, high))
    ends = "" if low == high and low is not None else f" [{'−∞' if low is None else first}, {'∞' if high is None else last}]"
    return f"{value}{ends}{' %' if unit == '%' else ''}"


def plain(value: object) -> str:
    """Parameters and facts as text."""
    if value is None:
        return "—"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return ", ".join(plain(v) for v in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {plain(v)}" for k, v in value.items())
    return str(value)
