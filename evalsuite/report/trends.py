"""The page `trends.html`: each cell's error over the checks of a gate, and where its level changed, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from bokeh.models import BasicTicker, ColumnDataSource, HoverTool

from evalsuite.report import page, plots
from evalsuite.report.numbers import estimate, interval, number
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
    checks = {check["number"]: check for check in trends["checks"]}
    renderers = sorted({one["gl_renderer"] or "an unknown renderer" for one in trends["series"]})
    rows = [
        {"data": one, "page": pages.get(one["cell"]), "spark": spark(one, list(checks)), "said": [said(c) for c in one["changes"]]}
        for one in trends["series"]
    ]
    page.write_static(directory / "static")
    html = page.templates().get_template("trends.html").render(
        trends=trends, rows=rows, renderers=renderers, title=results.get("title") or trends["report"],
        index=(directory / "results.json").exists(), changed=sum(bool(one["changes"]) for one in trends["series"]),
        data=js_json([_columns(one, checks) for one in trends["series"]]), figures=js_json({"trend": plots.item(_figure())}),
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

    band = [(x(k), y(b)) for k, _, _, b in points] + [(x(k), y(a)) for k, _, a, _ in reversed(points)]
    return {
        "band": " ".join(f"{a},{b}" for a, b in band),
        "line": " ".join(f"{x(k)},{y(value)}" for k, value, *_ in points),
        "dots": [(x(k), y(value)) for k, value, *_ in points] if len(points) <= 40 else [],
        "changes": [x((place[c["after"]] + place[c["check"]]) / 2) for c in series["changes"]],
    }


def _ends(point: Mapping) -> tuple[float, float]:
    """An interval's ends; an open one stays at the value."""
    low, high = point["ci95"]
    return (point["value"] if low is None else low), (point["value"] if high is None else high)


def _columns(series: Mapping, checks: Mapping[int, Mapping]) -> dict:
    """What the plot of a series shows [%]: columns of its sources by name. What is told of a check stays text."""
    points = series["points"]
    ends = [_ends(p) for p in points]
    about = [checks[p["check"]] for p in points]
    return {
        "points": {
            "x": [p["check"] for p in points],
            "y": [_per_cent(p["value"]) for p in points],
            "y0": [_per_cent(low) for low, _ in ends],
            "y1": [_per_cent(high) for _, high in ends],
            "check": [f"{p['check']}" for p in points],
            "created": [check["created"] for check in about],
            "commit": [check["commit"] or "unknown" for check in about],
            "verdict": [p["verdict"] for p in points],
            "value": [f"{number(p['value'], '%')} [{interval(p, '%')}]" for p in points],
        },
        "levels": {
            "x0": [level["first"] - 0.4 for level in series["levels"]],
            "x1": [level["last"] + 0.4 for level in series["levels"]],
            "y": [_per_cent(level["value"]) for level in series["levels"]],
            "low": [_per_cent(level["ci95"][0]) for level in series["levels"]],
            "high": [_per_cent(level["ci95"][1]) for level in series["levels"]],
        },
        "changes": {"x": [(c["after"] + c["check"]) / 2 for c in series["changes"]]},
    }


def _per_cent(value: float) -> float:
    return float(f"{100 * value:.8g}")


def _figure() -> object:
    """An empty plot of one series; `_columns` has its data."""
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
