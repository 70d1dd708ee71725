"""How the figures look: one place for colours and for what all axes share."""

from __future__ import annotations

from typing import Any

#: One colour a map, told apart also by those who do not see red or green as others do (Okabe and Ito 2008).
COLOURS = {"sphere": "#D55E00", "cube": "#0072B2", "paraboloid": "#009E73"}
#: Techniques side by side, in turn (Okabe and Ito 2008).
SERIES = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#000000")
THEORY = {"color": "0.25", "linewidth": 1.0, "linestyle": (0, (4, 2))}


def figure(width: float, height: float) -> Any:
    """An empty matplotlib Figure that lays itself out. width, height: [inches]."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def angle_axis(axes: Any, to_degrees: int) -> None:
    """θ from 0 to `to_degrees` along x, with a light grid."""
    axes.set_xlim(0, to_degrees)
    axes.set_xticks(range(0, to_degrees + 1, 30 if to_degrees > 90 else 15))
    axes.set_xlabel("angle θ between viewing direction and reflected ray [degrees]")
    axes.grid(color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)
