"""A cubemap's MIP chain filtered across faces and weighted by solid angle (Heidrich, course notes §2.4; the remedy for Kautz et
al., Fig 4), in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.cubemap import AXIS, S, T, direction_to_face, integral, texel_solid_angles
from evalsuite.math.phong import exponent_to_lod, lod_to_exponent

Float = NDArray[np.float64]

#: Weights of the four finer texels along each axis: a 2 × 2 box never leaves its face, this mask reaches one texel beyond.
MASK = np.array([1.0, 3.0, 3.0, 1.0])
#: Applied again and again the mask is Chaikin's: texels become quadratic B-splines, three texels wide with a peak of (3/4)² per
#: texel. Integral over peak, the measure by which exponents are matched to levels, is hence 16/9 texels: log₂ 4/3 levels more.
WIDER = float(np.log2(4.0 / 3.0))


def seamless_mips(level0: ArrayLike) -> list[Float]:
    """Levels (6, w, w, C) … (6, 1, 1, C). level0: (6, w, w, C), w = 2^n.

    **L'(i, j) = Σ m_k m_l ω L / Σ m_k m_l ω** over the 4 × 4 finer texels about texel (i, j), m = 1, 3, 3, 1, ω their solid
    angle; beyond an edge they are the neighbouring face's, and the one that is missing at a corner of the cube has no weight.
    """
    levels = [np.asarray(level0, dtype=np.float64)]
    while levels[-1].shape[1] > 1:
        levels.append(_halve(levels[-1]))
    return levels


def _halve(finer: Float) -> Float:
    width = finer.shape[1]
    across = np.arange(-1, width + 1)
    a = (2.0 * across + 1.0) / width - 1.0
    directions = AXIS[:, None, None] + a[None, None, :, None] * S[:, None, None] + a[None, :, None, None] * T[:, None, None]
    face, s, t = direction_to_face(directions)
    # Half a texel outside an edge a direction falls on the neighbour's first row, less than half a texel along it.
    row, column = (np.minimum((x * width).astype(int), width - 1) for x in (t, s))
    weight = texel_solid_angles(width)[row, column]
    outside = (across < 0) | (across >= width)
    weight = np.where(outside[:, None] & outside[None, :], 0.0, weight)
    padded = np.concatenate([finer[face, row, column] * weight[..., None], weight[..., None]], axis=-1)
    rows = sum(m * padded[:, k : k + width : 2] for k, m in enumerate(MASK))
    both = sum(m * rows[:, :, k : k + width : 2] for k, m in enumerate(MASK))
    return both[..., :-1] / both[..., -1:]


def exponent_to_seamless_lod(exponent: ArrayLike, face_width: float) -> Float:
    """Level of this chain whose texels have the lobe's solid angle: `phong.exponent_to_lod` − log₂ 4/3. Not clamped."""
    return exponent_to_lod(exponent, face_width) - WIDER


def seamless_lod_to_exponent(lod: ArrayLike, face_width: float) -> Float:
    """Inverse of `exponent_to_seamless_lod`, held at 0."""
    return lod_to_exponent(np.asarray(lod, np.float64) + WIDER, face_width)


def mean_radiance(level0: ArrayLike) -> Float:
    """(C,) mean over the sphere [W m⁻² sr⁻¹]: the level after the last. A texel that takes four faces would be larger than
    the sphere."""
    return integral(level0) / (4.0 * np.pi)
