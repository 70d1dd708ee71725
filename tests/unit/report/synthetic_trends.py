"""A history of checks whose changes are known by construction."""

from __future__ import annotations

import numpy as np

from evalsuite.gate.history import Cell, Check
from evalsuite.gate.trends import trends

HOSTILE = "<script>window.pwned=1</script>/glossy-mcguire/exponent=10/direct"
#: Cell → rel_rmse at check k (from 1), half the interval.
CELLS = {
    "torus/glossy-mcguire/exponent=12/direct": (lambda k: 0.041 + 0.009 * (k >= 17), 0.001),
    "sphere/glossy-mcguire/exponent=64/unoccluded": (lambda k: 0.062 - 0.02 * (9 <= k < 23), 0.004),
    "sphere/diffuse-sh9/default/unoccluded": (lambda k: 0.0107 + 2e-3 * (k >= 28), 0.0),
    "bunny/diffuse-topmip/default/direct": (lambda k: 0.21, 0.01),
    "teapot/npr-gooch/default/direct": (lambda k: 0.33, 0.03),
    HOSTILE: (lambda k: 0.05, 0.002),
}


def made(checks: int = 32, other_renderer: bool = True) -> dict:
    """Trends as in trends.json: another seed every check, the last two cells' checks 11 to 13 on another renderer."""
    rng, past = np.random.default_rng(4), []
    for k in range(1, checks + 1):
        renderer = "NVIDIA H100 80GB HBM3" if other_renderer and 11 <= k <= 13 else "llvmpipe (LLVM 19.1.7, 256 bits)"
        cells = {}
        for name, (level, half) in CELLS.items():
            value = float(level(k) + half / 1.96 * rng.standard_normal())
            verdict = "further" if k == 17 and name.startswith("torus") else "unchanged"
            cells[name] = Cell(verdict, value, value - half, value + half, k)
        passed = k != 17
        past.append(
            Check(
                k,
                f"2026-10-{(k - 1) % 30 + 1:02d}T07:12:44+00:00",
                f"{0x1A2B3C4D5E6F + k * 0x9E3779B97F:012x}",
                renderer,
                passed,
                cells,
            )
        )
    return trends("gate", past)
