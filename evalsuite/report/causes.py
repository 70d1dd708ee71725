"""The page's section on which assumption costs each technique most: stacked bars, and the table behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

from evalsuite.compare.causes import sentence
from evalsuite.store.results import slug

#: Okabe and Ito's colours, which most colour-blind readers tell apart, for the causes that most techniques have; others in turn.
COLOURS = {
    "filter kernel": "#0072B2",
    "environment representation": "#E69F00",
    "lobe": "#D55E00",
    "visibility": "#009E73",
    "interreflection": "#56B4E9",
    "distant environment": "#CC79A7",
    "arithmetic": "#F0E442",
    "pixel sampling": "#999999",
    "technique": "#444444",
}
OTHERS = ("#6a3d9a", "#b15928", "#b2df8a", "#fb9a99", "#1f9e9e", "#a6761d")
WIDTH = 100.0  # of a bar that is all of the error


def section(results: Mapping) -> dict | None:
    """What the template `causes.html` shows; None for a run without ledgers."""
    rows = results.get("causes") or []
    if not any(row["causes"] for row in rows):
        return None
    of = colours(rows)
    # Bars share one scale; what makes up for others goes to the left of 0.
    left = max((-sum(min(c["fraction"]["value"], 0.0) for c in row["causes"]) for row in rows), default=0.0)
    right = max((sum(max(c["fraction"]["value"], 0.0) for c in row["causes"]) for row in rows), default=1.0)
    scale = WIDTH / max(left + right, 1e-9)
    shown = [
        {**row, "bars": _bars(row["causes"], of, left, scale), "sentence": sentence(row),
         "causes": [{**c, "slug": slug(c["largest"]["cell"])} for c in row["causes"]]}
        for row in rows
    ]  # fmt: skip
    return {"rows": shown, "colours": of, "zero": left * scale, "one": (left + 1.0) * scale}


def colours(rows: Sequence[Mapping]) -> dict[str, str]:
    """A colour for each cause, in the order in which they come."""
    others = cycle(OTHERS)
    names = dict.fromkeys(cause["rung"] for row in rows for cause in row["causes"])
    return {name: COLOURS.get(name) or next(others) for name in names}


def _bars(causes: Sequence[Mapping], colours: Mapping[str, str], left: float, scale: float) -> list[dict]:
    bars, below, above = [], left, left
    for cause in causes:
        value = cause["fraction"]["value"]
        if value < 0:
            below += value
        bars.append(
            {"x": (below if value < 0 else above) * scale, "width": abs(value) * scale, "colour": colours[cause["rung"]],
             "label": f"{cause['rung']}: {value:.1%}"}
        )  # fmt: skip
        if value > 0:
            above += value
    return [bar for bar in bars if bar["width"] > 0.05]
