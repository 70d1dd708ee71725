"""Hundreds of cells as a sweep leaves them: grainy pictures of 256², no two alike, three techniques a reference."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import synthetic_results as synthetic
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from evalsuite.image import exr
from evalsuite.store import results as store_results

SIZE, TECHNIQUES, RUNGS = 256, 3, 3
#: Of the rooms, in turn: with these a picture and its maps are as large as they are on average in the report `accuracy`.
GRAINS = (0.03, 0.1, 0.3, 1.0)
#: Standard error of the references [relative], and how much of it the channels share.
NOISE, SHARED = 0.015, 0.7


def texture(rng: np.random.Generator, grain: float) -> NDArray[np.float64]:
    """(SIZE, SIZE, 3) radiance of a room, muted colours. Neighbours differ by 4 % times the grain."""
    grey = sum(scale**2 * gaussian_filter(rng.standard_normal((SIZE, SIZE)), scale, mode="wrap") for scale in (4, 20))
    tint = np.stack([gaussian_filter(rng.standard_normal((SIZE, SIZE)), 3, mode="wrap") for _ in range(3)], -1)
    return 0.4 * np.exp(grain * (0.6 * (grey / grey.std())[..., None] + 0.03 * tint / tint.std()))


def write(directory: Path, store: Path, count: int = 300) -> dict:
    """Files as the store has them into `store`, and the run's folder; returns the results."""
    plain = synthetic.cell(store / "plain", "sphere", "glossy-mcguire", 10.0, seed=1)
    y, x = (np.indices((SIZE, SIZE)) - (SIZE - 1) / 2) / (0.44 * SIZE)
    mask = x**2 + y**2 < 1  # 61 % of the picture, as in the suite's own
    light = np.clip(0.5 * x - 0.6 * y + 0.62 * np.sqrt(np.clip(1 - x**2 - y**2, 0, 1)), 0, 1)
    regions = np.where(mask, np.round(8 * light), 0)
    made = []
    for k in range(count):
        rng = np.random.default_rng(k)
        group, number = divmod(k, TECHNIQUES)
        if number == 0:
            grain = GRAINS[group % len(GRAINS)]
            surface = (0.3 + light)[..., None] * gaussian_filter(texture(rng, grain), (3.0, 3.0, 0))
            truth = np.where(mask[..., None], surface, texture(rng, grain))
            sigma = NOISE * truth * np.exp(0.3 * rng.standard_normal((SIZE, SIZE, 1)))
            noise = SHARED * rng.standard_normal((SIZE, SIZE, 1)) + (1 - SHARED) * rng.standard_normal((SIZE, SIZE, 3))
            pictures = {"reference": truth + sigma * noise, "standard_error": sigma}
            shared = {name: _put(store / f"{group}-{name}.exr", picture) for name, picture in pictures.items()}
        wrong = 0.1 * np.stack([gaussian_filter(rng.standard_normal((SIZE, SIZE)), 6) * 6 for _ in range(RUNGS)])
        image = truth * (1 + np.where(mask, wrong.sum(0), 0.0))[..., None]
        error = image - pictures["reference"]
        own = {"image": image, "error": error, "mask": mask, "regions": regions, "relative": error, "zscore": mask,
               "flip": np.minimum(gaussian_filter(np.abs(error).mean(-1), 1) * 2, 1)}  # fmt: skip
        own |= {f"rung-{r}": (truth * wrong[r][..., None] if r else error) for r in range(RUNGS)}
        files = shared | {name: _put(store / f"{k}-{name}.exr", np.asarray(picture, float)) for name, picture in own.items()}
        identity = f"room-{group % 10}/technique-{number}/exponent={10 + k}/unoccluded"
        ledger = [
            {"rung": f"cause {r}", "from": "truth" if r == 0 else f"state {r}", "to": f"state {r + 1}", "fraction": 0.3,
             "fraction_ci95": [0.2, 0.4], "rel_rmse": {"value": 0.1, "ci95": [0.09, 0.11]},
             "rel_bias": {"value": 0.1, "ci95": [0.09, 0.11]}}
            for r in range(RUNGS)
        ]  # fmt: skip
        facts = {"id": identity, "scene": f"room-{group % 10}", "technique": f"technique-{number}", "exposure": 1.0}
        facts |= {"parameters": {"exponent": 10 + k}, "reference_id": f"{group:016x}", "ledger": ledger, "ledger_closure": 1e-9}
        made.append(({name: value for name, value in plain.items() if name != "images"} | facts, files))
    header = {"report": "many", "title": "Many cells", "created": "2025-01-01T12:00:00+00:00", "host": {}}
    return store_results.write(directory, json.loads(json.dumps(header)), made)


def _put(path: Path, picture: NDArray) -> Path:
    exr.write(path, picture)
    return path
