"""Claims about frame rates. Absolute ones are another machine's; what is tested is which of two costs more, and by how much."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from evalsuite.report.claims.intervals import above, below, geometric, mean
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.numbers import measured, number

PREFILTER, SINGLE = "glossy-hierarchical", ("glossy-boxmip", "kautz-combined")
STATED = 500 / 25
#: Hz that the notes' table has for N = 10 … 500.
RATES = {10: 25, 50: 20, 100: 16, 250: 16, 500: 9}


def frame_ms(cell: Mapping) -> float:
    """A frame whose map is brought in and filtered anew [ms]: drawing and all preparation, which cells otherwise count once."""
    return float(cell["cost"]["gpu_ms"] + cell["cost"]["prepare_ms"])


def single_pass(cells: Rendered) -> Finding:
    """Time of a frame with the parabolic prefilter, N = 225, over that with box-filtered MIPs, b = 2.25, on one object under
    six maps; bringing the map in and filtering it counted in every frame, timed on this machine. Brackets: over the maps."""
    maps = cells.values("env")[1:]  # the first compiles the programs
    slow = {env: frame_ms(cells.cell(technique=PREFILTER, env=env)) for env in maps}
    fast = {name: {env: frame_ms(cells.cell(technique=name, env=env)) for env in maps} for name in SINGLE}
    ratio = {name: geometric(slow[env] / of_map[env] for env in maps) for name, of_map in fast.items()}
    rate = {
        name: 1e3 / float(np.exp(np.mean(np.log(list(of_map.values()))))) for name, of_map in {PREFILTER: slow, **fast}.items()
    }
    text = "times as long with the prefilter: " + ", ".join(f"{measured(r)} ({name})" for name, r in ratio.items())
    text += "; here " + ", ".join(f"{number(fps)} Hz ({name})" for name, fps in rate.items()) + f" on {_renderer(cells)}"
    numbers = {"ratio": ratio, "stated": STATED, "hz": rate, "gl_renderer": _renderer(cells)}
    box, combined = (ratio[name] for name in SINGLE)
    if not above(box, 1.0):
        slower = below(box, 1.0)
        return Finding(FAILS if slower else LIMITS, text, "the single pass is slower" if slower else "noise decides", numbers)
    limits = []
    if below(box, STATED):
        limits.append(f"faster, but not {STATED:g} times: bringing the map in, as faces or paraboloids, is most of either frame")
    if not above(combined, 1.0):
        limits.append("what is gained goes into nine SH coefficients of the whole map, which kautz-combined needs besides")
    return Finding(LIMITS if limits else HOLDS, text, "; ".join(limits), numbers)


def frame_rates(cells: Rendered) -> Finding:
    """Time of a frame with both paraboloids filtered anew, on the sphere under six maps: what twice the exponent adds, by the
    slope over log₂ N, and N = 500 over N = 10. Brackets: over the maps, timed on this machine."""
    maps, exponents = cells.values("env")[1:], cells.values("exponent")  # the first map compiles the programs
    times = np.array([[frame_ms(cells.cell(env=env, exponent=n)) for n in exponents] for env in maps])
    slope = mean(np.polyfit(np.log2(exponents), row, 1)[0] for row in times)
    ratio = geometric(times[:, -1] / times[:, 0])
    rates = ", ".join(f"N = {n}: {number(1e3 / t)} Hz" for n, t in zip(exponents, times.mean(0), strict=True))
    text = (f"twice the exponent adds {measured(slope, 'ms')}; N = {exponents[-1]} takes {measured(ratio)} times as long as "
            f"N = {exponents[0]}; {rates} on {_renderer(cells)}")  # fmt: skip
    stated = {str(n): hz for n, hz in RATES.items()}
    numbers = {"ms_of_doubling": slope, "last_over_first": ratio, "stated_hz": stated, "gl_renderer": _renderer(cells),
               "ms": {env: row.tolist() for env, row in zip(maps, times, strict=True)}}  # fmt: skip
    machine = "the rates themselves are another machine's (an SGI O2)"
    if above(slope, 0.0):
        return Finding(HOLDS, text, f"the order; {machine}", numbers)
    if below(slope, 0.0):
        return Finding(FAILS, text, "narrower lobes take less time here", numbers)
    return Finding(
        LIMITS, text, f"noise decides: filtering is a small part of the frame beside bringing the map in; {machine}", numbers
    )


def _renderer(cells: Rendered) -> str:
    """What drew, as results.json of the run has it."""
    return json.loads((cells.directory / "results.json").read_text("utf-8"))["host"]["gl_renderer"]
