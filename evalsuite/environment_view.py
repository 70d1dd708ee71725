"""What a cell's page shows of its environment: the map made small, and the area lights that a technique takes out of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu.techniques.base import Technique
from evalsuite.image import exr
from evalsuite.lights import decompose
from evalsuite.lights.description import described
from evalsuite.lights.model import DecompositionSettings
from evalsuite.plan import DISCS
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import digest, source_digest

if TYPE_CHECKING:
    from evalsuite.steps import Steps

#: Largest width of the small map [texels].
WIDTH = 256


def view(
    steps: Steps, source: SceneSource, technique: Technique, target: str, parameters: Mapping[str, object]
) -> tuple[Path | None, dict]:
    """(environment.exr, {"environment_id": of its content, "lights": as in lights.json, found with the technique's own settings;
    empty where neither it nor the target takes the map apart}); no file for one radiance everywhere. Raises EvalsuiteError."""
    source = replace(source, bindings={})
    apart = target in DISCS or {p.name for p in technique.parameters} & {f.name for f in fields(DecompositionSettings)}
    settings = DecompositionSettings.of(parameters) if apart else None
    key = digest([steps.fingerprint(source), settings, source_digest("environment_view.py", "lights", "math/sphere.py")])

    def make() -> tuple[Path, dict]:
        environment = steps.model(source).environment
        if environment is None or environment.radiance.shape[:2] == (1, 1):
            return steps.store.put("environment", key, {"environment_id": None, "lights": []})
        steps.progress.step(f"the environment of {source.path.stem}")
        lights = described(decompose.of(environment, settings)) if settings else []
        small = reduced(environment.radiance)
        meta = {"environment_id": digest([small])[:16], "lights": lights}
        return steps.store.put("environment", key, meta, lambda folder: exr.write(folder / "environment.exr", small))

    folder, meta, _ = steps.once("environment", key, make)
    return folder / "environment.exr" if meta["environment_id"] else None, meta


def reduced(radiance: NDArray[np.float32], width: int = WIDTH) -> NDArray[np.float32]:
    """Means of square blocks of a lat-long map (H, W, 3), as many texels each as leave it no wider than `width`; what is left
    over at the right and the bottom goes."""
    k = -(-radiance.shape[1] // width)
    height, across = (max(size // k, 1) for size in radiance.shape[:2])
    blocks = radiance[: height * k, : across * k].astype(np.float64)
    return blocks.reshape(height, -1, across, blocks.shape[1] // across, 3).mean(axis=(1, 3)).astype(np.float32)
