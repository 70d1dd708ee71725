"""Whether one dual paraboloid map serves all views (Heidrich and Seidel 1998)."""

from __future__ import annotations

from evalsuite.report.claims.intervals import above, below, geometric
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, Finding
from evalsuite.report.figures.rendered import Rendered
from evalsuite.report.numbers import measured

#: The direction to the viewer at azimuth 0 of the scene `sphere72`, that one of the sphere maps is made for.
FIRST = "2.2 1.1 3.4"
#: A view is served where the error is less than this many times that with a map made for it.
SERVED = 1.25


def one_map(cells: Rendered) -> Finding:
    """A mirror sphere seen from four sides, under two maps: relative RMSE against Mitsuba with one dual paraboloid map, and with
    one sphere map made for the first side, each over that with a sphere map made for the very view. Brackets: over views and
    maps."""
    views = [(env, angle) for env in cells.values("env") for angle in cells.values("azimuth")]
    turned = [v for v in views if v[1] != views[0][1]]
    made = {v: _error(cells, "mirror-sphere", None, *v) for v in views}
    one = geometric(_error(cells, "mirror-paraboloid", None, *v) / made[v] for v in views)
    first = geometric(_error(cells, "mirror-sphere", FIRST, *v) / made[v] for v in turned)
    text = (f"error over that of a sphere map made for the view: one paraboloid map {measured(one)}; one sphere map, seen from "
            f"the three other sides, {measured(first)}")  # fmt: skip
    numbers = {"paraboloid_over_made": one, "first_sphere_over_made": first, "served": SERVED}
    if above(one, SERVED):
        return Finding(FAILS, text, f"more than {SERVED:g} times the error of a map made for the view", numbers)
    if below(one, SERVED) and above(first, 1.0):
        return Finding(HOLDS, text, "" if above(first, SERVED) else "so does a sphere map, nearly", numbers)
    why = (
        "a sphere map made for one view serves the others as well"
        if below(one, SERVED)
        else "views and maps differ too much to say"
    )
    return Finding(LIMITS, text, why, numbers)


def _error(cells: Rendered, technique: str, view: str | None, env: str, azimuth: float) -> float:
    return float(cells.cell(technique=technique, view=view, env=env, azimuth=azimuth)["metrics"]["rel_rmse"]["value"])
