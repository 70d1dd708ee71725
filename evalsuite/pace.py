"""How fast a run goes and how long it has left, for the progress bar: samples a second, minutes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from evalsuite.forecast import in_minutes

#: Part of a forecast that counts as kept to from the start: while workers start nothing is done, which says little.
KEPT = 0.3


class Pace:
    """Told of cells and samples, from any thread. cells: to make. budget_s: what `--budget` allows. clock: [s]."""

    def __init__(self, cells: int, budget_s: float | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._cells, self._budget, self._clock, self._began = cells, budget_s, clock, clock()
        self._done, self._samples, self._rendering = 0, 0.0, 0.0
        self._foretold: tuple[float, float] | None = None
        self._lock = threading.Lock()

    def cell(self) -> None:
        with self._lock:
            self._done += 1

    def samples(self, count: float, seconds: float) -> None:
        """So many more samples were taken, over all pixels, in so many seconds of rendering."""
        with self._lock:
            self._samples, self._rendering = self._samples + count, self._rendering + seconds

    def expect(self, seconds: float, samples: float) -> None:
        """What a forecast says of the whole run."""
        self._foretold = seconds, samples

    @property
    def rate(self) -> float | None:
        """Samples a second of rendering; None before the first."""
        return self._samples / self._rendering if self._rendering > 0 else None

    @property
    def share(self) -> float:
        """What of the run is done: by cells, and where samples are foretold by both alike."""
        cells = self._done / max(self._cells, 1)
        expected = self._foretold[1] if self._foretold else 0.0
        return (cells + min(self._samples / expected, 1.0)) / 2 if expected else cells

    @property
    def left(self) -> float | None:
        """Seconds: of the budget, else of the forecast at the pace so far, else as the cells so far took; None before one."""
        passed, share = self._clock() - self._began, self.share
        if self._budget is not None:
            return max(self._budget - passed, 0.0)
        if self._foretold:
            whole = self._foretold[0]
            pace = (passed + KEPT * whole) / ((share + KEPT) * whole) if whole > 0 else 1.0
            return pace * whole * (1 - share)
        return passed * (1 - share) / share if share else None

    def __str__(self) -> str:
        rate = f"{self.rate / 1e6:.3g} Ms/s" if self.rate else ""
        left = "" if self.left is None else f"{in_minutes(self.left)} left"
        return ", ".join(filter(None, (rate, left)))
