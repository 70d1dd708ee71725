"""What m(s) errs by over maps, places and exponents (McGuire et al. 2013, Eq 12), in float64.

Maps are turned at random before they become faces, so that what stands at a face's centre or corner is chance. The truths are
`headroom_mcguire`'s: the lobe of Eq 13 about h, brought to albedo 1 in each pixel so that width and shape alone count (what its
albedo costs is the claim about constant maps), and the lobe cos^s about r that the paper's derivation has in mind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from evalsuite.compare.regions import CENTRE_DEG, CORNER_DEG, GRAZING, face_angles
from evalsuite.math import cubemap, phong, sh
from evalsuite.report.figures import headroom_mcguire, sphere_view

Float = NDArray[np.float64]

BUILT_IN = ("office", "cathedral", "chapel", "basilica", "coloured-cube", "overcast", "sunsky", "sh2")
#: Noise of one degree and of one contrast: varying at the lowest frequencies alone, and flat there.
LOW_BANDS, FLAT_BANDS = ("band-1", "band-2"), ("band-4", "band-8", "band-16")
MAPS = BUILT_IN + LOW_BANDS + FLAT_BANDS
EXPONENTS = (5, 20, 80, 320)
TURNS, FACE, PICTURE, PIXELS = 5, 64, 128, 250
OFFSETS = np.linspace(-2.0, 3.0, 21)
LOBES = ("h, albedo 1", "r")
PLACES = ("centre", "corner", "anywhere")


@dataclass(frozen=True, eq=False)
class Errors:
    """Axes: map, turn, exponent. error: by lobe and place, RMSE over the mean truth. best: by lobe, c of least error. low:
    (map,), standard deviation of degrees 1 and 2 of the radiance over its mean."""

    error: Mapping[tuple[str, str], Float]
    best: Mapping[str, Float]
    low: Float


@lru_cache(maxsize=1)
def errors() -> Errors:
    """Of all maps, turns, exponents and lobes, on the scene `sphere` where n·v > 0.3."""
    normal, to_view, hit = sphere_view.rays(PICTURE)
    hit &= (normal * to_view).sum(-1) > GRAZING
    centre, _, corner = face_angles(phong.reflect(to_view, normal))
    masks = dict(zip(PLACES, (hit & (centre < CENTRE_DEG), hit & (corner < CORNER_DEG), hit), strict=True))
    chosen = {place: sphere_view.some(mask, PIXELS * (1 + (place == "anywhere"))) for place, mask in masks.items()}
    ends = np.cumsum([0, *(len(c) for c in chosen.values())])
    part = {place: slice(a, b) for place, a, b in zip(PLACES, ends, ends[1:], strict=False)}
    n, v = (x.reshape(-1, 3)[np.concatenate(list(chosen.values()))] for x in (normal, to_view))
    r = phong.reflect(v, n)
    cubes = [[_cube(name, turn) for turn in range(TURNS)] for name in MAPS]
    radiance = np.concatenate([cube.levels[0].reshape(-1, 3) for row in cubes for cube in row], 1).astype(np.float32)
    shape = (len(MAPS), TURNS, len(EXPONENTS))
    error = {(lobe, place): np.empty(shape) for lobe in LOBES for place in PLACES}
    best = {lobe: np.empty(shape) for lobe in LOBES}
    for k, s in enumerate(EXPONENTS):
        levels = float(phong.exponent_to_lod(s, FACE)) + OFFSETS
        inside = (levels >= 0) & (levels <= cubes[0][0].max_level)  # beyond, no two offsets differ
        weights = headroom_mcguire.truths(n, v, float(s))
        truth = {lobe: (weights[lobe] @ radiance).reshape(-1, len(MAPS), TURNS, 3).astype(np.float64) for lobe in LOBES}
        for i, row in enumerate(cubes):
            for j, cube in enumerate(row):
                looked_up = np.stack([cube.lookup(r, float(m)) for m in levels[inside]])
                published = cube.lookup(r, float(phong.exponent_to_lod(s, FACE)))
                for lobe in LOBES:
                    t = truth[lobe][:, i, j]
                    scale = t[part["anywhere"]].mean()
                    for place, some in part.items():
                        error[lobe, place][i, j, k] = np.sqrt(np.square(published[some] - t[some]).mean()) / scale
                    off = np.square(looked_up - t)[:, part["anywhere"]].mean((1, 2))
                    best[lobe][i, j, k] = sphere_view.least(OFFSETS[inside], off)
    return Errors(error, best, np.array([_low(row[0]) for row in cubes]))


def _low(cube: cubemap.SeamlessCube) -> float:
    coefficients = sh.project_cube(cube.levels[0]).mean(-1)
    return float(np.sqrt(np.square(coefficients[1:]).sum()) / coefficients[0])


def _cube(name: str, turn: int) -> cubemap.SeamlessCube:
    """A built-in map as a cubemap with box-filtered MIPs, turned at random."""
    from evalsuite.scene import builtin
    from evalsuite.scene.environment import read_environment

    environment = read_environment(builtin.environment_path(name))
    turned = Rotation.random(TURNS, random_state=1)[turn].as_matrix() @ environment.to_world
    return cubemap.SeamlessCube(cubemap.box_mips(cubemap.resample_latlong(environment.radiance, turned, FACE, 3)))
