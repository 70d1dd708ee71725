"""The summary table at the end of a run, for the terminal."""

from __future__ import annotations

from collections.abc import Mapping

from rich.markup import escape
from rich.table import Table
from rich.text import Text

from evalsuite.report.page import STATUS, interval, number

#: What the mark ≈ says.
INCONCLUSIVE = "≈ inconclusive: noise could change the order of this cell and a neighbour; `--until-decided` samples on"

_STYLES = {"failed": "red", "uncertified": "red", "skipped": "dim"}


def results_table(results: Mapping) -> Table:
    """One row a cell: scores with their 95 % intervals, or why there are none. Names are shown as they are, not as markup."""
    title = escape(str(results.get("title") or ""))
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="bold")
    table.caption_justify = "left"
    table.add_column("cell", overflow="fold", min_width=20)
    for name in ("rel_rmse", "95 %", "rel_bias", "FLIP", "SSIM"):
        table.add_column(name, justify="right", no_wrap=True)
    for cell in results.get("cells", []):
        metrics = cell.get("metrics") or {}
        status = cell.get("status", "")
        message = f"{STATUS.get(status, status)}: {cell['message']}" if cell.get("message") else STATUS.get(status, status)

        def value(name: str, unit: str = "", metrics: Mapping = metrics) -> Text:
            return Text(number(metrics[name]["value"], unit) if name in metrics else "")

        name = Text(str(cell.get("id", "")))
        if status != "scored":
            name.append(f"\n{message}", style=_STYLES.get(status, ""))
        error = value("rel_rmse", "%")
        if cell.get("decided") is False:
            error = Text("≈ ").append_text(error)
            table.caption = INCONCLUSIVE
        table.add_row(
            name,
            error,
            Text(interval(metrics.get("rel_rmse"), "%"), style="dim"),
            value("rel_bias", "%"),
            value("flip"),
            value("ssim"),
        )
    return table
