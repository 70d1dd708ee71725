"""What a whole run shares, and who is told of its progress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from evalsuite.plan import QUALITY

#: Sub-samples per pixel axis on the GPU: edge-pixel coverage within 0.036 rms of Mitsuba's box filter (4×4).
SUPERSAMPLE = 4


@dataclass(frozen=True)
class Settings:
    """What a whole run shares. target_error, cap: relative standard error and samples per pixel at which a reference
    stops. size: (width, height) or None for the scene's own. worst_error: relative standard error of the worst pixel, for
    which each takes as many samples as it needs; None: all pixels take the same."""

    target_error: float = QUALITY["draft"][0]
    cap: int = QUALITY["draft"][1]
    size: tuple[int, int] | None = None
    seed: int = 0
    repair_environment: bool = False
    supersample: int = SUPERSAMPLE
    ledger: bool = True
    worst_error: float | None = None


@dataclass
class Progress:
    """Told what goes on; `cli` draws it. Every field is a function that may be called from several threads."""

    cell: Callable[[dict], None] = lambda cell: None
    step: Callable[[str], None] = lambda text: None
    warn: Callable[[str], None] = lambda text: None
    #: So many more samples of a reference, over all pixels, in so many seconds.
    samples: Callable[[float, float], None] = lambda count, seconds: None
    #: So many seconds and samples are foretold for the run.
    expect: Callable[[float, float], None] = lambda seconds, samples: None
