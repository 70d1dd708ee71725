"""Phong prefiltering of dual paraboloid maps with two small kernels (Kautz, Vázquez, Heidrich, Seidel 2000; Heidrich, course
notes §3.2.5), in float64.

A circle on the sphere is almost a circle in a paraboloid map, twice as wide on the rim as at the centre. Two maps, filtered with
the centre's kernel (S) and the rim's (L), are blended by (1 − d²) S + d² L, d the distance from the centre. A kernel that is
wider than the hardware's largest filters a MIP level instead, and the result is magnified.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math import paraboloid
from evalsuite.math.disc_map import bilinear, centres

Float = NDArray[np.float64]

SMALL, LARGE = 0, 1


def cut_angle(exponent: float, cutoff: float) -> float:
    """θ_c [rad] at which cos^N falls to the cut-off: **acos(cutoff^(1/N))**."""
    return float(np.arccos(cutoff ** (1.0 / exponent)))


def radius(which: int, exponent: float, cutoff: float) -> float:
    """Kernel radius in the map, 1 being the circle's.

    A point θ from the map's axis lies at tan(θ/2). The circle of θ_c about the centre: **r_S = tan(θ_c/2)**; from the rim, at
    θ = π/2, inwards: **r_L = 1 − tan(π/4 − θ_c/2)**. Their ratio goes to 1 : 2 for small lobes only.
    """
    half = 0.5 * cut_angle(exponent, cutoff)
    return float(np.tan(half) if which == SMALL else 1.0 - np.tan(0.25 * np.pi - half))


def filter_size(kernel_radius: float, circle: float) -> int:
    """Texels across a kernel in a map whose circle has a radius of `circle` texels: **2 ⌈R r⌉**, the notes' table."""
    return 2 * int(np.ceil(circle * kernel_radius))


def shrink_level(size: int, taps: int) -> int:
    """MIP level k at which the filter fits: the smallest with **size / 2^k ≤ taps**. The notes' "<" means >."""
    return max(0, int(np.ceil(np.log2(size / taps))))


def filter_level(which: int, exponent: float, cutoff: float, circle: float, taps: int, size: int) -> int:
    """MIP level of S or L in a map of size² texels, of which it keeps at least 8 × 8."""
    return min(shrink_level(filter_size(radius(which, exponent, cutoff), circle), taps), size.bit_length() - 4)


def kernel(which: int, exponent: float, cutoff: float, circle: float) -> Float:
    """(2h + 1, 2h + 1) weights that sum to 1: the lobe cos^N θ(ρ) sampled at texel centres, 0 beyond its radius.

    circle: radius of the map's circle in texels of the level filtered. At the centre θ = **2 atan ρ**, at the rim, inwards,
    **π/2 − 2 atan(1 − ρ)**. What the cut-off leaves out is made up for by the sum.
    """
    r = radius(which, exponent, cutoff)
    h = int(np.floor(r * circle))
    offset = np.arange(-h, h + 1) / circle
    rho = np.hypot(offset[None, :], offset[:, None])
    theta = 2.0 * np.arctan(rho) if which == SMALL else 0.5 * np.pi - 2.0 * np.arctan(1.0 - rho)
    weights = np.where(rho <= r, np.maximum(np.cos(np.minimum(theta, 0.5 * np.pi)), 0.0) ** exponent, 0.0)
    return weights / weights.sum()


def filtered(levels: list[Float], border: float, which: int, exponent: float, cutoff: float, taps: int) -> tuple[Float, int]:
    """S or L, (2, n/2^k, n/2^k, C), and its MIP level k. levels: solid-angle-weighted chain (2, n, n, C) …; beyond the map's edge
    its last texels are repeated."""
    size = levels[0].shape[1]
    circle = 0.5 * size - border
    level = filter_level(which, exponent, cutoff, circle, taps, size)
    weights = kernel(which, exponent, cutoff, circle / 2.0**level)
    h = len(weights) // 2
    padded = np.pad(levels[level], ((0, 0), (h, h), (h, h), (0, 0)), mode="edge")
    from scipy.signal import fftconvolve  # here: importing it costs a second, which listings should not pay

    return fftconvolve(padded, weights[None, :, :, None], mode="valid", axes=(1, 2)), level


def magnified(coarse: Float, size: int) -> Float:
    """(2, n, n, C) by bilinear interpolation, clamped to the edge."""
    at = (np.arange(size) + 0.5) * coarse.shape[1] / size
    y, x = np.meshgrid(at, at, indexing="ij")
    return np.stack([bilinear(one, x, y) for one in coarse])


def prefilter(levels: list[Float], border: float, exponent: float, cutoff: float, taps: int) -> Float:
    """The prefiltered maps, (2, n, n, C): **(1 − d²) S + d² L**, d = |(x, y)|, held at 1 beyond the rim."""
    size = levels[0].shape[1]
    small, large = (magnified(filtered(levels, border, which, exponent, cutoff, taps)[0], size) for which in (SMALL, LARGE))
    c = centres(size, border)
    d2 = np.minimum(c[None, :] ** 2 + c[:, None] ** 2, 1.0)[None, ..., None]
    return (1.0 - d2) * small + d2 * large


def look_up(maps: ArrayLike, border: float, directions: ArrayLike) -> Float:
    """Bilinear radiance (..., C) at directions (..., 3) in the map's frame, in the map that r_z chooses."""
    return paraboloid.DualParaboloid([maps], border).bilinear(directions)


def errors(
    lookup: paraboloid.Lookup, truth: Float, directions: Float, exponent: float, size: int, spacing: float
) -> dict[str, float]:
    """How far the method is from the lobe, and through which of its limits: each an RMS over directions and channels, relative
    to the mean of `truth` (P, C), the unclipped lobe integral at `directions` (P, 3).

    blend: kernels of full size and resolution, cut at 10⁻⁴ only, off the truth: what one shape for all places, blended by d²,
    costs. cutoff: the change by cutting at 0.1. kernel: the change by filtering with 7 × 7 texels of a MIP level. total: cut and
    in 7 × 7, off the truth; never more than the sum of the three. Borders are a quarter of the map, which no kernel overruns.
    lookup: radiance (..., C) at directions (..., 3); size: of the maps; spacing: of the source's texels [rad].
    """
    border = size / 4.0
    k = paraboloid.subsamples_per_texel(size, border, spacing)
    levels = paraboloid.weighted_mips(paraboloid.resample(lookup, size, border, k), border)

    def picture(cutoff: float, taps: int) -> Float:
        return look_up(prefilter(levels, border, exponent, cutoff, taps), border, directions)

    def rms(difference: Float) -> float:
        return float(np.sqrt(np.square(difference).mean()) / truth.mean())

    full, cut, published = picture(1e-4, size), picture(0.1, size), picture(0.1, 7)
    return {
        "blend": rms(full - truth), "cutoff": rms(cut - full), "kernel": rms(published - cut), "total": rms(published - truth)
    }  # fmt: skip
