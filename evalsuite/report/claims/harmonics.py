"""Claims about nine spherical-harmonic coefficients (Kautz, Daubert, Seidel 2004 §5.1.1)."""

from __future__ import annotations

import time

import numpy as np

from evalsuite.math import sh
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures.sphere_view import MAPS, cube

#: What eight texels along an edge may change, relative to the mean irradiance: below it the eye sees nothing.
ACCURATE = 0.01
FULL, SMALL = 128, 8


def eight_texels() -> Finding:
    """Nine coefficients from faces of 8² texels, the box-filtered level, beside those from 128²: change of irradiance, RMS over
    all normals relative to the mean."""
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((4000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    off = {}
    for name in MAPS:
        levels = cube(name, FULL).levels
        full, small = (sh.irradiance(sh.project_cube(levels[k]), normals) for k in (0, int(np.log2(FULL // SMALL))))
        off[name] = float(np.sqrt(np.mean((small - full) ** 2)) / np.mean(full))
    numbers = {"relative_rms": off, "allowed": ACCURATE}
    measured = "irradiance changes by " + ", ".join(f"{100 * v:.2g} % ({name})" for name, v in off.items())
    wrong = [name for name, v in off.items() if v > ACCURATE]
    if not wrong:
        return Finding(HOLDS, measured, "", numbers)
    if len(wrong) < len(off) / 2:
        return Finding(LIMITS, measured, f"more than 1 % for {', '.join(wrong)}", numbers)
    return Finding(FAILS, measured, f"more than 1 % for {', '.join(wrong)}", numbers)


def projection_time() -> Finding:
    """Nine coefficients from six faces of 8² texels, on this machine's processor in NumPy; the median of 21."""
    level = cube("office", FULL).levels[int(np.log2(FULL // SMALL))]
    took = []
    for _ in range(21):
        started = time.perf_counter()
        sh.project_cube(level)
        took.append(1e3 * (time.perf_counter() - started))
    low, middle, high = (float(v) for v in np.percentile(took, (10, 50, 90)))
    measured = f"{middle:.2g} ms, eight in ten between {low:.2g} and {high:.2g} ms"
    numbers = {"ms": middle, "between": [low, high], "stated": 2.0}
    why = "another processor than the paper's (Athlon, 1 GHz), and NumPy"
    return Finding(LIMITS if middle <= 2.0 else FAILS, measured, why, numbers)
