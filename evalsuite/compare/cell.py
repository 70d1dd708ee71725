"""One cell's comparison, from its files: what a worker process runs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import chain, compare, decide
from evalsuite.compare.comparison import noisy_picture, noisy_reference
from evalsuite.compare.mask import whole_pixels
from evalsuite.compare.regions import Surfaces
from evalsuite.compare.statistics import Noisy
from evalsuite.compare.where import located
from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr
from evalsuite.image.color import luminance


def compare_cell(
    image_folder: str, reference_folder: str, coverage: NDArray[np.float32], surfaces: Surfaces | None = None
) -> dict:
    """Metrics and maps of an image entry against a reference entry of the store; with surfaces also where the error is.

    coverage: (H, W) fraction of each pixel that Mitsuba sees covered by any object; with the GPU's own `scored` it makes
    the object mask. Returns {"meta": …, "images": {name: array}}."""
    image_folder, reference_folder = Path(image_folder), Path(reference_folder)
    image = exr.read(image_folder / "image.exr")
    reference = exr.read(reference_folder / "reference.exr")
    standard_error = exr.read(reference_folder / "standard_error.exr")
    with np.load(reference_folder / "halves.npz") as halves:
        a, b, skew = halves["a"], halves["b"], halves["skew"]
    with np.load(image_folder / "scored.npz") as data:
        mask = whole_pixels(np.minimum(data["scored"], coverage))
    if not mask.any():
        raise EvalsuiteError(
            image_folder,
            "no pixel that a scored object covers whole",
            "an object in view",
            "move the camera or use a larger --size",
        )
    noise = image_folder / "standard_error.exr"
    own_noise = exr.read(noise).astype(np.float64) if noise.exists() else None
    result = compare(
        image,
        reference,
        standard_error=standard_error,
        halves=(a, b),
        mask=mask,
        image_standard_error=own_noise,
        skew=skew,
    )
    meta = result.to_json() | {
        "mask_pixels": int(mask.sum()),
        "mean_image": float(luminance(image)[mask].mean(dtype=np.float64)),
        "mean_reference": float(luminance(reference)[mask].mean(dtype=np.float64)),
    }
    maps = {
        "error": result.difference,
        "relative": result.relative,
        "zscore": result.zscore,
        "flip": result.flip_map,
        "mask": mask.astype(np.float32),
    }
    if surfaces is not None:
        spread = (a.astype(np.float64) - b) / 2
        truth = Noisy(reference.astype(np.float64), standard_error.astype(np.float64), spread, True, skew.astype(np.float64))
        picture = noisy_picture(image.astype(np.float64), own_noise, seed=1)
        found, maps["regions"] = located(picture, truth, mask, surfaces)
        meta |= found
    return {"meta": meta, "images": maps}


def split_cell(
    image_folder: str, reference_folders: list[str], coverage: NDArray[np.float32], lifted_folder: str | None = None
) -> dict:
    """The error of an image entry split along a chain: reference entries from full truth downwards, then, where there are any,
    the technique's pictures with ever fewer of its assumptions lifted, then the image. coverage: as for `compare_cell`.

    Returns {"meta": {"rungs", "total", "closure"}, "images": {"rung-<k>": difference}}. A rung whose assumption can also be
    given up in another order has its share there as "other_order"."""
    image_folder = Path(image_folder)
    with np.load(image_folder / "scored.npz") as data:
        mask = whole_pixels(np.minimum(data["scored"], coverage))
    image, noise = exr.read(image_folder / "image.exr"), image_folder / "standard_error.exr"
    own = noisy_picture(image.astype(np.float64), exr.read(noise).astype(np.float64) if noise.exists() else None, seed=1)[mask]
    means, steps = [], []
    for folder in map(Path, reference_folders):
        with np.load(folder / "halves.npz") as halves:
            noise_of = 0.5 * (halves["a"].astype(np.float64) - halves["b"])
        means.append(exr.read(folder / "reference.exr").astype(np.float64))
        sigma = exr.read(folder / "standard_error.exr")[mask].astype(np.float64)
        steps.append(chain.Step(means[-1][mask], sigma, noise_of[mask], True))
    drawn = chain.Step(own.mean, own.standard_error, own.noise, own.measured)
    rungs, swapped = len(steps), None
    if lifted_folder is not None:
        with np.load(Path(lifted_folder) / "lifted.npz") as lifted:
            pictures = list(zip(lifted["images"], lifted["tolerances"], strict=True))[::-1]
            # Formulas know scored surfaces alone: elsewhere the picture is its own.
            means += [np.where(mask[..., None], picture, image).astype(np.float64) for picture, _ in pictures]
            steps += [chain.Step.computed(picture[mask], float(tolerance)) for picture, tolerance in pictures]
            if "swapped" in lifted:
                swapped = chain.Step.computed(lifted["swapped"][mask], float(pictures[0][1]))
    found = chain.split([*steps, drawn])
    shares = [_rung(rung, found.total) for rung in found.rungs]
    if swapped is not None:
        # … exact lobe → exact lobe on the technique's own texels → its formula …
        other = chain.split([*steps[: rungs + 1], swapped, *steps[rungs + 2 :], drawn])
        shares[rungs + 1]["other_order"] = _rung(other.rungs[rungs], found.total)
        shares[rungs]["other_order"] = _rung(other.rungs[rungs + 1], found.total)
    means.append(image.astype(np.float64))
    images = {f"rung-{k}": (end - start).astype(np.float32) for k, (start, end) in enumerate(pairwise(means))}
    return {"meta": {"rungs": shares, "total": found.total, "closure": found.closure}, "images": images}


def _rung(rung: chain.Rung, total: float) -> dict:
    share = rung.share.to_json()
    ends = [end / total if total > 0 and end is not None else None for end in share["ci95"]]
    return {
        **share,
        "fraction": rung.fraction if total > 0 else None,
        "fraction_ci95": ends,
        "rel_rmse": rung.rel_rmse.to_json(),
        "rel_bias": rung.rel_bias.to_json(),
    }


def rank_cells(files: Mapping[str, Mapping[str, Path]], confidence: float) -> dict:
    """Order of cells that share a reference, from their files (id → name → EXR), over the pixels that all of them score.
    Returns {"order": ids, "pairs": […]}; see `decide.rank`."""

    def picture(cell: Mapping[str, Path], name: str) -> NDArray[np.float64] | None:
        return alike(exr.read(cell[name])).astype(np.float64) if name in cell else None

    one = next(iter(files.values()))
    alike = exr.coarsest([each["image"] for each in files.values()])
    mask = np.logical_and.reduce([picture(each, "mask")[..., 0] > 0.5 for each in files.values()])
    halves = one["reference"].parent / "halves.npz"  # beside the store's entry only
    measured = None
    if halves.exists():
        with np.load(halves) as data:
            measured = data["a"], data["b"]
    reference = noisy_reference(picture(one, "reference"), picture(one, "standard_error"), measured, [])
    pictures = {
        name: noisy_picture(picture(each, "image"), picture(each, "image_standard_error"), seed=1)[mask]
        for name, each in files.items()
    }
    pairs = decide.rank(pictures, reference[mask], confidence)
    return {"order": [pairs[0].better, *(pair.worse for pair in pairs)], "pairs": [pair.to_json() for pair in pairs]}
