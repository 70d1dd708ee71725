"""Scores of regions, and curves over an angle: the metrics of `compare`, on parts of the object.

Pictures of perceived difference (SSIM, FLIP, ΔE) are left out: their filters look up to 10 pixels across a region's border, and
their exposure is the whole picture's. So are the extremes, which say where one pixel is and not how a region fares.

A region that the reference's own noise helped to choose would be scored too bright: a highlight's pixels are chosen by one half
of the reference and held against the other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import regions, statistics
from evalsuite.compare.blob import largest_blob
from evalsuite.compare.comparison import mean_square, pixelwise
from evalsuite.compare.regions import Mask, Surfaces, face_angles
from evalsuite.compare.statistics import Metric, Noisy
from evalsuite.image.color import luminance

#: Farthest that a direction is from its cube face's centre: a corner, acos(1/√3) = 54.74°.
FARTHEST_DEG = math.degrees(math.acos(1.0 / math.sqrt(3.0)))
FACE_ANGLE_EDGES = (*np.arange(0.0, 54.0, 5.0).tolist(), FARTHEST_DEG)
N_DOT_V_EDGES = tuple(k / 10 for k in range(11))


def located(picture: Noisy, truth: Noisy, inside: Mask, surfaces: Surfaces) -> tuple[dict[str, object], NDArray[np.float32]]:
    """`regions`, `curves`, `blob` (None where there is none) and `looked_up` (n or r, see `regions`) of results.json, and the
    picture of the regions. picture, truth: (H, W, 3) linear; inside: (H, W) the object mask."""
    found = regions.masks(surfaces, inside, luminance(truth.plus))
    difference = luminance(picture.mean) - luminance(truth.mean)
    sigma = luminance(np.hypot(picture.standard_error, truth.standard_error))  # channels taken as fully correlated
    blob, outline = largest_blob(difference, sigma, inside, float(luminance(truth.mean)[inside].mean())) or (None, None)
    meta = {
        "regions": scores(picture, truth, inside, found),
        "curves": curves(picture, truth, inside, surfaces),
        "blob": blob,
        "looked_up": looked_up_at(surfaces, inside),
    }
    return meta, regions.picture(found, outline, inside.shape)


def scores(picture: Noisy, truth: Noisy, inside: Mask, found: Mapping[str, Mask]) -> dict[str, dict[str, object]]:
    """Region → {"pixels", "share": of the mask's squared error, "metrics": {name: {"value", "ci95"}}}, each metric over the
    region's own pixels and its own mean reference. found: regions within the mask, the highlight chosen by half A."""
    picture, truth = picture[inside], truth[inside]
    other = _second_half(truth)
    whole = {id(reference): mean_square(picture, reference) for reference in (truth, other)}
    scored = {}
    for name, region in found.items():
        against = other if name == "highlight" else truth
        here = np.flatnonzero(region[inside])
        metrics = pixelwise(picture[here], against[here])
        scored[name] = {
            "pixels": len(here),
            "share": _share(metrics["mse"], whole[id(against)], len(here) / len(picture.mean)).to_json(),
            "metrics": {metric: value.to_json() for metric, value in metrics.items()},
        }
    return scored


def curves(picture: Noisy, truth: Noisy, inside: Mask, surfaces: Surfaces) -> dict[str, dict[str, object]]:
    """`n_dot_v` [cosine] and, where a map of directions is looked up, `face_angle` [degrees]: the angle between the direction
    looked up and its cube face's centre. Each {"unit", "bins": [{"edges", "pixels", "rel_rmse", "rel_bias"}]}, a bin's errors
    over the bin's own mean reference; empty bins are left out. Normals that face away (n·v < 0) count in the first bin."""
    found = {}
    directions = surfaces.looked_up
    if directions is not None:
        angle = face_angles(directions)[0]
        found["face_angle"] = {"unit": "degrees", "bins": _bins(picture, truth, inside, angle, FACE_ANGLE_EDGES)}
    found["n_dot_v"] = {"unit": "cosine", "bins": _bins(picture, truth, inside, surfaces.n_dot_v, N_DOT_V_EDGES)}
    return found


def looked_up_at(surfaces: Surfaces, inside: Mask) -> str | None:
    """Which direction the regions of cube faces are those of, in words."""
    if surfaces.about_normal is None:
        return None
    about = surfaces.about_normal[inside]
    return "n" if about.all() else "r" if not about.any() else "n on diffuse materials, r on others"


def _bins(picture: Noisy, truth: Noisy, inside: Mask, values: NDArray, edges: Sequence[float]) -> list[dict[str, object]]:
    number = np.clip(np.searchsorted(edges, values[inside], side="right") - 1, 0, len(edges) - 2)
    picture, truth = picture[inside], truth[inside]
    bins = []
    for k in range(len(edges) - 1):
        here = np.flatnonzero(number == k)
        if len(here):
            a, b = picture[here], truth[here]
            bins.append(
                {
                    "edges": [edges[k], edges[k + 1]],
                    "pixels": len(here),
                    "rel_rmse": statistics.relative_root(a, b).to_json(),
                    "rel_bias": statistics.relative_bias(a, b).to_json(),
                }
            )
    return bins


def _share(here: Metric, whole: Metric, part: float) -> Metric:
    """here × part / whole, in [0, 1], from the ends of both: as the whole holds the part and moves with it, more than 95 %."""

    def of(a: float, b: float) -> float:
        return min(a * part / b, 1.0) if b > 0 else float(a > 0)

    return Metric(of(here.value, whole.value), (of(here.ci95[0], whole.ci95[1]), of(here.ci95[1], whole.ci95[0])))


def _second_half(truth: Noisy) -> Noisy:
    """Half B (N, 3) as a reference of its own: √2 times the standard error, noise of drawn signs."""
    sigma = math.sqrt(2.0) * truth.standard_error
    signs = np.random.default_rng(3).integers(0, 2, len(sigma)) * 2.0 - 1.0
    return Noisy(truth.minus, sigma, sigma * signs[..., None])
