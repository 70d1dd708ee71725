"""The pictures of a run's folder: rounded to what is known of them and written once, however many cells share them. The store
has them to the last bit."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.image import exr
from evalsuite.image.rounding import BITS, MOST, bits_for, significant, stepped
from evalsuite.store.cache import file_digest

#: Changes when pictures are kept in another way: a file with another stamp is written anew.
VERSION = 2
#: Pictures that all cells of a reference share.
SHARED = ("reference", "standard_error", "spp")
#: (image − reference) / (reference + ε) and |error| in standard errors follow from the others.
LEFT_OUT = ("relative", "zscore")
_RUNG, _TRUTH = re.compile(r"rung-\d+"), re.compile(r"target-.+")

Array = NDArray[np.float32]


def rounded(name: str, picture: Array, mask: Array | None = None, bits: int = MOST, sigma: Array | None = None) -> Array:
    """A picture as it is kept. picture: (H, W, 3) or (H, W). mask: (H, W), 1 where the object is scored, for differences. bits:
    of radiance (`rounding.bits_for`). sigma: (H, W, 3), the reference's standard error, for the error.

    Radiance to about a 32nd of the reference's standard error, but to 2⁻¹⁵, relative, where that is more; standard errors,
    which are estimates themselves, to 3 %; the error to 3 % or a quarter of a standard error; the ledger's rungs, means over the
    channels, to a 64th of their 99th percentile; both differences are 0 outside the mask. FLIP to 1/512."""
    if name in ("standard_error", "image_standard_error"):
        return significant(picture, 4)
    if name == "error":
        inside = picture if mask is None else np.where(mask[..., None] > 0.5, picture, 0.0)
        return significant(inside if sigma is None else stepped(inside, sigma / 2), 4)
    if name == "flip":
        return stepped(picture, 1 / 256)
    if _RUNG.fullmatch(name):
        mean = _mean(picture)
        inside = mean if mask is None else mean[mask > 0.5]
        top = float(np.percentile(np.abs(inside), 99)) if inside.size else 0.0
        return stepped(mean if mask is None else np.where(mask > 0.5, mean, 0.0), top / 32)
    return significant(picture, bits)


def paths(cell: Mapping, files: Mapping[str, Path], folder: str) -> dict[str, str]:
    """name → path of each kept picture, relative to the run's folder. folder: the cell's own, a file name."""
    found = {name: f"images/{folder}/{name}.exr" for name in files if name not in LEFT_OUT}
    if "reference" in files:
        stated = str(cell.get("reference_id") or "")
        key = stated if re.fullmatch(r"[0-9a-f]{16}", stated) else file_digest(files["reference"])[:16]
        found |= {name: f"images/references/{key}/{name}.exr" for name in SHARED if name in files}
    if "environment" in files:
        found["environment"] = f"images/environments/{cell['environment_id']}/environment.exr"
    # Other truths of the ledger: the references of other cells, as often as not.
    truths = {f"target-{name}": key for name, key in (cell.get("truths") or {}).items()}
    return found | {name: f"images/references/{key}/reference.exr" for name, key in truths.items() if name in files}


def write(directory: Path, cells: Sequence[tuple[Mapping[str, str], Mapping[str, Path]]], ours: bool = True) -> None:
    """Write the pictures of all cells, each given by its `paths` and files; unchanged ones stay, others are removed where the
    folder is known to be ours. Raises OSError and EvalsuiteError."""
    tasks: dict[str, Callable[[], None]] = {}
    for places, files in cells:
        for name, place in places.items():
            tasks.setdefault(place, _task(name, files, directory / place))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in [pool.submit(task) for task in tasks.values()]:
            done.result()
    if ours:
        _sweep(directory / "images", {directory / place for place in tasks})


def _task(name: str, files: Mapping[str, Path], target: Path) -> Callable[[], None]:
    def run() -> None:
        source = files[name]
        if target.exists() and source.samefile(target):
            return
        # One nanosecond a version beside the source's time: enough to tell, with no file beside the file.
        stamp = source.stat().st_mtime_ns + VERSION
        if target.exists() and target.stat().st_mtime_ns == stamp:
            return
        mask = _read(files["mask"]) if (name == "error" or _RUNG.fullmatch(name)) and "mask" in files else None
        radiance = name in ("image", "reference") or _TRUTH.fullmatch(name)
        # Another truth is another cell's reference, with its own noise beside it in the store.
        its_own = {"reference": source, "standard_error": source.with_name("standard_error.exr")}
        bits = _bits(its_own if _TRUTH.fullmatch(name) else files) if radiance else MOST
        sigma = _read(files["standard_error"]) if name == "error" and "standard_error" in files else None
        picture = rounded(name, _read(source), mask, bits, sigma)
        header = {BITS: bits} if radiance else {}
        exr.write(target, picture, header, compression="HALF" if _fits_half(picture) else "PXR24")
        os.utime(target, ns=(stamp, stamp))

    return run


def _bits(files: Mapping[str, Path]) -> int:
    known = all(name in files and files[name].exists() for name in ("reference", "standard_error"))
    return bits_for(_read(files["reference"]), _read(files["standard_error"])) if known else MOST


def _sweep(images: Path, keep: set[Path]) -> None:
    folders = {path.parent for path in keep}
    shared = (*images.glob("references/*"), *images.glob("environments/*"))
    for folder in (*images.iterdir(), *shared) if images.is_dir() else ():
        if folder in folders:
            for path in folder.iterdir():
                if path.suffix == ".exr" and path not in keep:
                    path.unlink()
        elif re.fullmatch(r".*-[0-9a-f]{8}|[0-9a-f]{16}", folder.name):
            shutil.rmtree(folder)


def _read(path: Path) -> Array:
    return next(iter(exr.read_parts(path).values()))


def _fits_half(picture: Array) -> bool:
    """Whether half floats have the digits of every pixel; those of radiance they do not."""
    with np.errstate(over="ignore"):
        off = np.abs(picture.astype(np.float16) - picture)
    return bool(np.all(off <= 1e-5 * np.abs(picture)))


def _mean(picture: Array) -> Array:
    return picture.mean(axis=2) if picture.ndim == 3 else picture
