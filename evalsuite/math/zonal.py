"""A lat-long map convolved with a lobe of revolution, through spherical harmonics, in float64.

Funk–Hecke: a kernel that depends on r·l alone multiplies band l of the map by one number λ_l. Only its tail is cut, where
λ_l is negligible; the map itself is integrated as the bilinear interpolant that `math.sphere.latlong_lookup` is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.sphere import direction_to_latlong

Float = NDArray[np.float64]


def phong_bands(exponent: float, degree: int) -> Float:
    """λ_l of the normalised Phong lobe (N + 1)/2π (r·l)₊^N for l = 0 … degree.

    λ_l = (N + 1) ∫₀¹ c^N P_l(c) dc; integrating the recurrence of P_l by parts,
    **λ₀ = 1, λ₁ = (N + 1)/(N + 2), λ_l = λ_{l−2} (N + 2 − l)/(N + 1 + l)**. N = 1 is the clamped cosine over π.
    """
    bands = np.ones(degree + 1)
    for l in range(1, degree + 1):  # noqa: E741
        bands[l] = (exponent + 1) / (exponent + 2) if l == 1 else bands[l - 2] * (exponent + 2 - l) / (exponent + 1 + l)
    return bands


def phong_degree(exponent: float, tail: float = 1e-8) -> int:
    """Degree beyond which λ_l ≈ exp(−l²/2(N + 1)) is below `tail`; at least 64, for the edge of small N at the horizon."""
    return max(64, int(np.ceil(np.sqrt(-2.0 * (exponent + 1.0) * np.log(tail)))))


def kernel_bands(kernel: Callable[[Float], Float], degree: int, nodes: int = 800) -> Float:
    """λ_l = 2π ∫₀¹ K(c) P_l(c) dc of kernels that end at the horizon, (degree + 1, C). kernel: cosines (P,) → (P, C)."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    cosine = 0.5 * (x + 1.0)
    return _polynomials(cosine, degree) @ (np.pi * w[:, None] * kernel(cosine))


def round_bands(kernel: Callable[[Float], Float], degree: int, nodes: int = 6000) -> Float:
    """λ_l = 2π ∫₀^π K(ψ) P_l(cos ψ) sin ψ dψ of a kernel over the angle ψ [rad], l = 0 … degree. Midpoint rule in √ψ, dense about
    the axis."""
    t = (np.arange(nodes) + 0.5) / nodes
    angle = np.pi * t * t
    return _polynomials(np.cos(angle), degree) @ (2.0 * np.pi * kernel(angle) * np.sin(angle) * 2.0 * np.pi * t / nodes)


def _polynomials(cosine: Float, degree: int) -> Float:
    """P_l, (degree + 1, P)."""
    values = [np.ones_like(cosine), cosine]
    for l in range(2, degree + 1):  # noqa: E741
        values.append(((2 * l - 1) * cosine * values[-1] - (l - 1) * values[-2]) / l)
    return np.array(values[: degree + 1])


def legendre(cosine: Float, sine: Float, degree: int) -> Iterator[Float]:
    """For m = 0 … degree the (degree − m + 1, P) values for l = m … degree of P̄_lm, normalised so that
    P̄_lm(cos θ) e^{imφ} is orthonormal on the sphere."""
    sectoral = np.full_like(cosine, np.sqrt(1.0 / (4.0 * np.pi)))
    for m in range(degree + 1):
        values = np.empty((degree - m + 1, len(cosine)))
        values[0] = sectoral
        if m < degree:
            values[1] = np.sqrt(2.0 * m + 3.0) * cosine * sectoral
        for l in range(m + 2, degree + 1):  # noqa: E741
            a = np.sqrt((4.0 * l * l - 1.0) / (l * l - m * m))
            b = np.sqrt(((l - 1.0) ** 2 - m * m) / (4.0 * (l - 1.0) ** 2 - 1.0))
            values[l - m] = a * (cosine * values[l - m - 1] - b * values[l - m - 2])
        yield values
        sectoral = -np.sqrt((2.0 * m + 3.0) / (2.0 * m + 2.0)) * sine * sectoral


def _rows(radiance: Float, degree: int) -> tuple[Float, Float, Float]:
    """Gauss–Legendre rows of the bilinear map: θ (R,), weights sin θ dθ (R,), radiance (R, W, C). Points in a cell of height δ
    follow degree · δ, the phase of the highest band across it."""
    if len(radiance) == 1:
        radiance = np.repeat(radiance, 2, axis=0)
    height = len(radiance)
    gauss = 4 + int(np.ceil(0.6 * degree * np.pi / (height - 1)))
    node, weight = np.polynomial.legendre.leggauss(gauss)
    fraction = 0.5 * (node + 1.0)
    delta = np.pi / (height - 1)
    theta = ((np.arange(height - 1)[:, None] + fraction) * delta).ravel()
    mixed = (1.0 - fraction)[:, None, None] * radiance[:-1, None] + fraction[:, None, None] * radiance[1:, None]
    weights = np.tile(0.5 * delta * weight, height - 1) * np.sin(theta)
    return theta, weights, mixed.reshape(-1, *radiance.shape[1:])


def _orders(radiance: Float, bands: Float, theta_out: Float) -> Iterator[tuple[NDArray[np.complex128], ...]]:
    """For m = 0 … degree the (T, C) amplitudes of e^{imφ} of ∫ L(l) K(r·l) dω on circles of latitude θ, in two parts that are
    added: symmetric about the equator and antisymmetric. bands of several kernels, (degree + 1, K), give (T, K C)."""
    bands = bands if bands.ndim == 2 else bands[:, None]
    degree, width = len(bands) - 1, radiance.shape[1]
    theta, weights, rows = _rows(radiance, degree)
    m = np.arange(degree + 1)
    # ∫ L e^{−imφ} dφ of a row: hats between texel centres (i + ½) 2π/W turn the discrete transform into sinc² times it.
    spectrum = np.fft.fft(rows, axis=1)[:, m % width] * (2.0 * np.pi / width)
    spectrum *= (np.sinc(m / width) ** 2 * np.exp(-1j * np.pi * m / width))[:, None]
    weighted = weights[:, None, None] * spectrum
    # P̄_lm(−x) = (−1)^{l+m} P̄_lm(x), and the rows lie in pairs about the equator: half of them do, one parity of l at a time.
    north = -(-len(theta) // 2)
    folded = [weighted[:north] + weighted[::-1][:north], weighted[:north] - weighted[::-1][:north]]
    if len(theta) % 2:
        folded[0][-1] *= 0.5  # its own mirror image
    both = zip(legendre(np.cos(theta[:north]), np.sin(theta[:north]), degree),
               legendre(np.cos(theta_out), np.sin(theta_out), degree), strict=True)  # fmt: skip
    nothing = np.zeros((len(theta_out), bands.shape[1] * radiance.shape[2]), np.complex128)
    for order, (analysis, synthesis) in enumerate(both):
        parts = [nothing, nothing]
        for parity in (0, 1):
            kernel = bands[order + parity :: 2]
            if kernel.any():  # of the clamped cosine every other band is 0
                coefficients = _times(analysis[parity::2], folded[parity][:, order])
                parts[parity] = _times(
                    synthesis[parity::2].T, (kernel[:, :, None] * coefficients[:, None]).reshape(len(kernel), -1)
                )
        yield tuple(parts)


def _times(real: Float, other: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """A real matrix times a complex one. NumPy's own `@` makes the real one complex first: four times the work, and a copy."""
    return (real @ np.ascontiguousarray(other).view(np.float64)).view(np.complex128)


def convolve(radiance: ArrayLike, bands: ArrayLike, directions: ArrayLike) -> Float:
    """∫ L(l) K(r·l) dω, (P, C). radiance: (H, W, C) lat-long; bands: λ_l of K, l = 0 …; directions: (P, 3) r, local frame."""
    radiance, bands = np.asarray(radiance, dtype=np.float64), np.asarray(bands, dtype=np.float64)
    u, v = direction_to_latlong(directions)
    phi = 2.0 * np.pi * u
    out = np.zeros((len(phi), radiance.shape[-1]))
    for order, (even, odd) in enumerate(_orders(radiance, bands, np.pi * v)):
        out += (1.0 if order == 0 else 2.0) * (np.exp(1j * order * phi)[:, None] * (even + odd)).real
    return out


def convolve_grid(radiance: ArrayLike, bands: ArrayLike, rows: int) -> Float:
    """The same at the nodes θ = jπ/(rows − 1), φ = 2πi/2(rows − 1) of a grid, poles included: (rows, 2(rows − 1), C), or with
    several kernels' bands (degree + 1, K) as (rows, 2(rows − 1), K C)."""
    radiance, bands = np.asarray(radiance, dtype=np.float64), np.asarray(bands, dtype=np.float64)
    theta, columns = np.linspace(0.0, np.pi, rows), 2 * (rows - 1)
    amplitudes = np.zeros((rows, columns, radiance.shape[-1] * bands[0].size), np.complex128)
    north, south = -(-rows // 2), rows // 2
    for order, (even, odd) in enumerate(_orders(radiance, bands, theta[:north])):
        twice = 1.0 if order == 0 else 2.0  # real part of the sum: aliases add up too
        amplitudes[:north, order % columns] += twice * (even + odd)
        amplitudes[north:, order % columns] += twice * (even - odd)[:south][::-1]
    return np.fft.ifft(amplitudes, axis=1).real * columns
