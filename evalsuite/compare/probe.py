"""A cubemap drawn by a probe against the true radiance at its place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import cubemap, sh


def compare_faces(faces: NDArray, truth: NDArray, standard_error: NDArray) -> dict[str, float | list[float]]:
    """Errors relative to the sphere's mean radiance, all (6, w, w, 3) with texels weighted by solid angle.

    rel_rmse: of the texels, less what the truth's own noise explains; rel_rmse_faces: the same of each face; rel_bias: mean of
    faces − truth; rel_rmse_irradiance: of E(n) from nine harmonics over all normals, which is what a diffuse object sees."""
    faces, truth, noise = (np.asarray(x, np.float64) for x in (faces, truth, standard_error))
    width = faces.shape[1]
    weight = cubemap.texel_solid_angles(width)[None, :, :, None] / (4.0 * np.pi)
    mean = float((truth * weight).sum() / 3.0)
    squares = ((faces - truth) ** 2 - noise**2) * weight
    per_face = squares.sum(axis=(1, 2, 3)) * 6.0 / 3.0
    normals = cubemap.texel_directions(8).reshape(-1, 3)
    e, e_true = (sh.irradiance(sh.project_cube(x), normals) for x in (faces, truth))
    return {
        "rel_rmse": _root(per_face.mean()) / mean,
        "rel_rmse_faces": [_root(x) / mean for x in per_face],
        "rel_bias": float(((faces - truth) * weight).sum() / 3.0) / mean,
        "rel_rmse_irradiance": float(np.sqrt(((e - e_true) ** 2).mean()) / e_true.mean()),
        "standard_error": float((noise * weight).sum() / 3.0) / mean,
    }


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))
