"""Folders of two runs, of pictures whose distance to the truth is known by construction."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from evalsuite.compare import compare
from evalsuite.image import exr
from evalsuite.store.results import slug

SIZE = 48
NOISE = 0.02


def truth() -> np.ndarray:
    y, x = np.indices((SIZE, SIZE)) / SIZE
    return np.stack([0.4 + 0.4 * x, 0.5 + 0.2 * y, 0.6 - 0.2 * x], axis=-1)


def mask() -> np.ndarray:
    y, x = np.indices((SIZE, SIZE)) - (SIZE - 1) / 2
    return x**2 + y**2 < (0.45 * SIZE) ** 2


def reference(seed: int, noise: float = NOISE, mean: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """(R, its standard error): independent noise of that part of the mean in every value."""
    mean = truth() if mean is None else mean
    return mean + noise * mean * np.random.default_rng(seed).standard_normal(mean.shape), noise * mean


def picture(error: float) -> np.ndarray:
    """The truth times 1 + error on the left half, 1 − error on the right."""
    side = np.where(np.arange(SIZE) < SIZE / 2, 1.0, -1.0)
    return truth() * (1 + error * side[None, :, None])


def cell(directory: Path, identity: str, image: np.ndarray, of_reference: tuple[np.ndarray, np.ndarray], **other: object) -> dict:
    scene, technique, _, target = identity.rsplit("/", 3)
    mean, sigma = of_reference
    compared = compare(image, mean, sigma, mask=mask())
    folder = directory / "images" / slug(identity)
    files = {"image": image, "reference": mean, "standard_error": sigma, "mask": mask().astype(np.float32)}
    for name, array in files.items():
        exr.write(folder / f"{name}.exr", array)
    return compared.to_json() | {
        "id": identity, "scene": scene, "environment": "office", "technique": technique, "parameters": {"exponent": 10.0},
        "all_parameters": {"exponent": 10.0, "lod_offset": 0.0}, "target": target, "status": "scored", "message": "", "seed": 0,
        "target_error": 0.02, "cost": {"gpu_ms": 2.0}, "images": {n: f"images/{folder.name}/{n}.exr" for n in files},
        "mask_pixels": int(mask().sum()),
    } | other  # fmt: skip


def run(directory: Path, cells: list[dict], **header: object) -> Path:
    data = {
        "schema": "evalsuite.results/1",
        "title": "Two runs <script>window.pwned=1</script>",
        "created": "2025-01-01T12:00:00+00:00",
    } | header
    (directory / "results.json").write_text(json.dumps(data | {"cells": cells}), encoding="utf-8")
    return directory


def name(scene: str) -> str:
    return f"{scene}/glossy-mcguire/exponent=10/direct"


def pair(parent: Path) -> tuple[Path, Path]:
    """Runs A and B: `better` comes closer to the truth, `worse` goes further, in `noisy` noise hides which, `same` stays."""
    a, b = parent / "a", parent / "b"
    shared = {scene: reference(seed) for seed, scene in enumerate(("better", "worse", "noisy", "same"))}
    in_a = {"better": picture(0.10), "worse": picture(0.05), "noisy": picture(0.05), "same": picture(0.03)}
    # As far from the truth as before, elsewhere: which of the two noise prefers, is noise's.
    other = truth() * (1 - 0.05 * np.sign(np.arange(SIZE) - SIZE / 2 + 0.5)[:, None, None])
    in_b = {"better": picture(0.05), "worse": picture(0.10), "noisy": other, "same": picture(0.03)}
    cells_a = [cell(a, name(s), image, shared[s]) for s, image in in_a.items()]
    cells_b = [cell(b, name(s), image, shared[s]) for s, image in in_b.items()]
    cells_a.append(cell(a, name("gone"), picture(0.1), reference(9)))
    cells_b.append(cell(b, name("<script>window.pwned=1</script>"), picture(0.1), reference(9)))
    return run(a, cells_a, host={"git": "aaaa"}), run(b, cells_b, host={"git": "bbbb"})
