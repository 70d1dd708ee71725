"""The page `trends.html`: each cell's error over the checks of a gate, and where its level changed, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from bokeh.models import BasicTicker, ColumnDataSource, HoverTool

from evalsuite.report import page, plots
from evalsuite.report.numbers import estimate
from evalsuite.report.pictures import js_json
from evalsuite.store.results import slug

#: A small drawing, and the space about what it shows [CSS pixels].
WIDTH, HEIGHT, EDGE = 180, 38, 4
#: Of points and their hover; of levels; of changes.
COLOURS = {"points": "#3b8ed0", "levels": "#7f8c8d", "changes": "#d9772b"}
#: What of a check a hover tells.
TOLD = ("check", "created", "commit", "verdict", "value")


def write(trends: Mapping, results: Mapping, directory: Path) -> Path:
    """Write the page of `trends` (as in trends.json) beside that of the run's `results`; returns trends.html. Raises
    EvalsuiteError if the folder cannot be written."""
    pages = {cell["id"]: f"cells/{slug(cell['id'])}.html" for cell in results.get("cells", [])}
    numbers = [check["number"] for check in trends["checks"]]
    renderers = sorted({one["gl_renderer"] or "an unknown renderer" for one in trends["series"]})
    rows = [
        {"data": one, "page": pages.get(one["cell"]), "spark": spark(one, numbers), "said": [said(c) for c in one["changes"]]}
        for one in trends["series"]
    ]
    page.write_static(directory / "static")
    html = page.templates().get_template("trends.html").render(
        trends=trends, rows=rows, renderers=renderers, title=results.get("title") or trends["report"],
        index=(directory / "results.json").exists(), changed=sum(bool(one["changes"]) for one in trends["series"]),
        data=js_json(_data(trends)), figures=js_json({"trend": plots.item(_figure())}),
    )  # fmt: skip
    page.put(directory / "trends.html", html)
    return directory / "trends.html"


def said(change: Mapping) -> str:
    """A change of level in words, with its size, its interval and the commits between which it lies."""
    difference = change["difference"]
    way = "rose" if difference["value"] > 0 else "fell"
    size = _unbroken({"value": abs(difference["value"]), "ci95": sorted(abs(end) for end in difference["ci95"])})
    commits = f"commit {change['after_commit'] or 'unknown'} → {change['commit'] or 'unknown'}"
    ends = f"from {_unbroken(change['from'])} to {_unbroken(change['to'])}"
    return f"rel_rmse {way} {ends} at check {change['check']} ({commits}), by {size} of the mean; verdict: {change['verdict']}."


def _unbroken(metric: Mapping) -> str:
    return estimate(metric, "%").replace(" ", "\N{NO-BREAK SPACE}")


def spark(series: Mapping, numbers: Sequence[int]) -> dict:
    """A small drawing over all checks, in its own pixels: intervals as a band, values, levels and changes."""
    place = {number: k for k, number in enumerate(numbers)}
    points = [(place[p["check"]], p["value"], *_ends(p)) for p in series["points"]]
    low, high = min(p[2] for p in points), max(p[3] for p in points)

    def x(k: float) -> float:
        return round(EDGE + (WIDTH - 2 * EDGE) * (k / (len(numbers) - 1) if len(numbers) > 1 else 0.5), 1)

    def y(value: float) -> float:
        return round(EDGE + (HEIGHT - 2 * EDGE) * ((high - value) / (high - low) if high > low else 0.5), 1)

    columns: dict[int, list] = {}  # more than one point in a column of pixels are drawn as one
    for k, value, first, last in points:
        columns.setdefault(round(x(k)), []).append((k, value, first, last))
    drawn = [(*np.mean([p[:2] for p in some], 0), min(p[2] for p in some), max(p[3] for p in some)) for some in columns.values()]
    band = [(x(k), y(last)) for k, _, _, last in drawn] + [(x(k), y(first)) for k, _, first, _ in reversed(drawn)]
    return {
        "band": " ".join(f"{a:g},{b:g}" for a, b in band),
        "line": " ".join(f"{x(k):g},{y(value):g}" for k, value, *_ in drawn),
        "dots": [(x(k), y(value)) for k, value, *_ in points] if len(points) <= 40 else [],
        "changes": [x((place[c["after"]] + place[c["check"]]) / 2) for c in series["changes"]],
    }


def _ends(point: Mapping) -> tuple[float, float]:
    """An interval's ends; an open one stays at the value."""
    low, high = point["ci95"]
    return (point["value"] if low is None else low), (point["value"] if high is None else high)


def _data(trends: Mapping) -> dict:
    """What `static/trends.js` draws, errors in %: checks, and of each series its points as columns, levels and changes."""
    checks, series = trends["checks"], trends["series"]
    place = {check["number"]: k for k, check in enumerate(checks)}
    verdicts = sorted({p["verdict"] for one in series for p in one["points"]})
    return {
        "checks": [[c["number"], c["created"], c["commit"] or "unknown"] for c in checks],
        "verdicts": verdicts,
        "series": [
            {
                "check": [place[p["check"]] for p in one["points"]],
                "verdict": [verdicts.index(p["verdict"]) for p in one["points"]],
                "y": [_per_cent(p["value"]) for p in one["points"]],
                "low": [_per_cent(p["ci95"][0]) for p in one["points"]],
                "high": [_per_cent(p["ci95"][1]) for p in one["points"]],
                "levels": [[v["first"], v["last"], *map(_per_cent, (v["value"], *v["ci95"]))] for v in one["levels"]],
                "changes": [(c["after"] + c["check"]) / 2 for c in one["changes"]],
            }
            for one in series
        ],
    }


def _per_cent(value: float | None) -> float | None:
    return None if value is None else float(f"{100 * value:.6g}")


def _figure() -> object:
    """An empty plot of one series; `static/trends.js` gives it its data."""
    plot = plots.blank(height=380)
    plot.xaxis.axis_label, plot.yaxis.axis_label = "check", "rel_rmse [%]"
    plot.xaxis.ticker = BasicTicker(min_interval=1)
    source = {name: ColumnDataSource({column: [] for column in columns}, name=name) for name, columns in (
        ("points", ("x", "y", "y0", "y1", *TOLD)), ("levels", ("x0", "x1", "y", "low", "high")), ("changes", ("x",)),
    )}  # fmt: skip
    plot.vspan("x", source=source["changes"], line_color=COLOURS["changes"], line_width=2, line_dash="dashed")
    plot.quad(left="x0", right="x1", bottom="low", top="high", source=source["levels"], fill_color=COLOURS["levels"],
              fill_alpha=0.25, line_color=None)  # fmt: skip
    plot.segment("x0", "y", "x1", "y", source=source["levels"], line_color="gray", line_width=1.4).glyph.tags = ["ink"]
    plot.segment("x", "y0", "x", "y1", source=source["points"], line_color=COLOURS["points"], line_width=1.4)
    marks = plot.scatter("x", "y", source=source["points"], size=7, line_color=None, fill_color=COLOURS["points"])
    plot.add_tools(HoverTool(renderers=[marks], tooltips=[
        ("check", "@check, @created"), ("commit", "@commit"), ("verdict", "@verdict"), ("rel_rmse [95 %]", "@value"),
    ]))  # fmt: skip
    return plot
