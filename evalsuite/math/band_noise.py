"""Random fields of one spherical-harmonic degree: environments whose frequency is a number, in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.math.sphere import latlong_solid_angles
from evalsuite.math.zonal import legendre

Float = NDArray[np.float64]

#: Root mean square of L − 1: as much as keeps all maps positive (the lowest texel of the 64 is 0.009).
CONTRAST = 0.2
#: Rows of the lat-long map per degree. A texel is then 1/32 of the shortest wave, and bilinear look-ups lose 0.3 % of it.
ROWS_PER_DEGREE = 16
SMALLEST_MAP = 64
LARGEST_DEGREE = 64
_SEED = 20


def band_noise(degree: int) -> Float:
    """Radiance L = 1 + κ g(ω), (H, 2H) lat-long [W m⁻² sr⁻¹], g of degree ℓ alone, κ = `CONTRAST`.

    g = Σ_m a_m Y_ℓm with independent normal a_m, the same in every call: an isotropic Gaussian field of wavelength 360°/ℓ. Over
    the sphere (`math.sphere`'s exact weights) g has mean 0 and mean square 1, so that of the maps of all degrees only the
    frequency differs. A lobe of revolution with coefficients λ_ℓ turns L into **1 + κ λ_ℓ g**.
    Raises ValueError for a degree outside 1 … `LARGEST_DEGREE`.
    """
    if not 1 <= degree <= LARGEST_DEGREE:
        raise ValueError(degree)
    height = max(SMALLEST_MAP, ROWS_PER_DEGREE * degree)
    theta = np.arange(height) * np.pi / (height - 1)
    phi = (np.arange(2 * height) + 0.5) * np.pi / height
    generator = np.random.default_rng([_SEED, degree])
    field = np.zeros((height, 2 * height))
    for m, values in enumerate(legendre(np.cos(theta), np.sin(theta), degree)):
        a, b = generator.standard_normal(2)
        wave = a * np.cos(m * phi) + b * np.sin(m * phi) if m else np.full_like(phi, a / np.sqrt(2.0))
        field += values[-1][:, None] * wave
    weight = latlong_solid_angles(*field.shape) / (4.0 * np.pi)
    field -= (weight * field).sum()
    return 1.0 + CONTRAST * field / np.sqrt((weight * field**2).sum())
