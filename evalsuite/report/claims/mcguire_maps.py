"""Where m(s) errs, and under which maps (McGuire et al. 2013, §4), in float64.

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
from evalsuite.report.claims.intervals import above, below, geometric, mean
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures import headroom_mcguire, sphere_view
from evalsuite.report.numbers import measured

Float = NDArray[np.float64]

BUILT_IN = ("office", "cathedral", "coloured-cube", "overcast", "sunsky", "sh2")
#: Noise of one degree and of one contrast: varying at the lowest frequencies alone, and flat there.
LOW_BANDS, FLAT_BANDS = ("band-1", "band-2"), ("band-4", "band-8", "band-16")
MAPS = BUILT_IN + LOW_BANDS + FLAT_BANDS
BOXY = "coloured-cube"
EXPONENTS = (5, 20, 80, 320)
TURNS, FACE, PICTURE, PIXELS = 5, 64, 128, 250
OFFSETS = np.linspace(-2.0, 3.0, 21)
LOBES = {"h, albedo 1": "lobe about h", "r": "lobe about r"}
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


def centres_corners() -> Finding:
    """Error of the look-up at m(s) on the scene `sphere`, without grazing views, over eleven maps turned at random: within 10° of
    the faces' corners over within 15° of their centres, and at s = 5 over s = 320. Brackets: over the maps."""
    found = {}
    for lobe in LOBES:
        by_place = {place: errors().error[lobe, place] for place in PLACES}
        found[lobe] = {
            "corner_over_centre": geometric(_of_maps(by_place["corner"] / by_place["centre"])),
            "low_over_high": geometric(_of_maps(by_place["anywhere"][..., :1] / by_place["anywhere"][..., -1:])),
        }
    text = "; ".join(
        f"{LOBES[lobe]}: corners over centres {measured(of['corner_over_centre'])}, s = {EXPONENTS[0]} over s = {EXPONENTS[-1]} "
        f"{measured(of['low_over_high'])}" for lobe, of in found.items()
    )  # fmt: skip
    places = [of["corner_over_centre"] for of in found.values()]
    exponents = [of["low_over_high"] for of in found.values()]
    if all(above(m, 1.0) for m in places + exponents):
        return Finding(HOLDS, text, "", found)
    parts = [
        _said(places, 1.0, "corners are worse than centres", "corners are better than centres"),
        _said(exponents, 1.0, "low exponents are worse than high ones", "low exponents are better than high ones"),
    ]
    some = any(above(m, 1.0) for m in places + exponents)
    return Finding(LIMITS if some else FAILS, text, "; ".join(parts), found)


def flat_boxy() -> Finding:
    """Error at m(s) on the scene `sphere`, maps turned at random. Its growth with what six built-in maps vary in degrees 1 and 2
    (slope between logarithms); noise of degree 4, 8, 16, flat at low frequencies, over noise of degree 1, 2 and the same
    contrast; and the c of least error in m(s) + c among six coloured walls, above 0 where the published level is too shiny.
    Brackets: over the maps, else over turns."""
    made = errors()
    rows = {name: k for k, name in enumerate(MAPS)}
    natural = [rows[name] for name in BUILT_IN]
    found: dict[str, dict] = {}
    for lobe in LOBES:
        error = np.log(made.error[lobe, "anywhere"])
        flat, low = (error[[rows[name] for name in bands]].mean((0, 2)) for bands in (FLAT_BANDS, LOW_BANDS))
        found[lobe] = {
            "slope": _slope(np.log(made.low[natural]), error[natural].mean((1, 2))),
            "flat_over_low": geometric(np.exp(flat - low)),
            "c_boxy": mean(made.best[lobe][rows[BOXY]].mean(-1)),
            "error": dict(zip(MAPS, np.exp(error.mean((1, 2))).tolist(), strict=True)),
        }
    text = "; ".join(
        f"{LOBES[lobe]}: error goes with variation to the power {measured(of['slope'])}, flat over varying noise "
        f"{measured(of['flat_over_low'])}, six walls need c = {measured(of['c_boxy'])}" for lobe, of in found.items()
    )  # fmt: skip
    numbers = {**found, "variation_of_degrees_1_and_2": dict(zip(MAPS, made.low.tolist(), strict=True))}
    slopes, noises, offsets = ([of[key] for of in found.values()] for key in ("slope", "flat_over_low", "c_boxy"))
    agrees = [above(m, 0.0) for m in slopes] + [below(m, 1.0) for m in noises] + [above(m, 0.0) for m in offsets]
    if all(agrees):
        return Finding(HOLDS, text, "", numbers)
    parts = [
        _said(slopes, 0.0, "maps that vary more at low frequencies are worse", "they are no worse"),
        _said(noises, 1.0, "of equal contrast, flat noise is worse", "flat noise is better"),
        _said(offsets, 0.0, "the published level is too shiny among six walls", "it is too dull"),
    ]
    return Finding(LIMITS if any(agrees) else FAILS, text, "; ".join(parts), numbers)


def _said(by_lobe: list[Mapping], limit: float, over: str, under: str) -> str:
    """One sentence of both lobes, or of each where they differ. over, under: what an interval above, below the limit says."""
    said = [over if above(m, limit) else under if below(m, limit) else f"open whether {over}" for m in by_lobe]
    if len(set(said)) == 1:
        return f"{said[0]} for either lobe"
    return ", ".join(f"{text} for the {LOBES[lobe]}" for lobe, text in zip(LOBES, said, strict=True))


def _of_maps(ratios: Float) -> Float:
    """One ratio a map: the geometric mean over turns and exponents."""
    return np.exp(np.log(ratios).mean((1, 2)))


def _slope(x: Float, y: Float) -> dict[str, object]:
    """Of the straight line of least squares, with Student's interval."""
    from scipy.stats import linregress, t

    line = linregress(x, y)
    half = float(t.ppf(0.975, len(x) - 2) * line.stderr)
    return {"value": float(line.slope), "ci95": [float(line.slope) - half, float(line.slope) + half]}


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
