"""How much a picture may change without anyone's doing, as the root mean square of its change over the mean of the truth.

By the triangle inequality no such change moves `rel_rmse` by more. Noise needs no tolerance: it has intervals."""

from __future__ import annotations

from typing import NamedTuple

#: The same renderer: float32 arithmetic in another order. 9·10⁻⁶ is measured for `diffuse-sh9`, nothing but arithmetic, between
#: two renderers (docs/conventions.md), and is more than a compiler does on one.
DRIFT = 1e-5
#: Another renderer: fixed-point texture filtering. 1.1·10⁻³ to 4.4·10⁻³ is measured (docs/conventions.md).
DRIVER = 5e-3
#: Techniques that rest on the hardware's own level of detail, for which OpenGL allows approximations: 9.2·10⁻² is measured.
DRIVER_OF = {"glossy-boxmip": 0.1}


class Tolerance(NamedTuple):
    """allowed: root mean square change of a picture over the mean of the truth. reason: what may have caused it."""

    allowed: float
    reason: str


def tolerance(technique: str, renderer_before: str | None, renderer: str | None) -> Tolerance:
    """What a change of the picture is allowed between two renderers (`host.gl_renderer`), or on one."""
    if renderer_before == renderer:
        return Tolerance(DRIFT, "drift")
    return Tolerance(DRIVER_OF.get(technique, DRIVER), "driver")
