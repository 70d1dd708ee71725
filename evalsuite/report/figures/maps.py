"""Environment maps that a figure is about: the paper's own where they are given, else what stands in for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Map:
    """role: as `--env ROLE=FILE` names it. called: what the paper has, in words. environment: the built-in that stands in for it,
    or the file given."""

    role: str
    called: str
    environment: str
    stand_in: bool

    @property
    def title(self) -> str:
        return f"{self.called}: {self.environment}" if self.stand_in else self.called

    @property
    def label(self) -> str:
        """What cells have for it."""
        return self.environment if self.stand_in else Path(self.environment).name

    def radiance(self) -> NDArray[np.float32]:
        """(H, W, 3) lat-long [W m⁻² sr⁻¹]. Raises EvalsuiteError for a file that is no map."""
        from evalsuite.scene import builtin
        from evalsuite.scene.environment import read_environment

        return read_environment(builtin.environment_path(self.environment)).radiance


def stand_ins(maps: Sequence[Map]) -> str:
    """What stands in for what, as a sentence; empty where nothing does."""
    replaced = "; ".join(f"{one.environment} for {one.called}" for one in maps if one.stand_in)
    return f"Stand-ins: {replaced}." if replaced else ""
