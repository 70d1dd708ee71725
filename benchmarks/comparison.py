"""Metrics and maps of a 1080p pair, beside the time that FLIP's own C++ takes for its two maps.

`evalsuite.compare` makes both FLIP maps (`flip`, `flip_hdr`) and all else: SSIM, ΔE, difference, relative error and metrics.
FLIP itself is the library from PyPI, called with the same pictures and the same exposures (four for this pair), in the same
process and with the same threads.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, zoom

import evalsuite
from benchmarks import timing
from benchmarks.figure import Figure, Limit
from evalsuite.api import Reference
from evalsuite.compare import perceptual
from evalsuite.image import exr
from evalsuite.image.color import tone_map
from evalsuite.scene import builtin

TITLE = "Metrics and maps of a 1080p pair"


def pair(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """A picture of a room with its full range of radiance, and the same slightly blurred: image, reference, (H, W, 3)."""
    radiance = exr.read(builtin.environment_path("office"))
    rows, columns = radiance.shape[:2]
    reference = np.maximum(zoom(radiance, (height / rows, width / columns, 1), order=1), 0.0).astype(np.float32)
    return gaussian_filter(reference, (2, 2, 0)), reference


def measure(quick: bool) -> list[Figure]:
    """Without noise; and with a reference whose noise is known, where every map is made thrice for the intervals."""
    size, rounds = ((270, 480), 3) if quick else ((1080, 1920), 3)
    image, reference = pair(*size)
    noise = 0.02 * reference * np.random.default_rng(0).standard_normal(reference.shape, np.float32)
    plus, minus, none = reference + noise, reference - noise, np.zeros_like(reference)
    noisy = Reference(reference, np.abs(noise), (plus, minus), none, np.ones(size, bool), 64, 0.02, False)
    what = "{1} × {0}".format(*size)
    return [
        _figure(f"{what}: `compare` over FLIP", image, reference, [reference], rounds),
        _figure(f"{what}, with intervals: `compare` over FLIP thrice", image, noisy, [reference, plus, minus], rounds),
    ]


def _figure(what: str, image: np.ndarray, reference: object, pairs: list[np.ndarray], rounds: int) -> Figure:
    """pairs: the pictures that the image is held against by FLIP."""
    runs = [_flip(image, each) for each in pairs]
    ours, theirs = timing.rounds_of(
        lambda: evalsuite.compare(image, reference), lambda: [run() for run in runs], rounds, warm_up=False
    )
    value, ci95 = timing.ratio(ours, theirs)
    beside = f"{timing.typical(ours)}; FLIP {timing.typical(theirs)}"
    return Figure(what, value, ci95, rounds, "×", Limit(2.0), beside)


def _flip(image: np.ndarray, reference: np.ndarray) -> timing.Step:
    """Both maps, at the exposures of `compare`."""
    view = perceptual.view_of(reference, np.ones(reference.shape[:2], bool))
    start, stop, count = view.flip_stops
    shown, truth = (np.ascontiguousarray(tone_map(p, view.exposure)) for p in (image, reference))
    exposures = {"startExposure": start, "stopExposure": stop, "numExposures": count}

    def run() -> None:
        plain = {"applyMagma": False, "computeMeanError": False}
        perceptual.flip_evaluator.evaluate(truth, shown, "LDR", **plain)
        perceptual.flip_evaluator.evaluate(reference, image, "HDR", **plain, parameters=exposures)

    return run
