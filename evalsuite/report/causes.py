"""The page's section on which assumption costs each technique most: what its plot and table show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

from evalsuite.compare.causes import sentence
from evalsuite.report import plots
from evalsuite.store.results import slug

#: Okabe and Ito's colours, which most colour-blind readers tell apart, for the causes that most techniques have; others in turn.
COLOURS = {
    "filter kernel": "#0072B2",
    "environment representation": "#E69F00",
    "lobe": "#D55E00",
    "Fresnel outside": "#882255",
    "visibility": "#009E73",
    "interreflection": "#56B4E9",
    "distant environment": "#CC79A7",
    "arithmetic": "#F0E442",
    "pixel sampling": "#999999",
    "technique": "#444444",
}
OTHERS = ("#6a3d9a", "#b15928", "#b2df8a", "#fb9a99", "#1f9e9e", "#a6761d")


def section(results: Mapping) -> dict | None:
    """What the template `causes.html` shows; None for a run without ledgers."""
    rows = results.get("causes") or []
    if not any(row["causes"] for row in rows):
        return None
    shown = [{**row, "causes": [{**c, "slug": slug(c["largest"]["cell"])} for c in row["causes"]]} for row in rows]
    drawn = [row for row in rows if row["causes"]]
    words = ["Stacked bars of the causes of each technique's squared error.", *map(sentence, drawn)]
    height = plots.LEDGER_TOP + plots.LEDGER_ROW * len(drawn)
    return {"rows": shown, "colours": colours(rows), "height": height, "sentence": " ".join(words)}


def colours(rows: Sequence[Mapping]) -> dict[str, str]:
    """A colour for each cause, in the order in which they come."""
    others = cycle(OTHERS)
    names = dict.fromkeys(cause["rung"] for row in rows for cause in row["causes"])
    return {name: COLOURS.get(name) or next(others) for name in names}
