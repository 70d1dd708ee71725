"""The split sum's BRDF table as a texture: `uniform sampler2D brdf_table`, read at (n·v, √α), gives (A, B) in .rg.

F₀ A + B is the GGX albedo under Schlick's Fresnel: math.microfacet.split_sum_table, which says how it is normalised.
"""

from __future__ import annotations

from functools import lru_cache

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from evalsuite.math import microfacet

#: Texels over n·v and over √α, centres at (i + ½)/size: within 1.3·10⁻³ of the integral where n·v ≥ 0.02 and α ≥ 0.05.
WIDTH, HEIGHT = 64, 32


@lru_cache(maxsize=1)
def values() -> NDArray[np.float64]:
    """(HEIGHT, WIDTH, 2) float64, row √α, column n·v. Takes a good half second, once a process."""
    roughness, cosine = (np.arange(HEIGHT) + 0.5) / HEIGHT, (np.arange(WIDTH) + 0.5) / WIDTH
    return microfacet.split_sum_table(roughness**2, cosine)


def lookup(cosine: ArrayLike, alpha: ArrayLike) -> NDArray[np.float64]:
    """(..., 2) = (A, B) as the texture unit reads them: bilinear, clamped to the outermost texel centres."""
    table = values()
    x = np.clip(np.asarray(cosine, np.float64) * WIDTH - 0.5, 0, WIDTH - 1)
    y = np.clip(np.sqrt(np.asarray(alpha, np.float64)) * HEIGHT - 0.5, 0, HEIGHT - 1)
    i, j = np.minimum(x.astype(int), WIDTH - 2), np.minimum(y.astype(int), HEIGHT - 2)
    p, q = (x - i)[..., None], (y - j)[..., None]
    return (1 - q) * ((1 - p) * table[j, i] + p * table[j, i + 1]) + q * ((1 - p) * table[j + 1, i] + p * table[j + 1, i + 1])


@lru_cache(maxsize=1)
def texture() -> moderngl.Texture:
    """The table on the GPU, two float32 channels, made once."""
    from evalsuite.gpu import context

    made = context.get().texture((WIDTH, HEIGHT), 2, values().astype(np.float32).tobytes(), dtype="f4")
    made.filter = (moderngl.LINEAR, moderngl.LINEAR)
    made.repeat_x = made.repeat_y = False
    return made
