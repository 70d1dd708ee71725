"""The envelopes as interactive plots: relative error over a swept plane, and accuracy against cost over it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.core.properties import value
from bokeh.models import ColumnDataSource, FixedTicker, HoverTool, LinearColorMapper
from bokeh.palettes import Cividis256
from numpy.typing import NDArray

from evalsuite.compare.envelopes import Contender, Plane, logarithmic
from evalsuite.report import plots, territories
from evalsuite.report.numbers import measured
from evalsuite.report.scales import Scale
from evalsuite.report.territories import Territory

Float = NDArray[np.float64]

#: Pixels an axis between the measured points.
FINE = 64


def panels(plane: Plane, levels: Float, names: Mapping[str, str]) -> list[dict]:
    """A panel a contender: its relative RMSE over the plane, log-log between measured points in the bands of `levels`, and the
    points themselves with their intervals on hovering, crossed where these reach to 0. names: of axes, with units."""
    palette = _palette(levels)
    made = []
    for one in plane.contenders:
        plot = _plane(plane, names, height=260, title=one.label)
        bands = np.digitize(_between(plane, one), levels[1:-1]).astype(np.uint8)
        low, high = (plane.xs[0], plane.ys[0]), (plane.xs[-1], plane.ys[-1])
        mapper = LinearColorMapper(palette=palette, low=-0.5, high=len(palette) - 0.5)
        plot.image([bands], x=low[0], y=low[1], dw=high[0] - low[0], dh=high[1] - low[1], color_mapper=mapper)
        known = np.isfinite(one.value)
        dots = plot.scatter("x", "y", source=_points(plane, one, known), size=7, fill_color="white", line_color="black")
        plot.scatter("x", "y", source=_points(plane, one, known & (one.low <= 0)), size=7, marker="x", line_color="black")
        words = [("", "@says"), (names.get(plane.x, plane.x), "@x"), (names.get(plane.y, plane.y), "@y")]
        plot.add_tools(HoverTool(renderers=[dots], tooltips=words))
        made.append(plots.item(plot))
    return made


def scale(levels: Float) -> Scale:
    """The panels' colours, for the page's legend: one flat colour between two levels."""
    codes = [tuple(int(c[k : k + 2], 16) for k in (1, 3, 5)) for c in _palette(levels)]
    at = np.log10(levels)
    stops = [(float(end), code) for k, code in enumerate(codes) for end in (at[k], at[k + 1])]
    shown = list(zip(at, levels, strict=True))[:: 1 + len(levels) // 9]
    ticks = tuple((float(a), f"{100 * v:.3g} %") for a, v in shown)
    return Scale(tuple(stops), ticks, "relative RMSE against the technique's own truth; beyond the ends the end colours")


def winner(one: Territory, values: Mapping[str, float], colours: Mapping[str, str], names: Mapping[str, str]) -> dict:
    """Who is best where: the best one's colour, striped where another's 95 % interval overlaps; crossovers with their intervals,
    hollow where undecided; the measured points with all errors on hovering. values: of the axes that are not drawn."""
    plane = one.plane
    plot = _plane(plane, names, height=320, title=", ".join(f"{names.get(name, name)} {v:g}" for name, v in values.items()))
    pixels = np.zeros((territories.FINE, territories.FINE, 4), np.uint8)
    for k, member in enumerate(one.members):
        code = colours[member.technique]
        pixels[one.best == k] = [*(int(code[i : i + 2], 16) for i in (1, 3, 5)), 215]
    stripes = np.add.outer(np.arange(territories.FINE), np.arange(territories.FINE)) % 8 < 3
    pixels[one.undecided & stripes, 3] = 90
    low, size = (plane.xs[0], plane.ys[0]), (plane.xs[-1] - plane.xs[0], plane.ys[-1] - plane.ys[0])
    plot.image_rgba([pixels.view(np.uint32)[..., 0]], x=low[0], y=low[1], dw=size[0], dh=size[1])
    known = np.logical_or.reduce([np.isfinite(c.value) for c in one.members])
    marks = [plot.scatter("x", "y", source=_standings(one, known), size=6, fill_color="white", line_color="black")]
    for decided in (True, False):
        at = [c for c in one.crossings() if c.decided is decided]
        ends = [{"value": c.value, "ci95": [c.low, c.high]} for c in at]
        source = ColumnDataSource({
            "x": [c.value for c in at], "y": [c.y for c in at], "x0": [c.low for c in at], "x1": [c.high for c in at],
            "says": [f"{c.a.label} = {c.b.label} at {measured(end)}" + ("" if decided else ", undecided")
                     for c, end in zip(at, ends, strict=True)],
        })  # fmt: skip
        plot.segment(
            "x0", "y", "x1", "y", source=source, line_color="black", line_width=2.2, line_dash="solid" if decided else "dotted"
        )
        marks.append(plot.scatter("x", "y", source=source, size=8, marker="diamond", line_color="black",
                                  fill_color="black" if decided else "white"))  # fmt: skip
    plot.add_tools(
        HoverTool(
            renderers=marks, tooltips=[("", "@says"), (names.get(plane.x, plane.x), "@x"), (names.get(plane.y, plane.y), "@y")]
        )
    )
    return plots.item(plot)


def _standings(one: Territory, known: NDArray[np.bool_]) -> ColumnDataSource:
    xs, ys = np.meshgrid(one.plane.xs, one.plane.ys)

    def says(j: int, i: int) -> str:
        ranked = sorted((c for c in one.members if np.isfinite(c.value[j, i])), key=lambda c: c.value[j, i])
        high = (float(c.high[j, i]) for c in ranked)
        ends = [[float(c.low[j, i]), h if math.isfinite(h) else None] for c, h in zip(ranked, high, strict=True)]
        return "; ".join(
            f"{c.label} {measured({'value': float(c.value[j, i]), 'ci95': e}, '%')}" for c, e in zip(ranked, ends, strict=True)
        )

    return ColumnDataSource({"x": xs[known].tolist(), "y": ys[known].tolist(), "says": [says(*at) for at in np.argwhere(known)]})


def _plane(plane: Plane, names: Mapping[str, str], **given: Any) -> Any:
    """A figure with the plane's axes, ticked at the measured points."""
    plot = plots.blank(*("log" if logarithmic(v) else "linear" for v in (plane.xs, plane.ys)), **given)
    plot.toolbar.autohide = True
    plot.xaxis.axis_label, plot.yaxis.axis_label = names.get(plane.x, plane.x), names.get(plane.y, plane.y)
    for values, axis in ((plane.xs, plot.xaxis), (plane.ys, plot.yaxis)):
        axis.ticker = FixedTicker(ticks=values.tolist())
        axis.major_label_overrides = {float(v): f"{v:g}" for v in values}
    return plot


def front(entry: Mapping, colours: Mapping[str, str], cost: str) -> dict:
    """One entry of `envelopes.pareto`: the contenders with both intervals, filled where on the front, and the front. cost: the
    axis in words."""
    name = entry["cost"]
    given = [p for p in entry["points"] if p["rel_rmse"]["value"] and p[name]["value"]]
    plot = plots.blank("log", "log", height=380)
    plot.y_range.range_padding = plots.PADDING
    plot.xaxis.axis_label, plot.yaxis.axis_label = cost, "root mean square relative RMSE [%]"
    on = sorted((p[name]["value"], 100 * p["rel_rmse"]["value"]) for p in given if p["on_front"])
    if on:
        plot.step([x for x, _ in on], [y for _, y in on], mode="after", line_color="gray").glyph.tags = ["ink"]
    marks = []
    for filled in (True, False):
        source = ColumnDataSource(_rows([p for p in given if p["on_front"] is filled], name, colours))
        plot.segment("x", "y0", "x", "y1", source=source, line_color="colour", line_width=1.4)
        plot.segment("x0", "y", "x1", "y", source=source, line_color="colour", line_width=1.4)
        marks.append(plot.scatter("x", "y", source=source, size=9, line_color="colour", fill_color="colour",
                                  fill_alpha=1.0 if filled else 0.15, line_width=1.4))  # fmt: skip
        words = plot.text("x", "y", text="name", source=source, x_offset=7, y_offset=-5, text_font_size="11px")
        words.glyph.text_font, words.glyph.tags = value(plots.FONT), ["ink"]
    plot.add_tools(
        HoverTool(renderers=marks, tooltips=[("", "@name"), ("rel. RMSE [95 %]", "@first"), ("cost [95 %]", "@second")])
    )
    return plots.item(plot)


def _rows(given: Sequence[Mapping], cost: str, colours: Mapping[str, str]) -> dict[str, list]:
    def end(metric: Mapping, which: int) -> float:
        stated = metric["ci95"][which]
        return metric["value"] if stated is None else stated

    def low(metric: Mapping) -> float:  # an interval that reaches to 0 has no logarithm there
        return max(end(metric, 0), 0.1 * metric["value"])

    errors, costs = [p["rel_rmse"] for p in given], [p[cost] for p in given]
    return {
        "x": [c["value"] for c in costs], "x0": [low(c) for c in costs], "x1": [end(c, 1) for c in costs],
        "y": [100 * e["value"] for e in errors], "y0": [100 * low(e) for e in errors], "y1": [100 * end(e, 1) for e in errors],
        "name": [p["contender"] for p in given], "colour": [colours[p["technique"]] for p in given],
        "first": [measured(e, "%") + ("" if p["decided"] else " undecided") for p, e in zip(given, errors, strict=True)],
        "second": [measured(c, "ms") for c in costs],
    }  # fmt: skip


def _points(plane: Plane, one: Contender, known: NDArray[np.bool_]) -> ColumnDataSource:
    xs, ys = np.meshgrid(plane.xs, plane.ys)
    values = (grid[known].tolist() for grid in (one.value, one.low, one.high))
    ends = ({"value": v, "ci95": [lo, hi if math.isfinite(hi) else None]} for v, lo, hi in zip(*values, strict=True))
    says = [f"relative RMSE {measured(metric, '%')}" for metric in ends]
    return ColumnDataSource({"x": xs[known].tolist(), "y": ys[known].tolist(), "says": says})


def _between(plane: Plane, one: Contender) -> Float:
    """(FINE, FINE) relative RMSE at the pixels' centres, log-log between measured points; NaN beside those without a score."""

    def across(points: Float, rows: Float) -> Float:
        u = np.log(points) if logarithmic(points) else points
        at = u[0] + (u[-1] - u[0]) * (np.arange(FINE) + 0.5) / FINE
        return np.stack([np.interp(at, u, row) for row in rows])

    return np.exp(across(plane.ys, across(plane.xs, np.log(np.maximum(one.drawn, 1e-9))).T).T)


def _palette(levels: Float) -> list[str]:
    """A colour between each two levels: the lighter, the less error."""
    return [Cividis256[round(k)] for k in np.linspace(255, 0, len(levels) - 1)]
