"""The page's interactive plots, as Bokeh's JSON: `static/plots.js` draws them, gives some their data and all the page's colours.

Bokeh's models are made here and no text of a run becomes markup: names reach a plot as data alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bokeh.core.properties import value
from bokeh.embed import json_item
from bokeh.models import BasicTickFormatter, ColumnDataSource, HoverTool, LogAxis
from bokeh.plotting import figure

#: As the page's text.
FONT = "system-ui, -apple-system, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif"
TOOLS = "pan,box_zoom,wheel_zoom,reset,save"
#: Height of the ledger's plot: what stands about the bars, and a bar [CSS pixels].
LEDGER_TOP, LEDGER_ROW = 90, 26
#: Of the range, about points, so that words beside them stay inside.
PADDING = 0.16
#: What `static/plots.js` fills in: see `points` there.
COLUMNS = ("x", "y", "x0", "x1", "y0", "y1", "name", "first", "second", "colour", "label", "aside", "shift", "align")


def points() -> dict[str, dict]:
    """Empty plots of points with intervals in both directions and a line, one for each pair of scales: "log-linear" has a
    logarithmic x axis. Their sources are named all, filled, hollow and line, their axes x-axis and y-axis."""
    scales = ("linear", "log")
    return {f"{x}-{y}": item(_points(x, y)) for x in scales for y in scales}


def _points(x: str, y: str) -> Any:
    plot = blank(x, y, height=380)
    plot.y_range.range_padding = PADDING
    every, filled, hollow = (ColumnDataSource({name: [] for name in COLUMNS}, name=n) for n in ("all", "filled", "hollow"))
    line = ColumnDataSource({"x": [], "y": []}, name="line")
    plot.line("x", "y", source=line, line_color="gray", line_width=1.2).glyph.tags = ["ink"]
    plot.segment("x", "y0", "x", "y1", source=every, line_color="colour", line_width=1.4)
    plot.segment("x0", "y", "x1", "y", source=every, line_color="colour", line_width=1.4)
    marks = [
        plot.scatter("x", "y", source=filled, size=9, line_color="colour", fill_color="colour"),
        plot.scatter("x", "y", source=hollow, size=8, line_color="colour", fill_color="colour", fill_alpha=0.15, line_width=1.4),
    ]
    names = plot.text(
        "x",
        "y",
        text="label",
        source=filled,
        x_offset="aside",
        y_offset="shift",
        text_align="align",
        text_font_size="11px",
        text_font=value(FONT),
    )
    names.glyph.tags = ["ink"]
    plot.add_tools(HoverTool(renderers=marks, tooltips=[("", "@name"), ("value [95 %]", "@first"), ("cost", "@second")]))
    return plot


def blank(x: str = "linear", y: str = "linear", **given: Any) -> Any:
    """A figure in the page's manner, without data."""
    given |= {"tools": TOOLS, "active_drag": None, "sizing_mode": "stretch_width", "toolbar_location": "above"}
    plot = figure(x_axis_type=x, y_axis_type=y, **given)
    plot.toolbar.logo = None
    plot.xaxis.name, plot.yaxis.name = "x-axis", "y-axis"
    for axis in (*plot.xaxis, *plot.yaxis):
        axis.axis_label_text_font = axis.major_label_text_font = FONT
        axis.axis_label_text_font_size, axis.major_label_text_font_size = "13px", "12px"
        axis.axis_label_text_font_style = "normal"
        if isinstance(axis, LogAxis):
            axis.formatter = BasicTickFormatter()  # 0.1, 10: not powers of ten
    return plot


def item(plot: Any) -> dict:
    """A plot as JSON for `Bokeh.embed.embed_item`."""
    return json_item(plot)


def ledger(rows: Sequence[Mapping], colours: Mapping[str, str]) -> dict | None:
    """Stacked bars of the causes of each technique's squared error [%], as in `causes` of results.json; what makes up for other
    errors goes to the left of 0. None without a row that has causes."""
    rows = [row for row in rows if row["causes"]]
    if not rows:
        return None
    names = [row["technique"] for row in rows][::-1]
    plot = blank(y="auto", height=LEDGER_TOP + LEDGER_ROW * len(names), y_range=names)
    plot.xaxis.axis_label, plot.yaxis.axis_label = "share of squared error [%]", None
    for cause, colour in colours.items():
        bars: dict[str, list] = {name: [] for name in ("y", "left", "right", "share", "cause", "cells", "order")}
        for row in rows:
            for left, right, one in _stacked(row["causes"]):
                if one["rung"] == cause:
                    low, high = one["fraction"]["ci95"]
                    bars["y"].append(row["technique"])
                    bars["left"].append(100 * left)
                    bars["right"].append(100 * right)
                    bars["share"].append(f"{100 * one['fraction']['value']:.3g} [{100 * low:.3g} … {100 * high:.3g}] %")
                    bars["cause"].append(cause)
                    bars["cells"].append(row["cells"])
                    bars["order"].append("—" if one["order"] is None else f"± {100 * one['order']:.2g} %")
        drawn = plot.hbar(y="y", left="left", right="right", height=0.62, source=ColumnDataSource(bars), fill_color=colour,
                          line_color="white", line_width=0.4, name=cause)  # fmt: skip
        drawn.glyph.tags = ["bar"]
        plot.add_tools(HoverTool(renderers=[drawn], visible=False, tooltips=[
            ("", "@y: @cause"), ("share [95 %]", "@share"), ("mean over cells", "@cells"), ("another order", "@order"),
        ]))  # fmt: skip
    plot.ygrid.visible = False
    return item(plot)


def _stacked(causes: Sequence[Mapping]) -> list[tuple[float, float, Mapping]]:
    """(left, right, cause): what adds up goes right of 0 one after the other, what takes away left of it."""
    below = above = 0.0
    found = []
    for one in causes:
        share = one["fraction"]["value"]
        if share < 0:
            found.append((below + share, below, one))
            below += share
        else:
            found.append((above, above + share, one))
            above += share
    return found
