"""The summary table at the end of a run, for the terminal."""

from __future__ import annotations

from collections.abc import Mapping

from rich.markup import escape
from rich.table import Table
from rich.text import Text

from evalsuite.report.page import STATUS, interval, number

_STYLES = {"scored": "green", "failed": "red", "uncertified": "red", "skipped": "dim"}


def results_table(results: Mapping) -> Table:
    """One row a cell: scores with their 95 % intervals, or why there are none. Names are shown as they are, not as markup."""
    title = escape(str(results.get("title") or ""))
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="bold")
    for name in ("scene", "technique", "parameters", "target"):
        table.add_column(name, overflow="fold")
    for name in ("rel_rmse", "95 %", "rel_bias", "FLIP", "SSIM", "spp"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("status", overflow="fold")
    for cell in results.get("cells", []):
        metrics, parameters = cell.get("metrics") or {}, cell.get("parameters") or {}
        status = cell.get("status", "")
        message = f"{STATUS.get(status, status)}: {cell['message']}" if cell.get("message") else STATUS.get(status, status)

        def value(name: str, unit: str = "", metrics: Mapping = metrics) -> Text:
            return Text(number(metrics[name]["value"], unit) if name in metrics else "")

        table.add_row(
            Text(str(cell.get("scene", ""))),
            Text(str(cell.get("technique", ""))),
            Text(" ".join(f"{k}={v:g}" if isinstance(v, float) else f"{k}={v}" for k, v in parameters.items())),
            Text(str(cell.get("target", ""))),
            value("rel_rmse", "%"),
            Text(interval(metrics.get("rel_rmse"), "%"), style="dim"),
            value("rel_bias", "%"),
            value("flip"),
            value("ssim"),
            Text(str((cell.get("cost") or {}).get("reference_spp", ""))),
            Text(message, style=_STYLES.get(status, "")),
        )
    return table
