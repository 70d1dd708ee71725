"""What a baseline keeps of a cell's pictures, in one EXR: the GPU picture as it was, over the object, and the truth in blocks.

With the old picture at hand, old and new are held against one reference, the new run's, whatever its seed: noise then moves both
errors alike (`compare.decide`). The truth itself need not be kept for that, only enough to see that it is the same: means over
blocks of BLOCK² pixels with their standard errors."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare.comparison import mean_square, noisy_picture
from evalsuite.compare.runs import another
from evalsuite.errors import EvalsuiteError
from evalsuite.gate.tolerance import DRIFT
from evalsuite.image import exr

#: Edge of a block over which the truth is averaged [pixels].
BLOCK = 8


@dataclass(frozen=True, eq=False)
class Record:
    """image: (H, W, 3) radiance, 0 off the object. mask: (H, W) bool. noise: standard error of a sampled picture, or None. truth,
    truth_error: (H/8, W/8, 3) mean of the reference over each block's pixels in the mask, and its standard error."""

    image: NDArray[np.float32]
    mask: NDArray[np.bool_]
    noise: NDArray[np.float32] | None
    truth: NDArray[np.float32]
    truth_error: NDArray[np.float32]

    @classmethod
    def of(cls, image: NDArray, mask: NDArray, noise: NDArray | None, reference: NDArray, standard_error: NDArray) -> Record:
        """The record of a cell's pictures, (H, W, 3) each; mask: (H, W) bool."""
        inside = mask[..., None]
        parts = [None if p is None else np.where(inside, p, 0).astype(np.float32) for p in (image, noise)]
        return cls(parts[0], mask, parts[1], *blocks(reference, standard_error, mask))

    @classmethod
    def read(cls, path: Path) -> Record:
        """Raises EvalsuiteError for a missing or damaged file."""
        parts = exr.read_parts(path)
        if not {"image", "mask", "truth", "truth_error"} <= set(parts):
            raise EvalsuiteError(path, f"parts {', '.join(parts)}", "a record of a blessed cell", "bless it again")
        shapes = {part.shape for name, part in parts.items() if name != "mask"}
        if shapes != {(*parts["mask"].shape, 3)}:
            raise EvalsuiteError(path, "parts of several sizes", "a record of a blessed cell", "bless it again")
        truth = (parts[name][::BLOCK, ::BLOCK] for name in ("truth", "truth_error"))
        return cls(parts["image"], parts["mask"] > 0.5, parts.get("noise"), *truth)

    def write(self, path: Path) -> None:
        parts = {"image": self.image, "mask": self.mask.astype(np.float32), "noise": self.noise}
        # All parts of a file have one size; repeated numbers take no room in it.
        height, width = self.mask.shape
        for name in ("truth", "truth_error"):
            parts[name] = getattr(self, name).repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)[:height, :width]
        exr.write(path, {name: part for name, part in parts.items() if part is not None})

    @property
    def digest(self) -> str:
        """SHA-256 (hex) of the picture over the object, the mask and the picture's own noise, as numbers in memory."""
        return picture_digest(self.image, self.mask, self.noise)

    def same_truth(self, reference: NDArray, standard_error: NDArray) -> bool:
        """Whether another reference is of the same truth as far as its noise and `DRIFT` can tell."""
        if reference.shape != self.image.shape:
            return False
        full = self.covered
        old = noisy_picture(self.truth.astype(np.float64), self.truth_error.astype(np.float64), 0)[full]
        mean, sigma = (part.astype(np.float64) for part in blocks(reference, standard_error, self.mask))
        new = noisy_picture(mean, sigma, 1)[full]
        allowed = DRIFT * np.abs(new.mean).mean()
        return mean_square(old, new).value <= allowed**2 or not another(old, new)

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(H/8, W/8): blocks that hold a pixel of the mask."""
        return _sums(self.mask[..., None].astype(np.float64))[..., 0] > 0


def picture_digest(image: NDArray, mask: NDArray[np.bool_], noise: NDArray | None) -> str:
    """SHA-256 (hex) of a picture over the object, bit for bit."""
    found = hashlib.sha256(np.packbits(mask).tobytes())
    for part in (image, noise):
        if part is not None:
            found.update(np.where(mask[..., None], part, 0).astype("<f4").tobytes())
    return found.hexdigest()


def reference_digest(reference: NDArray, standard_error: NDArray) -> str:
    """SHA-256 (hex) of a reference and its standard error, bit for bit."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(p, "<f4").tobytes() for p in (reference, standard_error))).hexdigest()


def blocks(mean: NDArray, sigma: NDArray, mask: NDArray[np.bool_]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(mean, standard error) over each block's pixels in the mask, 0 where it has none; pixels are independent."""
    inside = mask[..., None].astype(np.float64)
    count = np.maximum(_sums(inside), 1)
    sums = (_sums(np.where(inside > 0, p, 0.0)) for p in (mean.astype(np.float64), np.square(sigma.astype(np.float64))))
    total, variance = sums
    return (total / count).astype(np.float32), (np.sqrt(variance) / count).astype(np.float32)


def _sums(picture: NDArray) -> NDArray:
    rows, columns = _count(picture.shape[:2])
    padded = np.zeros((rows * BLOCK, columns * BLOCK, picture.shape[2]))
    padded[: picture.shape[0], : picture.shape[1]] = picture
    return padded.reshape(rows, BLOCK, columns, BLOCK, -1).sum((1, 3))


def _count(shape: tuple[int, ...]) -> tuple[int, int]:
    return -(-shape[0] // BLOCK), -(-shape[1] // BLOCK)
