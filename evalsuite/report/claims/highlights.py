"""Whether a lamp in the map has the highlight of a direct light (McGuire et al. 2013, §5 and Fig 1), in float64.

Over the normals of a convex object, seen and lit from afar: the look-up of the map at level m(s) about r, the same lamp as a
light from one direction under Eq 13, and the integral of Eq 13 over the lamp's disc.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import cubemap, phong
from evalsuite.report.claims.intervals import above, below, geometric, within
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.numbers import measured

Float = NDArray[np.float64]

EXPONENTS = (10, 100, 1000)
LAMPS, LAMP_DEG, FACE = 24, 1.0, 128
#: Largest angle of incidence, and how far from the highlight's middle the normals reach [degrees].
INCIDENCE_DEG, REACH_DEG = 45.0, 85.0
#: Two highlights are similar where peak, energy and radius differ by less than this factor.
SIMILAR = 1.5
QUANTITIES = ("peak", "energy", "radius")
CAUSE = "m(s) takes the solid angle of cos^s about r, but about h the lobe is as wide as that of s/4, four times the solid angle"


def similar() -> Finding:
    """Lamps 1° in radius in random directions, seen at up to 45° of incidence, faces of 128² texels. Peak, integral over the
    normals, and radius √(integral / π peak) of the highlight: looked up at m(s) over direct under Eq 13; mean of 24 lamps."""
    rng = np.random.default_rng(3)
    ratios: dict[int, dict[str, list[float]]] = {s: {q: [] for q in (*QUANTITIES, "direct_over_exact")} for s in EXPONENTS}
    for _ in range(LAMPS):
        to_light, to_view = _directions(rng)
        disc = _disc(to_light, np.radians(LAMP_DEG))
        irradiance = 2.0 * np.pi * (1.0 - np.cos(np.radians(LAMP_DEG)))
        cube = _cube(to_light, np.cos(np.radians(LAMP_DEG)), irradiance)
        normals, weights = _normals(to_light + to_view)
        seen = normals @ to_view > 0.0
        r = phong.reflect(np.broadcast_to(to_view, normals.shape), normals)
        for s in EXPONENTS:
            looked_up = np.where(seen, cube.lookup(r, float(phong.exponent_to_lod(s, FACE)))[:, 0], 0.0)
            direct = np.where(seen, irradiance * _lit(normals, to_light[None], to_view, s), 0.0)
            exact = np.where(seen, irradiance * _lit(normals, disc, to_view, s), 0.0)
            ours, theirs, truth = (_highlight(x, weights) for x in (looked_up, direct, exact))
            for q in QUANTITIES:
                ratios[s][q].append(ours[q] / theirs[q])
            ratios[s]["direct_over_exact"].append(theirs["peak"] / truth["peak"])
    found = {str(s): {q: geometric(values) for q, values in of_s.items()} for s, of_s in ratios.items()}
    text = "looked up over direct: " + "; ".join(
        f"s = {s}: " + ", ".join(f"{q} {measured(of_s[q])}" for q in QUANTITIES) for s, of_s in found.items()
    )
    text += f". Peak of the direct light over the exact integral's at s = {s}: {measured(found[str(s)]['direct_over_exact'])}"
    numbers = {"looked_up_over_direct": found, "similar": [1.0 / SIMILAR, SIMILAR]}
    off = [q for q in QUANTITIES if any(above(o[q], SIMILAR) or below(o[q], 1.0 / SIMILAR) for o in found.values())]
    if all(within(of_s[q], 1.0 / SIMILAR, SIMILAR) for of_s in found.values() for q in QUANTITIES):
        return Finding(HOLDS, text, "", numbers)
    if not off:
        return Finding(LIMITS, text, f"the intervals leave a factor of {SIMILAR:g} open", numbers)
    rest = [q for q in QUANTITIES if q not in off]
    why = f"{' and '.join(off)} differ by more than a factor of {SIMILAR:g}" + (
        f", {' and '.join(rest)} not surely" if rest else ""
    )
    return Finding(FAILS, text, f"{why}; {CAUSE}", numbers)


def _directions(rng: np.random.Generator) -> tuple[Float, Float]:
    """l anywhere, v up to twice INCIDENCE_DEG from it."""
    l, other = rng.standard_normal((2, 3))  # noqa: E741
    l /= np.linalg.norm(l)  # noqa: E741
    side = np.cross(l, other)
    side /= np.linalg.norm(side)
    between = 2.0 * np.arccos(rng.uniform(np.cos(np.radians(INCIDENCE_DEG)), 1.0))
    return l, np.cos(between) * l + np.sin(between) * side


def _disc(centre: Float, radius: float, count: int = 64) -> Float:
    """Directions spread evenly over a cap of this angular radius."""
    k = np.arange(count) + 0.5
    cosine, phi = 1.0 - k / count * (1.0 - np.cos(radius)), np.pi * (1.0 + 5**0.5) * k
    return _about(centre, cosine, phi)


def _about(axis: Float, cosine: Float, phi: Float) -> Float:
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    sine = np.sqrt(1.0 - np.square(cosine))
    return (sine * np.cos(phi))[..., None] * x + (sine * np.sin(phi))[..., None] * np.cross(z, x) + cosine[..., None] * z


def _normals(middle: Float) -> tuple[Float, Float]:
    """Normals about the half vector, the closer the denser, and the solid angle of each."""
    u = (np.arange(128) + 0.5) / 128
    reach = np.radians(REACH_DEG)
    theta = reach * u**2
    phi = 2.0 * np.pi * (np.arange(96) + 0.5) / 96
    weight = np.sin(theta) * reach * 2.0 * u / 128 * (2.0 * np.pi / 96)
    grid = _about(middle, np.repeat(np.cos(theta), 96), np.tile(phi, 128))
    return grid, np.repeat(weight, 96)


def _cube(centre: Float, cosine: float, irradiance: float) -> cubemap.SeamlessCube:
    """A lamp of radiance 1 in the dark, with the power of the disc whatever texels it falls on."""
    level0 = cubemap.resample(lambda d: 1.0 * (d @ centre > cosine * np.linalg.norm(d, axis=-1))[..., None], FACE, 4)
    return cubemap.SeamlessCube(cubemap.box_mips(level0 * (irradiance / cubemap.integral(level0))))


def _lit(normals: Float, lights: Float, to_view: Float, exponent: float) -> Float:
    """Eq 13 with k_G = 1, k_L = 0, × n·l, mean over the lights."""
    half = lights + to_view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    return (phong.blinn_phong_brdf(exponent, normals @ half.T) * np.maximum(normals @ lights.T, 0.0)).mean(-1)


def _highlight(radiance: Float, weights: Float) -> dict[str, float]:
    peak, energy = float(radiance.max()), float(radiance @ weights)
    return {"peak": peak, "energy": energy, "radius": float(np.sqrt(energy / (np.pi * peak)))}
