"""What a technique's drawing hands back: plain arrays and values, no OpenGL, picklable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Drawing:
    """image: (H, W, 3) float32 radiance, mean over the sub-sample grid. standard_error: (H, W, 3) float32 of image, for
    techniques that sample at random, else None. scored: (H, W) float32 fraction of sub-samples whose visible material the
    technique itself stands for (and the scene's subject names, where it names any). cost: gpu_ms (one frame: mean of the
    full-resolution passes; gpu_ms_ci95 its 95 % interval over them) and prepare_ms (once an environment). mapping: material,
    plugin, technique, text, parameters of each material drawn. parameters: as resolved. fit: a technique's own analysis, or
    None. notes: sentences for the page. probe: {"position", "faces": (6, w, w, 3)} of a map that was drawn within the scene's
    room, or None."""

    image: NDArray[np.float32]
    scored: NDArray[np.float32]
    standard_error: NDArray[np.float32] | None = None
    cost: Mapping[str, float | list[float]] = field(default_factory=dict)
    mapping: Sequence[Mapping[str, object]] = ()
    parameters: Mapping[str, object] = field(default_factory=dict)
    fit: Mapping[str, float] | None = None
    notes: tuple[str, ...] = ()
    probe: Mapping[str, object] | None = None
