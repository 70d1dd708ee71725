"""001 Fig 12: how far a circle in a paraboloid map is from a circle on the sphere, over its radius and its place.

A circle of radius r about (d, 0), 1 being the rim, reaches in = 2 (atan d − atan(d − r)) towards the map's centre and
out = 2 (atan(d + r) − atan d) away from it: distortion A = (in − out) / (in + out).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import paraboloid
from evalsuite.report.figures import style

Float = NDArray[np.float64]

RADII = (0.1, 0.2, 0.3, 0.4, 0.5)
PLACES = np.linspace(0.0, 1.0, 101)
#: Heidrich, course notes, §3.2.5.
PAPER = 0.25


def distortion(radius: float, place: Float) -> Float:
    """A for circles about (place, 0)."""
    inwards = 2.0 * (np.arctan(place) - np.arctan(place - radius))
    outwards = 2.0 * (np.arctan(place + radius) - np.arctan(place))
    return (inwards - outwards) / (inwards + outwards)


def outline(radius: float, place: float, points: int = 181) -> Float:
    """(n, 2) the circle as seen from the direction of its centre, azimuthal equidistant [degrees]."""
    angle = np.linspace(0.0, 2.0 * np.pi, points)
    direction = paraboloid.paraboloid_to_direction(paraboloid.FRONT, place + radius * np.cos(angle), radius * np.sin(angle))
    centre = paraboloid.paraboloid_to_direction(paraboloid.FRONT, place, 0.0)
    side = np.array([centre[2], 0.0, -centre[0]])  # away from the map's axis
    far = np.degrees(np.arccos(np.clip(direction @ centre, -1.0, 1.0)))
    flat = np.stack([direction @ side, direction[:, 1]], -1)
    return far[:, None] * flat / np.linalg.norm(flat, axis=1, keepdims=True)


def projected(radius: float) -> float:
    """A of a circle about the rim, from its points on the sphere."""
    along = outline(radius, 1.0, 721)[:, 0]
    return float(-(along.min() + along.max()) / np.ptp(along))


def data() -> dict[str, Any]:
    """A over place for each radius, the outlines at the rim, and A of the projected points beside the formula's."""
    curves = {r: distortion(r, PLACES) for r in RADII}
    outlines = {r: outline(r, 1.0) for r in RADII}
    return {"curves": curves, "outlines": outlines, "measured": {
        "distortion_at_the_rim": {f"{r:g}": float(curve[-1]) for r, curve in curves.items()},
        "of_projected_points": {f"{r:g}": projected(r) for r in RADII},
        "largest": float(max(curve.max() for curve in curves.values())),
        "in_the_paper": PAPER,
    }}  # fmt: skip


def draw(data: dict[str, Any]) -> Any:
    """Left, A over place; right, circles about the rim as the sphere has them, beside true circles of the same width."""
    figure = style.figure(9.6, 4.2)
    left, right = figure.subplots(1, 2)
    for colour, (r, curve) in zip(style.SERIES, data["curves"].items(), strict=False):
        left.plot(PLACES, 100 * curve, color=colour)
        left.annotate(f"r = {r:g}", (1.0, 100 * curve[-1]), xytext=(4, 0), textcoords="offset points", fontsize=8, va="center",
                      color=colour)  # fmt: skip
        line = data["outlines"][r]
        right.plot(*line.T, color=colour, label=f"r = {r:g}")
        middle, half = 0.5 * (line[:, 0].min() + line[:, 0].max()), 0.5 * np.ptp(line[:, 0])
        angle = np.linspace(0, 2 * np.pi, 181)
        right.plot(middle + half * np.cos(angle), half * np.sin(angle), **style.THEORY)
    left.axhline(100 * PAPER, **style.THEORY)
    left.annotate("the paper: up to 25 %", (0.02, 100 * PAPER), xytext=(0, 3), textcoords="offset points", fontsize=8)
    left.set_xlim(0, 1.12)
    left.set_ylim(0, 28)
    left.set_xlabel("distance d of the circle's centre from the map's [radii of the map]")
    left.set_ylabel("distortion (in − out) / (in + out) [%]")
    left.grid(color="0.9", linewidth=0.7)
    right.plot(0, 0, "+", color="0.2")
    right.set_aspect("equal")
    right.set_xlabel("angle from the circle's centre, away from the axis [degrees]")
    right.set_ylabel("across [degrees]")
    right.set_title("Circles about the rim (d = 1); dashed: true circles as wide", loc="left", fontsize=9)
    right.legend(frameon=False, fontsize=8)
    return figure
