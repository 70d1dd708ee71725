"""The bar that a terminal shows while a run goes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Column
from rich.text import Text

from evalsuite.pace import Pace
from evalsuite.settings import Progress as Told


class _PaceColumn(ProgressColumn):
    """Samples a second, and time left."""

    def __init__(self, pace: Pace) -> None:
        super().__init__(Column(no_wrap=True))
        self.pace = pace

    def render(self, task: object) -> Text:
        return Text(str(self.pace))


@contextmanager
def progress_bar(console: Console, total: int, budget_s: float | None = None) -> Iterator[Told]:
    """A bar over `total` cells, with samples a second and time left; warnings above it. budget_s: of the run."""
    pace = Pace(total, budget_s)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), _PaceColumn(pace))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=total)

        def step(text: str) -> None:
            bar.update(task, description=escape(f"{text[:70]:<70}"))

        def warn(text: str) -> None:
            bar.console.print(f"warning: {escape(text)}", style="yellow", highlight=False, soft_wrap=True)

        def cell(result: dict) -> None:
            bar.advance(task)
            pace.cell()
            if result["status"] in {"failed", "uncertified"}:
                warn(f"{result['id']}: {result['message']}")

        yield Told(cell=cell, step=step, warn=warn, samples=pace.samples, expect=pace.expect)
