"""Maps of perceived difference: SSIM, ΔE*00 and FLIP of the tone-mapped pictures, HDR-FLIP of the linear ones."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from skimage.color import deltaE_ciede2000, rgb2lab
from skimage.metrics import structural_similarity

from evalsuite.compare.metrics import WHITE_PERCENTILE
from evalsuite.image.color import luminance, tone_map

# FLIP's OpenMP threads spin while they wait, which costs five times its run time where workers share the cores. Read once,
# when the library loads.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
import flip_evaluator

#: SSIM's window: Gaussian of σ = 1.5 pixels, cut at 3.5 σ (Wang et al. 2004), hence 11 × 11.
SSIM_WINDOW = 11
#: At most so many exposures of HDR-FLIP: each costs one LDR-FLIP.
MAX_EXPOSURES = 4

Map = NDArray[np.float32]


@dataclass(frozen=True)
class View:
    """How linear pictures are looked at. exposure: factor [1/radiance] before clamping and sRGB encoding.
    flip_stops: (start, stop, count) of HDR-FLIP's exposures, start and stop in stops (factor 2^stop)."""

    exposure: float
    flip_stops: tuple[float, float, int]


def view_of(reference: NDArray, mask: NDArray[np.bool_]) -> View:
    """Exposures from the reference's luminance inside the mask, so that image and halves are seen alike.

    exposure maps its 99th percentile to 1, rounded to a quarter stop so that noise does not move it from run to run.
    HDR-FLIP's range follows Andersson et al. 2021, §3.2: from the stop at which the brightest luminance reaches 0.85 after
    the ACES curve to the stop at which the median does; the 99th percentile stands for the brightest (one firefly must not
    decide), and the count is clamped. FLIP's own automatic choice is never used: for a reference of zeros it ends the
    process.
    """
    return view_between(*anchors(luminance(reference[mask])))


class Anchors(NamedTuple):
    """Luminances that exposures follow from. white: the 99th percentile, or the largest where that is 0; median: of what is
    lit; both 0 where nothing is."""

    white: float
    median: float


def anchors(luminance: NDArray) -> Anchors:
    """Those of luminances of any shape."""
    y = np.maximum(luminance, 0.0)
    lit = y[y > 0]
    if not lit.size:
        return Anchors(0.0, 0.0)
    white = float(np.percentile(y, WHITE_PERCENTILE)) or float(lit.max())
    return Anchors(white, min(float(np.median(lit)), white))


def view_between(white: float, median: float) -> View:
    """The view of a picture with these `anchors`."""
    if not white > 0:
        return View(1.0, (0.0, 0.0, 2))
    start, stop = (_quarter(math.log2(_ACES_INVERSE / v)) for v in (white, median))
    # A count of 1 makes the library return zeros.
    return View(2.0 ** _quarter(-math.log2(white)), (start, stop, min(max(math.ceil(stop - start), 2), MAX_EXPOSURES)))


def maps(image: NDArray, reference: NDArray, view: View) -> dict[str, Map]:
    """(H, W) maps `ssim` (mean of the channels, 1 = alike), `delta_e2000`, `flip`, `flip_hdr` ([0, 1], 0 = alike)."""
    shown, truth = tone_map(image, view.exposure), tone_map(reference, view.exposure)
    return {
        "ssim": _ssim(shown, truth),
        "delta_e2000": deltaE_ciede2000(rgb2lab(truth), rgb2lab(shown)).astype(np.float32),
        "flip": _flip(truth, shown, "LDR", {}),
        "flip_hdr": _flip(_hdr(reference), _hdr(image), "HDR", dict(zip(_STOPS, view.flip_stops, strict=True))),
    }


def _quarter(stops: float) -> float:
    return round(4 * stops) / 4


_STOPS = ("startExposure", "stopExposure", "numExposures")


def _ssim(image: Map, reference: Map) -> Map:
    height, width = image.shape[:2]
    pad = [(0, max(0, SSIM_WINDOW - height)), (0, max(0, SSIM_WINDOW - width)), (0, 0)]
    _, full = structural_similarity(
        np.pad(image, pad, mode="edge"), np.pad(reference, pad, mode="edge"), channel_axis=2, data_range=1.0,
        gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True,
    )  # fmt: skip
    return full[:height, :width].mean(axis=2)


def _flip(reference: Map, image: Map, dynamic_range: str, parameters: dict[str, float]) -> Map:
    error, _, _ = flip_evaluator.evaluate(
        np.ascontiguousarray(reference), np.ascontiguousarray(image), dynamic_range,
        applyMagma=False, computeMeanError=False, parameters=parameters,
    )  # fmt: skip
    # A single bright pixel may overflow inside the library (Inf − Inf): such a pixel counts as the largest error.
    return np.nan_to_num(np.asarray(error, np.float32)[..., 0], nan=1.0, posinf=1.0)


def _hdr(linear: NDArray) -> Map:
    """Nonnegative and within half-float range: FLIP's colour transform overflows for Inf and is undefined below 0."""
    return np.clip(np.asarray(linear, np.float32), 0.0, 65504.0)


def _inverse_aces(target: float) -> float:
    """The x at which FLIP's ACES curve (Narkowicz's fit, input scaled by 0.6) x (a x + b) / (x (c x + d) + e) = target."""
    a, b, c, d, e = 0.6**2 * 2.51, 0.6 * 0.03, 0.6**2 * 2.43, 0.6 * 0.59, 0.14
    qa, qb, qc = a - target * c, b - target * d, -target * e
    return (-qb + math.sqrt(qb * qb - 4 * qa * qc)) / (2 * qa)


_ACES_INVERSE = _inverse_aces(0.85)
