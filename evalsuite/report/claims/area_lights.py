"""Claims about area lights out of an environment map (environment maps as area lights, 2007)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from evalsuite.lights.decompose import decompose
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.report.claims.intervals import above, below, mean
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, UNTESTED, Finding
from evalsuite.report.numbers import measured

STATED = {"galileo": 8, "grace": 10, "kitchen": 4, "st-peters": 17}
HEIGHT, REGIONS = 256, 24
#: Slowest that the paper took at its fastest [s].
PAPER_SECONDS = 1800.0


def _radiance(path: Path) -> np.ndarray:
    from evalsuite.scene.environment import read_environment

    return read_environment(path).radiance


def counts(maps: Mapping[str, Path]) -> Finding:
    """Lights found in the papers' own maps, as far as they are given."""
    given = {name: len(decompose(_radiance(maps[name])).lights) for name in STATED if name in maps}
    if not given:
        return Finding(UNTESTED, "", "the maps cannot be shipped; --env grace=FILE and others count the lights of yours")
    numbers = {"lights": given, "stated": {name: STATED[name] for name in given}}
    text = ", ".join(f"{name}: {n}, stated {STATED[name]}" for name, n in given.items())
    wrong = [name for name, n in given.items() if n != STATED[name]]
    if not wrong:
        return Finding(HOLDS, text, "" if len(given) == len(STATED) else "only these maps were given", numbers)
    near = all(abs(given[name] - STATED[name]) <= 2 for name in wrong)
    return Finding(LIMITS if near else FAILS, text, f"another number for {', '.join(wrong)}", numbers)


def seconds() -> Finding:
    """Decomposing a map of 1024 × 512 texels with the paper's parameters, on this machine."""
    from evalsuite.scene import builtin

    found = {}
    for name in ("office", "cathedral"):
        radiance = _radiance(builtin.environment_path(name))
        k = -(-512 // radiance.shape[0])
        radiance = radiance.repeat(k, 0).repeat(k, 1)[:512, :1024]
        started = time.perf_counter()
        decompose(radiance)
        found[name] = time.perf_counter() - started
    text = ", ".join(f"{s:.2g} s ({name})" for name, s in found.items())
    numbers = {"seconds": found, "stated": [1800.0, 5400.0]}
    if min(found.values()) >= PAPER_SECONDS:
        return Finding(HOLDS, text, "", numbers)
    return Finding(FAILS, text, "the same filters summed in a pyramid on the sphere instead of a camera for each texel", numbers)


def larger() -> Finding:
    """Solid angle of the light over that of the region it was found for: bright rectangles of 6 to 20 degrees, one a map, sides
    up to 1 : 2."""
    rng = np.random.default_rng(4)
    directions = latlong_directions(HEIGHT, 2 * HEIGHT)
    omega = np.broadcast_to(latlong_solid_angles(HEIGHT, 2 * HEIGHT), directions.shape[:2])
    ratios = []
    for _ in range(REGIONS):
        centre = rng.standard_normal(3)
        centre /= np.linalg.norm(centre)
        side = np.cross(centre, rng.standard_normal(3))
        side /= np.linalg.norm(side)
        half = np.tan(np.radians(rng.uniform(3, 10)) * np.array([1.0, rng.uniform(0.5, 1.0)]))
        along = np.maximum(directions @ centre, 1e-9)
        across = np.abs(np.stack([directions @ side, directions @ np.cross(centre, side)], -1)) / along[..., None]
        region = (across <= half).all(-1) & (directions @ centre > 0)
        radiance = np.where(region[..., None], 5.0, 0.005).repeat(3, -1).astype(np.float32)
        lights = decompose(radiance).lights
        # One region may become several lights; the largest is its own.
        ratios.append(max(light.solid_angle for light in lights) / float(omega[region].sum()))
    metric = mean(ratios)
    text = f"solid angle of the light over that of a bright rectangle, mean of {REGIONS}: {measured(metric)}"
    if above(metric, 1.0):
        return Finding(HOLDS, text, "", metric)
    smaller = below(metric, 1.0)
    return Finding(FAILS if smaller else LIMITS, text, "not larger" if smaller else "noise decides", metric)
