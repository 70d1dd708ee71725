"""A results folder as a run leaves it, made of synthetic pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from evalsuite.compare import compare, where
from evalsuite.compare.comparison import noisy_picture
from evalsuite.compare.regions import Surfaces
from evalsuite.compare.statistics import Noisy
from evalsuite.image import exr
from evalsuite.store.results import slug

HOSTILE = "<script>window.pwned=1</script>"


def cell_pages(directory: Path) -> str:
    """The HTML of all cells' pages."""
    return "\n".join(page.read_text(encoding="utf-8") for page in sorted((directory / "cells").glob("*.html")))


def pictures(size: int = 96, seed: int = 0):
    """A lit sphere over a dim background: (image, reference, standard error, halves, mask). The image is too bright on the
    left half of the sphere and too dark on the right."""
    rng = np.random.default_rng(seed)
    y, x = (np.indices((size, size)) - (size - 1) / 2) / (0.42 * size)
    mask = x**2 + y**2 < 1
    z = np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))
    shade = 0.15 + 0.85 * np.clip(0.5 * x - 0.6 * y + 0.62 * z, 0, 1)
    sky = 0.3 + 0.2 * gaussian_filter(rng.random((size, size)), 6, mode="wrap")
    mean = np.where(mask[..., None], shade[..., None] * [1.0, 0.75, 0.5], sky[..., None] * [0.7, 0.85, 1.0])
    error = np.where(mask, np.where(x < 0, 0.12, -0.12) * np.clip(1.2 - x**2 - y**2, 0, 1), 0.0)
    image = mean * (1 + error[..., None])
    sigma = 0.01 * mean
    a, b = (mean + np.sqrt(2) * sigma * rng.standard_normal((size, size, 1)) for _ in range(2))
    return image, (a + b) / 2, sigma, (a, b), mask


def located(image, reference, sigma, halves, mask):
    """Where the error is, on the sphere that the pictures show."""
    size = len(mask)
    y, x = (np.indices((size, size)) - (size - 1) / 2) / (0.42 * size)
    n = np.stack([x, -y, np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))], -1).astype(np.float32)
    seen = Surfaces(n, n, np.zeros((size, size), np.int32), np.array([0.0, 0.0, 1e6]), np.zeros((size, size), bool))
    truth = Noisy(reference, sigma, (halves[0] - halves[1]) / 2, measured=True)
    return where.located(noisy_picture(image, None, 1), truth, mask, seen)


def cell(directory: Path, scene: str, technique: str, exponent: float, status: str = "scored", seed: int = 0) -> dict:
    identity = f"{scene}/{technique}/exponent={exponent:g}/unoccluded"
    result = {
        "id": identity,
        "scene": scene,
        "environment": "office",
        "technique": technique,
        "parameters": {"env": "office", "exponent": exponent},
        "all_parameters": {"exponent": exponent, "specular_reflectance": [1.0, 1.0, 1.0]},
        "target": "unoccluded",
        "status": status,
        "message": "" if status == "scored" else f"no score: {status}",
        "certificate": {"passed": True, "coverage_iou": 0.99998, "normal_deg_p99": 0.0123, "depth_rel_p99": 1e-6,
                        "background_rel_p99": 3e-4, "reasons": []},
        "metrics": {},
        "cost": {},
        "images": {},
        "mapping": [{"material": "subject", "plugin": "blinnphong", "technique": technique, "text": "exponent s as it is"}],
        "notes": ["a note"],
        "warnings": [],
        "fit": None,
        "technique_info": {"title": "Glossy, MIP level from the exponent", "paper": "McGuire et al. 2013",
                           "equations": "m = log₂(w√3) − ½ log₂(s + 1)", "assumptions": ["The environment is distant."]},
        "reproduce": f"evalsuite run --scene '{scene}' -t {technique} -p exponent={exponent:g}",
        "target_error": 0.02, "reached_error": 0.0198, "seed": 0, "scene_file": f"scenes/{scene}.xml",
    }  # fmt: skip
    if status == "skipped":
        result["certificate"] = None
    if status not in ("scored", "uncertified"):
        return result
    image, reference, sigma, halves, mask = pictures(seed=seed)
    compared = compare(image, reference, sigma, halves, mask)
    maps = {"image": image, "reference": reference, "standard_error": sigma, "mask": mask}
    if status == "scored":
        maps |= {
            "error": compared.difference,
            "relative": compared.relative,
            "zscore": compared.zscore,
            "flip": compared.flip_map,
        }
        result |= compared.to_json() | {"notes": ["a note"], "mask_pixels": int(mask.sum())}
        where_it_is, numbers = located(image, reference, sigma, halves, mask)
        result |= where_it_is
        if seed == 1:  # one cell with the picture, the others with the least that a cell has
            maps["regions"] = numbers
        result["cost"] = {"gpu_ms": 12.5, "reference_s": 3.25, "reference_spp": 256, "cached": True}
    else:
        result["certificate"] |= {"passed": False, "reasons": ["coverage IoU is 0.98, limit 0.999"]}
    for name, array in maps.items():
        exr.write(directory / "images" / slug(identity) / f"{name}.exr", array)
        result["images"][name] = f"images/{slug(identity)}/{name}.exr"
    return result


def results(directory: Path) -> dict:
    """Seven cells: four scored, one of them with a hostile scene name, and one of each kind without scores."""
    cells = [
        cell(directory, "sphere", "glossy-mcguire", 10.0),
        cell(directory, "sphere", "glossy-mcguire", 100.0, seed=1),
        cell(directory, "torus", "glossy-boxmip", 50.0, seed=2),
        cell(directory, HOSTILE, "diffuse-sh9", 5.0, seed=3),
        cell(directory, "teapot", "mirror-cube", 7.0, "skipped"),
        cell(directory, "teapot", "brute-force", 8.0, "failed"),
        cell(directory, "organic", "diffuse-sh9", 9.0, "uncertified"),
    ]
    cells[3]["parameters"]["name"] = HOSTILE + "'\"&"
    cells[3]["notes"] = [HOSTILE]
    cells[5]["message"] = f"reference worker: got a dead process {HOSTILE}, expected a result"
    data = {
        "schema": "evalsuite.results/1",
        "report": "accuracy",
        "title": "Accuracy of environment-map lighting",
        "description": "What the GPU draws from an environment map, beside Mitsuba's integral of the same scene.",
        "created": "2025-01-01T12:00:00+00:00",
        "host": {"gl_renderer": "llvmpipe (LLVM 15.0.6, 256 bits)", "mitsuba": "3.9.1", "variant": "llvm_ad_rgb",
                 "drjit": "1.5.0", "llvm": "23.1.4", "cpu": "A processor, 2 cores", "git": "0123456789ab"},
        "cells": cells,
    }  # fmt: skip
    return json.loads(json.dumps(data, allow_nan=False))
