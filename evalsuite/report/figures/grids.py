"""Figures of pictures in rows and columns, with crops and captions: described once, drawn by matplotlib (PNG, PDF) and by
figuregen (LaTeX, HTML)."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.report.figures import style
from evalsuite.report.latex import escape
from evalsuite.report.scales import Scale

#: Of crops, in turn, on the picture and around the enlargement.
CROPS = ((230, 80, 30), (0, 114, 178), (0, 158, 115))
Box = tuple[int, int, int, int]


@dataclass(frozen=True)
class Panel:
    """pixels: (H, W, 3) uint8 sRGB. caption: beneath it. marks: boxes (x, y, width, height) [pixels] drawn on it, each with the
    colour of its number; frame: the number of the crop that this is."""

    pixels: NDArray[np.uint8]
    caption: str = ""
    marks: Sequence[Box] = ()
    frame: int | None = None

    def crop(self, box: Box, number: int, caption: str = "") -> Panel:
        """The part in the box, enlarged by whole factors to about the picture's own height."""
        x, y, width, height = box
        part = self.pixels[y : y + height, x : x + width]
        factor = max(1, round(self.pixels.shape[0] / height))
        return Panel(part.repeat(factor, 0).repeat(factor, 1), caption, frame=number)

    def marked(self, *boxes: Box) -> Panel:
        return replace(self, marks=boxes)


@dataclass(frozen=True)
class Block:
    """rows: of panels of one size; None leaves a place empty."""

    rows: Sequence[Sequence[Panel | None]]
    title: str = ""
    columns: Sequence[str] = ()
    names: Sequence[str] = ()  # of the rows


@dataclass(frozen=True)
class Grid:
    """blocks: side by side, or one below another where `stacked`. note: beneath all. scale: of error maps."""

    blocks: Sequence[Block]
    stacked: bool = False
    note: str = ""
    scale: Scale | None = None
    width: float = 7.0  # [inches] on paper


def draw(grid: Grid) -> Any:
    """A matplotlib Figure."""
    sizes = [_size(block) for block in grid.blocks]
    across = sum(width for width, _ in sizes) if not grid.stacked else max(width for width, _ in sizes)
    scale = grid.width / across
    tall = scale * (sum(h for _, h in sizes) if grid.stacked else max(h for _, h in sizes))
    lines = 1 + len(grid.note) // int(17 * grid.width)
    foot = 0.14 * lines + 0.1 if grid.note else 0.0
    bar = 0.45 if grid.scale else 0.0
    figure = style.figure(grid.width, tall + foot + bar)
    figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02, wspace=0.01, hspace=0.01)
    ratios = [h if grid.stacked else w for w, h in sizes]
    heights = [tall, *([bar] if bar else []), *([foot] if foot else [])]
    parts = np.atleast_1d(figure.subfigures(len(heights), 1, height_ratios=heights))
    shape = {"height_ratios": ratios} if grid.stacked else {"width_ratios": ratios}
    places = np.atleast_1d(parts[0].subfigures(*((len(sizes), 1) if grid.stacked else (1, len(sizes))), **shape))
    for place, block in zip(places, grid.blocks, strict=True):
        _draw_block(place, block, scale)
    if grid.scale:
        _draw_scale(parts[1], grid.scale)
    if grid.note:
        parts[-1].text(0.01, 0.95, wrapped(grid.note, int(17 * grid.width)), fontsize=6.5, va="top", color="0.25")
    return figure


def _size(block: Block) -> tuple[float, float]:
    """Width and height in panels, with room for words."""
    columns = max(len(row) for row in block.rows)
    panel = next(p for row in block.rows for p in row if p is not None)
    ratio = panel.pixels.shape[0] / panel.pixels.shape[1]
    rows = sum(ratio * (1.16 if any(p and p.caption for p in row) else 1.0) for row in block.rows)
    return columns + (0.16 if block.names else 0.0), rows + (0.18 if block.title else 0.0) + (0.14 if block.columns else 0.0)


def _fitting(text: str, inches: float, points: float) -> float:
    """Size [points] at which a line fits into a width: at most `points`; letters are 0.56 of their size wide in the mean."""
    return min(points, 72 * inches / (0.56 * max(len(text), 1)))


def _draw_block(place: Any, block: Block, inches: float) -> None:
    """inches: width of a panel."""
    from matplotlib.patches import Rectangle

    columns = max(len(row) for row in block.rows)
    axes = place.subplots(len(block.rows), columns, squeeze=False)
    if block.title:
        place.suptitle(block.title, fontsize=8.5, fontweight="bold")
    for i, row in enumerate(block.rows):
        for j in range(columns):
            one, panel = axes[i, j], row[j] if j < len(row) else None
            one.set_xticks([])
            one.set_yticks([])
            if panel is None:
                one.set_axis_off()
                continue
            one.imshow(panel.pixels, interpolation="nearest" if panel.frame is not None else "antialiased")
            for spine in one.spines.values():
                spine.set_visible(panel.frame is not None)
                if panel.frame is not None:
                    spine.set(color=_rgb(panel.frame), linewidth=1.6)
            for number, (x, y, width, height) in enumerate(panel.marks):
                one.add_patch(Rectangle((x - 0.5, y - 0.5), width, height, fill=False, edgecolor=_rgb(number), linewidth=1.0))
            if panel.caption:
                size = _fitting(panel.caption, inches, 5.2)
                one.set_xlabel(panel.caption.replace("$", r"\$"), fontsize=size, labelpad=2)
            if i == 0 and j < len(block.columns):
                one.set_title(block.columns[j], fontsize=_fitting(block.columns[j], inches, 7.5), pad=3)
            if j == 0 and i < len(block.names):
                one.set_ylabel(block.names[i], fontsize=7.5, labelpad=3)


def _draw_scale(place: Any, scale: Scale) -> None:
    axes = place.add_axes((0.3, 0.55, 0.4, 0.25))
    values = np.linspace(scale.low, scale.high, 256)[None]
    axes.imshow(scale.colours(values), aspect="auto", extent=(scale.low, scale.high, 0, 1))
    axes.set_yticks([])
    axes.set_xticks([v for v, _ in scale.ticks], labels=[text for _, text in scale.ticks], fontsize=6)
    axes.tick_params(length=2, pad=1)
    axes.set_xlabel(scale.caption, fontsize=6.5, labelpad=1)


def _rgb(number: int) -> tuple[float, ...]:
    return tuple(c / 255 for c in CROPS[number % len(CROPS)])


def wrapped(text: str, width: int) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text, width))


def write(grid: Grid, place: Path) -> None:
    """LaTeX (a tikzpicture to be \\input; needs calc, graphicx and tikz) or HTML (one file), by the suffix. Raises OSError."""
    import figuregen

    latex = place.suffix == ".tex"
    words = escape if latex else html.escape
    made = [_figuregen(block, words) for block in grid.blocks]
    rows = [[one] for one in made] if grid.stacked else [made]
    backend = figuregen.TikzBackend() if latex else figuregen.HtmlBackend(custom_head='<meta charset="utf-8">')
    figuregen.figure(rows, 2.54 * grid.width, str(place), backend)
    note = words_of(grid)
    if note:
        text = place.read_text(encoding="utf-8")
        if latex:
            text = "".join(f"% {part}\n" for part in wrapped(note, 100).splitlines()) + text
        else:
            text = text.replace(
                "</body>",
                f"<p style='font: 9pt sans-serif; max-width: {25.4 * grid.width:.0f}mm'>{html.escape(note)}</p>\n</body>",
            )
        place.write_text(text, encoding="utf-8")


def _figuregen(block: Block, words: Any) -> Any:
    import figuregen

    columns = max(len(row) for row in block.rows)
    grid = figuregen.Grid(len(block.rows), columns)
    blank = next(p for row in block.rows for p in row if p is not None)
    layout = grid.layout
    layout.set_padding(top=0.6, column=0.6, row=0.6, right=1.0)
    fields = [(layout.titles["north"], block.title, 4.5, 8), (layout.column_titles["north"], block.columns, 3.6, 7),
              (layout.row_titles["west"], block.names, 3.6, 7),
              (layout.captions["south"], any(p and p.caption for row in block.rows for p in row), 3.2, 4.8)]  # fmt: skip
    for place, there, millimetres, points in fields:
        if there:
            place.size, place.offset, place.fontsize = millimetres, 0.3, points
    if block.title:
        grid.set_title("top", words(block.title))
    if block.columns:
        grid.set_col_titles("top", [words(text) for text in block.columns])
    if block.names:
        grid.set_row_titles("left", [words(text) for text in block.names])
    for i, row in enumerate(block.rows):
        for j in range(columns):
            panel = row[j] if j < len(row) else None
            element = grid.get_element(i, j)
            if panel is None:
                element.set_image(figuregen.PNG(np.ones(blank.pixels.shape, np.float32)))
                continue
            element.set_image(figuregen.PNG(panel.pixels.astype(np.float32) / 255)).set_caption(words(panel.caption))
            if panel.frame is not None:
                element.set_frame(1.2, list(CROPS[panel.frame % len(CROPS)]))
            for number, (x, y, width, height) in enumerate(panel.marks):
                element.set_marker(pos=(x, y), size=(width, height), color=list(CROPS[number % len(CROPS)]), linewidth_pt=1.0)
    return grid


def words_of(grid: Grid) -> str:
    """What stands beneath: the note, and the scale in words."""
    return " ".join(filter(None, [grid.note, _scale_words(grid.scale)]))


def _scale_words(scale: Scale | None) -> str:
    return f"Error maps: {scale.caption}, {scale.ticks[0][1]} blue to {scale.ticks[-1][1]} red." if scale else ""
