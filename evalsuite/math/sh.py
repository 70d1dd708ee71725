"""Real spherical harmonics to degree 2 and the diffuse convolution (Kautz, Daubert, Seidel Eq 9–12), in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math.cubemap import texel_directions, texel_solid_angles

Float = NDArray[np.float64]

# Eq 12: the clamped cosine's coefficient of each basis function: Â = π, 2π/3 (×3), π/4 (×5).
COSINE_LOBE = np.array([np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5)


def basis(directions: ArrayLike) -> Float:
    """Y_i at unit directions (..., 3), returned (..., 9). Eq 9:

    Y₀ = √(1/4π); Y₁,₂,₃ = √(3/4π)(y, z, x); Y₄,₅,₇ = √(15/4π)(xy, yz, xz); Y₆ = √(5/16π)(3z² − 1); Y₈ = √(15/16π)(x² − y²).
    """
    x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    one, two = np.sqrt(3 / (4 * np.pi)), np.sqrt(15 / (4 * np.pi))
    return np.stack([
        np.full_like(x, np.sqrt(1 / (4 * np.pi))),
        one * y, one * z, one * x,
        two * x * y, two * y * z, np.sqrt(5 / (16 * np.pi)) * (3 * z * z - 1), two * x * z, 0.5 * two * (x * x - y * y),
    ], axis=-1)  # fmt: skip


def project_cube(level: ArrayLike) -> Float:
    """L_i = ∫ L Y_i dω (Eq 11), (9, C): texel radiance × Y at the texel's centre × its exact solid angle. level: (6, w, w, C)."""
    level = np.asarray(level, dtype=np.float64)
    width = level.shape[1]
    weighted = basis(texel_directions(width)) * texel_solid_angles(width)[None, :, :, None]
    return weighted.reshape(-1, 9).T @ level.reshape(-1, level.shape[-1])


def irradiance(coefficients: ArrayLike, normals: ArrayLike) -> Float:
    """E(n) = Σ Â_i L_i Y_i(n), (..., C) [W m⁻²], E and not E/π. coefficients: (9, C) L_i; normals: (..., 3) unit."""
    return basis(normals) @ (COSINE_LOBE[:, None] * np.asarray(coefficients, dtype=np.float64))
