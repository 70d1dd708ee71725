"""Section "Envelopes" of the page: contours over swept planes, who is best where, accuracy against cost."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import envelopes
from evalsuite.compare.envelopes import Contender, Plane, logarithmic
from evalsuite.image.files import replacing
from evalsuite.report import envelope_plots, territories
from evalsuite.report.figures import style
from evalsuite.report.scales import Scale
from evalsuite.report.territories import Territory, fine, interpolate

Float = NDArray[np.float64]

#: Words and units of axes that the suite knows; others go by their name.
AXES = {
    "exponent": "exponent of the lobe",
    "alpha": "GGX or Beckmann width α",
    "frequency": "environment frequency [degree ℓ]",
    "face_size": "face size [texels]",
}
COSTS = {"gpu_ms": "GPU time of one frame [ms]", "prepare_ms": "preparation, once an environment [ms]"}
#: Most decided crossovers in the page's table; results.json has all.
ROWS = 60


@dataclass(frozen=True)
class Figure:
    """path: SVG relative to the page, with a PNG of the same stem beside it. alt: what it shows, for who cannot see it. plots:
    the same as plots to use, name → JSON, which then stand on the page instead; scale: their colours, if they have such; legend:
    colours of techniques."""

    path: str
    title: str
    alt: str
    caption: str
    plots: Mapping[str, dict] = field(default_factory=dict)
    scale: Scale | None = None
    legend: Mapping[str, str] = field(default_factory=dict)


def section(results: Mapping, directory: Path) -> dict[str, Any] | None:
    """Draw the figures into `directory/envelopes/`; {"figures", "crossovers", "undecided", "more"} for the template, or
    None where the run swept no plane. Raises EvalsuiteError if the folder cannot be written."""
    found = results.get("envelopes")
    planes = envelopes.planes(results.get("cells", [])) if found else []
    if not planes:
        return None
    figures = []
    for number, plane in enumerate(planes, 1):
        figures += _figures(plane, number, found["pareto"], directory)
    decided = [one for one in found["crossovers"] if one["decided"]]
    decided.sort(key=lambda one: (one["axis"], list(one["at"].values()), one["better_below"]))
    undecided = len(found["crossovers"]) - len(decided)
    return {"figures": figures, "crossovers": decided[:ROWS], "undecided": undecided, "more": max(0, len(decided) - ROWS)}


def _figures(plane: Plane, number: int, fronts: Sequence[Mapping], directory: Path) -> list[Figure]:
    where = f"{plane.scene}, {plane.environment + ', ' if plane.environment else ''}{plane.target}"
    axes = f"{plane.x} × {plane.y}"
    points = f"{len(plane.xs)} × {len(plane.ys)} measured points"
    made = [_save(
        contours(plane), directory, f"contours-{number}",
        f"Relative RMSE over {axes}: {where}",
        f"Contours of relative RMSE over {axes}, one panel for each of {', '.join(c.label for c in plane.contenders)}",
        f"Dots are the {points}, crossed where the 95 % interval reaches 0; between them log-log interpolation. Each technique "
        "against its own truth.",
    )]  # fmt: skip
    levels = _levels_of(plane)
    made[0] = replace(
        made[0],
        plots={f"contours-{number}-{k}": one for k, one in enumerate(envelope_plots.panels(plane, levels, AXES), 1)},
        scale=envelope_plots.scale(levels),
    )
    rivals = territories.of(plane)
    if rivals:
        made.append(_save(
            winners(plane, rivals), directory, f"best-{number}",
            f"Who is best where, over {axes}: {where}",
            f"Map over {axes} coloured by the technique with the smallest relative RMSE, with crossover lines between them",
            "Striped: the best one's 95 % interval overlaps another's, so it is undecided. Diamonds: two are equal; bars: the "
            "95 % interval of that crossover, dotted or grey where it is undecided. Between the dots log-log interpolation.",
        ))  # fmt: skip
        colours = _colours(plane)
        of = {
            f"best-{number}-{k}": envelope_plots.winner(one, values, colours, AXES) for k, (values, one) in enumerate(rivals, 1)
        }
        made[-1] = replace(made[-1], plots=of, legend=colours)
    own = [f for f in fronts if set(p["contender"] for p in f["points"]) == {c.label for c in plane.contenders}
           and (f["scene"], f["target"], f["environment"], *f["over"])
           == (plane.scene, plane.target, plane.environment, plane.x, plane.y)]  # fmt: skip
    if own:
        axes = ", ".join(dict.fromkeys(AXES.get(name, name) for c in plane.contenders for name in c.at))
        best = {f["cost"]: [p["contender"] for p in f["points"] if p["on_front"]] for f in own}
        made.append(_save(
            fronts_figure(plane, own), directory, f"pareto-{number}",
            f"Accuracy against cost: {where}",
            "Relative RMSE against cost. On the front: " + "; ".join(f"{COSTS[k]}: {', '.join(v)}" for k, v in best.items()),
            f"Root mean square over the {own[0]['cells']} cells that all have; bars are 95 % intervals, of times those of the "
            "mean over these cells. Line: the front. Hollow: beaten in both."
            + (f" Numbers: {axes}." if axes else ""),
        ))  # fmt: skip
        colours = _colours(plane)
        of = {f"pareto-{number}-{f['cost']}": envelope_plots.front(f, colours, COSTS[f["cost"]]) for f in own}
        made[-1] = replace(made[-1], plots=of)
    return made


def contours(plane: Plane) -> Any:
    """One panel a contender: rows are techniques, columns the values of the other axes; one scale of colours."""
    techniques = list(dict.fromkeys((c.technique, *c.others.values()) for c in plane.contenders))
    columns = max(sum((c.technique, *c.others.values()) == t for c in plane.contenders) for t in techniques)
    figure = style.figure(1.2 + 2.5 * columns, 0.9 + 2.1 * len(techniques))
    grid = figure.subplots(len(techniques), columns, squeeze=False, sharex=True, sharey=True)
    levels, shown = _levels_of(plane), None
    for row, technique in zip(grid, techniques, strict=True):
        members = [c for c in plane.contenders if (c.technique, *c.others.values()) == technique]
        for axes, one in zip(row, members, strict=False):
            shown = _contour(axes, plane, one, levels)
            axes.set_title(_plain(one.label.replace(", ", "\n", 1)), loc="left", fontsize=8)
        for axes in row[len(members) :]:
            axes.set_visible(False)
    figure.supxlabel(_plain(AXES.get(plane.x, plane.x)), fontsize=9)
    figure.supylabel(_plain(AXES.get(plane.y, plane.y)), fontsize=9)
    if shown is not None:
        bar = figure.colorbar(shown, ax=list(grid.ravel()), shrink=0.7, label="relative RMSE against the technique's own truth")
        bar.set_ticks(levels, labels=[_percent(v) for v in levels])
    return figure


def _contour(axes: Any, plane: Plane, one: Contender, levels: Float) -> Any:
    from matplotlib.colors import LogNorm

    _scales(axes, plane)
    xs, ys = np.meshgrid(fine(plane.xs), fine(plane.ys))
    errors = np.exp(interpolate(plane, np.log(np.maximum(one.drawn, 1e-9))))
    masked = np.ma.masked_invalid(errors)
    shown = axes.contourf(xs, ys, masked, levels, cmap="cividis_r", norm=LogNorm(levels[0], levels[-1]), extend="both")
    lines = axes.contour(xs, ys, masked, levels, colors="k", linewidths=0.6)
    axes.clabel(lines, fmt=_percent, fontsize=7)
    _dots(axes, plane, np.isfinite(one.value))
    _dots(axes, plane, one.low <= 0, marker="x", color="k", markersize=5)
    return shown


def winners(plane: Plane, rivals: Sequence[tuple[Mapping, Territory]]) -> Any:
    """A panel a slice: the best contender's colour, hatched where undecided, and the crossovers with their intervals."""
    figure = style.figure(max(1.0 + 3.4 * len(rivals), 6.4), 4.4)
    colours = _colours(plane)
    grid = figure.subplots(1, len(rivals), squeeze=False, sharey=True)[0]
    for axes, (values, one) in zip(grid, rivals, strict=True):
        _winner(axes, one, colours)
        words = ", ".join(f"{AXES.get(name, name)} {value:g}" for name, value in values.items())
        axes.set_title(_plain(words), loc="left", fontsize=9)
        axes.set_xlabel(_plain(AXES.get(plane.x, plane.x)), fontsize=9)
    figure.supylabel(_plain(AXES.get(plane.y, plane.y)), fontsize=9)
    from matplotlib.patches import Patch

    handles = [Patch(color=colour, alpha=0.75, label=_plain(name)) for name, colour in colours.items()]
    handles.append(Patch(facecolor="none", edgecolor="0.3", hatch="////", label="undecided: 95 % intervals overlap"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def _winner(axes: Any, one: Territory, colours: Mapping[str, str]) -> None:
    from matplotlib.colors import ListedColormap

    plane, best, known = one.plane, one.best, one.known
    _scales(axes, plane)
    xs, ys = np.meshgrid(fine(plane.xs), fine(plane.ys))
    for k, member in enumerate(one.members):
        here = np.ma.masked_where(best != k, np.ones(best.shape))
        if here.count():
            colour = ListedColormap([colours[member.technique]])
            axes.pcolormesh(xs, ys, here, cmap=colour, alpha=0.75, shading="nearest", rasterized=True)
    axes.contourf(xs, ys, one.undecided.astype(float), [0.5, 1.5], colors="none", hatches=["////"])
    for i, j in sorted(one.neighbours()):
        both = known[i] & known[j] & _grown((best == i) | (best == j))
        gap = np.ma.masked_where(~both, np.where(both, one.value[i], 0.0) - np.where(both, one.value[j], 0.0))
        axes.contour(xs, ys, gap, [0.0], colors="k", linewidths=1.2)
    for at in one.crossings():
        colour = "k" if at.decided else "0.45"
        axes.plot([at.low, at.high], [at.y, at.y], color=colour, linewidth=2.2, solid_capstyle="butt", zorder=4)
        axes.plot(at.value, at.y, "D", color=colour, markersize=4, zorder=5)
    _dots(axes, plane, np.logical_or.reduce([np.isfinite(c.value) for c in one.members]))


def fronts_figure(plane: Plane, fronts: Sequence[Mapping]) -> Any:
    """A panel a cost: each contender with both intervals, technique by colour and its parameters beside it, and the front."""
    from matplotlib.patches import Patch
    from matplotlib.ticker import LogLocator, NullFormatter

    figure = style.figure(6.2 * len(fronts), 5.0)
    colours = _colours(plane)
    for axes, entry in zip(figure.subplots(1, len(fronts), squeeze=False)[0], fronts, strict=True):
        name, points = entry["cost"], [p for p in entry["points"] if p["rel_rmse"]["value"] and p[entry["cost"]]["value"]]
        for p in points:
            x, y = p[name], p["rel_rmse"]
            bars = [[[v["value"] - _end(v, 0)], [_end(v, 1) - v["value"]]] for v in (x, y)]
            colour = colours[p["technique"]]
            axes.errorbar(x["value"], 100 * y["value"], xerr=bars[0], yerr=100 * np.array(bars[1]), fmt="o", color=colour,
                          markerfacecolor=colour if p["on_front"] else "white", capsize=2, linewidth=1)  # fmt: skip
            own = ", ".join(f"{value:g}" for value in p["at"].values())
            axes.annotate(_plain(own), (x["value"], 100 * y["value"]), xytext=(4, 4), textcoords="offset points", fontsize=7,
                          color=colour)  # fmt: skip
        front = sorted((p[name]["value"], 100 * p["rel_rmse"]["value"]) for p in points if p["on_front"])
        if front:
            axes.step(*zip(*front, strict=True), where="post", color="0.4", linewidth=1.0, zorder=0)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.margins(0.16)
        axes.set_xlabel(COSTS[name])
        axes.set_ylabel("relative RMSE, root mean square over the plane [%]")
        axes.grid(color="0.9", linewidth=0.7, which="both")
        axes.set_axisbelow(True)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
    handles = [Patch(color=colour, label=_plain(technique)) for technique, colour in colours.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5), frameon=False, fontsize=8)
    return figure


def _end(metric: Mapping, which: int) -> float:
    end = metric["ci95"][which]
    return metric["value"] if end is None else end


def _colours(plane: Plane) -> dict[str, str]:
    """A colour a technique."""
    techniques = dict.fromkeys(c.technique for c in plane.contenders)
    return {t: style.SERIES[k % len(style.SERIES)] for k, t in enumerate(techniques)}


def _levels_of(plane: Plane) -> Float:
    values = np.concatenate([c.drawn[c.drawn > 0] for c in plane.contenders])
    return _levels(values) if len(values) else np.array([1e-4, 1e-3])


def _levels(values: Float) -> Float:
    """1, 2 and 5 × 10ⁿ that hold the values; of more than 14, every other."""
    low, high = math.floor(math.log10(values.min())), math.ceil(math.log10(values.max()))
    every = np.array([m * 10.0**n for n in range(max(low, -4), high + 1) for m in (1, 2, 5)])
    first, last = np.searchsorted(every, values.min(), "right") - 1, np.searchsorted(every, values.max())
    kept = every[max(first, 0) : last + 1]
    kept = kept if len(kept) > 1 else every[max(first - 1, 0) : last + 2]
    return kept[:: 1 + len(kept) // 15]


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _plain(text: str) -> str:
    """Text as it is, for matplotlib, to which $ begins a formula."""
    return text.replace("$", r"\$")


def _grown(mask: NDArray) -> NDArray:
    out = mask.copy()
    out[1:] |= mask[:-1]
    out[:-1] |= mask[1:]
    out[:, 1:] |= mask[:, :-1]
    out[:, :-1] |= mask[:, 1:]
    return out


def _scales(axes: Any, plane: Plane) -> None:
    for values, axis, scale in ((plane.xs, axes.xaxis, axes.set_xscale), (plane.ys, axes.yaxis, axes.set_yscale)):
        if logarithmic(values):
            scale("log")
        axis.set_ticks(values, labels=[f"{v:g}" for v in values])
        axis.set_ticks([], minor=True)
    axes.tick_params(labelsize=8)


def _dots(axes: Any, plane: Plane, known: NDArray[np.bool_], **look: Any) -> None:
    xs, ys = np.meshgrid(plane.xs, plane.ys)
    dot = {"marker": "o", "color": "white", "markeredgecolor": "k", "markersize": 3, "markeredgewidth": 0.6}
    if known.any():  # an unclipped line of no points has its box in the figure's corner, and breaks the layout
        axes.plot(xs[known], ys[known], linestyle="none", clip_on=False, **{**dot, **look})


def _save(figure: Any, directory: Path, name: str, title: str, alt: str, caption: str) -> Figure:
    import matplotlib

    folder = directory / "envelopes"
    with matplotlib.rc_context({"svg.hashsalt": name}):  # the same numbers make the same file
        for kind, metadata in (("svg", {"Title": title, "Date": None}), ("png", {"Title": title, "Software": None})):
            with replacing(folder / f"{name}.{kind}") as place:
                figure.savefig(place, format=kind, dpi=150, metadata=metadata)
    return Figure(f"envelopes/{name}.svg", title, alt, caption)
