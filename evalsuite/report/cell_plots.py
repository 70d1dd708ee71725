"""A cell's interactive plots: where its error comes from, how it depends on an angle, and how it is distributed.

All cells share the figures (`figures`, in `static/figures.js`); a cell's page has what goes into them (`contents`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bokeh.models import ColumnDataSource, FactorRange, HoverTool, Range1d, Span

from evalsuite.report.numbers import interval, number
from evalsuite.report.plots import FONT, blank, item

#: As elsewhere on the page: more error or too bright, less or too dark.
MORE, LESS = "#d9772b", "#3b8ed0"
AXES = {
    "face_angle": "angle to the cube face's centre [°]",
    "n_dot_v": "n · v, cosine of the viewing angle [1]",
}
SERIES = (("rel_rmse", "relative RMSE", MORE), ("rel_bias", "relative bias", LESS))
#: Height of the ledger's plot: what stands about the bars, and a bar [CSS pixels].
LEDGER_TOP, LEDGER_ROW = 80, 38
#: Stands for an interval without an end: beyond every plot [%].
_FAR = 1e6


def figures() -> dict[str, dict]:
    """The figures, without data: "curve", "ledger" and "histogram"."""
    return {"curve": item(_curve()), "ledger": item(_ledger()), "histogram": item(_histogram())}


def contents(cell: Mapping) -> dict[str, dict]:
    """name → {"figure", "given": what goes into its named parts}: "ledger", and the curves by their names in results.json."""
    made = {name: {"figure": "curve", "given": curve(AXES[name], bins)} for name, bins in curves(cell).items()}
    if cell.get("ledger"):
        made["ledger"] = {"figure": "ledger", "given": ledger(cell["ledger"])}
    return made


def curves(cell: Mapping) -> dict[str, Sequence[Mapping]]:
    """The bins of the curves that a cell has."""
    found = cell.get("curves") or {}
    return {name: found[name]["bins"] for name in AXES if found.get(name, {}).get("bins")}


def curve(axis: str, bins: Sequence[Mapping]) -> dict[str, Any]:
    """Relative RMSE and bias [%] of bins, as steps with 95 % intervals in their middles. The y axis follows the values: an
    interval of a few pixels may leave it."""
    values = [0.0, *(100 * b[name]["value"] for b in bins for name, *_ in SERIES if b[name]["value"] is not None)]
    room = 0.08 * (max(values) - min(values)) or 1.0
    given: dict[str, Any] = {
        "x-axis": axis,
        "y-range": {"start": min(values) - room * (min(values) < 0), "end": max(values) + room},
    }
    for name, *_ in SERIES:
        known = [b for b in bins if b[name]["value"] is not None]
        given[name] = {
            "x0": [b["edges"][0] for b in known], "x1": [b["edges"][1] for b in known],
            "x": [sum(b["edges"]) / 2 for b in known], "y": [100 * b[name]["value"] for b in known],
            "low": [_end(b[name], 0, -_FAR) for b in known], "high": [_end(b[name], 1, _FAR) for b in known],
            "says": [f"{number(b[name]['value'], '%')} [{interval(b[name], '%')}]" for b in known],
            "range": [f"{b['edges'][0]:.3g} … {b['edges'][1]:.3g}, {b['pixels']} pixels" for b in known],
        }  # fmt: skip
    return given


def ledger(rungs: Sequence[Mapping]) -> dict[str, Any]:
    """A bar for each rung: its share of the mean squared error [%] with its 95 % interval."""
    rungs = [rung for rung in rungs if rung["fraction"] is not None]
    names = [rung["rung"] for rung in rungs]
    shares = [{"value": rung["fraction"], "ci95": rung["fraction_ci95"] or [None, None]} for rung in rungs]
    bars = {
        "y": names, "x": [100 * share["value"] for share in shares],
        "low": [_end(share, 0, 100 * share["value"]) for share in shares],
        "high": [_end(share, 1, 100 * share["value"]) for share in shares],
        "colour": [LESS if share["value"] < 0 else MORE for share in shares],
        "says": [f"{number(share['value'], '%')} [{_ends(share)}]" for share in shares],
        "step": [f"{rung['from']} → {rung['to']}" for rung in rungs],
    }  # fmt: skip
    return {"bars": bars, "y-range": {"factors": names[::-1]}, "frame": {"height": LEDGER_TOP + LEDGER_ROW * max(len(names), 1)}}


def _curve() -> Any:
    plot = blank(height=300, y_range=Range1d(name="y-range"))
    plot.yaxis.axis_label = "of the bin's mean reference [%]"
    plot.add_layout(_zero("width"))
    for name, words, colour in SERIES:
        source = _source(name, "x0", "x1", "x", "y", "low", "high", "says", "range")
        plot.segment("x", "low", "x", "high", source=source, line_color=colour, line_width=1.2)
        steps = plot.segment("x0", "y", "x1", "y", source=source, line_color=colour, line_width=3, legend_label=words)
        plot.add_tools(HoverTool(renderers=[steps], visible=False, tooltips=[("", words), ("95 %", "@says"), ("bin", "@range")]))
    return _legend(plot)


def _ledger() -> Any:
    plot = blank(y="auto", height=LEDGER_TOP, y_range=FactorRange(name="y-range"), name="frame")
    plot.xaxis.axis_label, plot.yaxis.axis_label = "share of the mean squared error [%]", None
    source = _source("bars", "y", "x", "low", "high", "colour", "says", "step")
    bars = plot.hbar(y="y", left=0, right="x", height=0.5, source=source, fill_color="colour", line_color=None)
    plot.segment("low", "y", "high", "y", source=source, line_color="gray", line_width=1.6).glyph.tags = ["ink"]
    plot.add_layout(_zero("height"))
    plot.add_tools(HoverTool(renderers=[bars], visible=False, tooltips=[("", "@y, @step"), ("share [95 %]", "@says")]))
    plot.ygrid.visible = False
    return plot


def _histogram() -> Any:
    """Signed relative errors of pixels and what noise alone would give: `static/histogram.js` makes both."""
    plot = blank(height=320)
    plot.yaxis.axis_label = "of the pixels [%]"
    source = _source("errors", "left", "right", "top", "colour", "says")
    bars = plot.quad(left="left", right="right", top="top", bottom=0, source=source, fill_color="colour", line_color=None,
                     fill_alpha=0.8, legend_label="the picture's errors")  # fmt: skip
    line = plot.step("x", "y", source=_source("noise", "x", "y"), mode="after", line_color="gray", line_width=1.8,
                     legend_label="what noise alone gives")  # fmt: skip
    line.glyph.tags = ["ink"]
    plot.add_layout(_zero("height"))
    plot.y_range.start = 0
    plot.add_tools(HoverTool(renderers=[bars], visible=False, tooltips=[("error", "@says"), ("of the pixels", "@top{0.00} %")]))
    return _legend(plot)


def _source(name: str, *columns: str) -> ColumnDataSource:
    return ColumnDataSource({column: [] for column in columns}, name=name)


def _zero(dimension: str) -> Span:
    return Span(location=0, dimension=dimension, line_color="gray", line_width=1)


def _legend(plot: Any) -> Any:
    plot.legend.label_text_font, plot.legend.label_text_font_size = FONT, "12px"
    plot.legend.orientation, plot.legend.padding, plot.legend.margin = "horizontal", 0, 4
    plot.add_layout(plot.legend[0], "above")
    return plot


def _end(metric: Mapping, side: int, otherwise: float) -> float:
    end = metric["ci95"][side]
    return otherwise if end is None else 100 * end


def _ends(share: Mapping) -> str:
    return interval(share, "%") if share["ci95"][0] is not None else "noise decides"
