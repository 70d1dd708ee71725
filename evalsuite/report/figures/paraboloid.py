"""002 Fig 3: what solid angle a texel of a paraboloid map covers, over the angle from the viewing direction.

With ρ = tan(θ/2), Eq 3 of the course notes is **ω/ω_r = 1/(4‖f‖²) = 1/(1 + ρ²)² = cos⁴(θ/2)**: 1 at the centre, ¼ on the rim.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evalsuite.math import paraboloid
from evalsuite.report.figures import style

SIZE, BORDER = 512, 0.0


def data() -> dict[str, Any]:
    """Each whole texel's θ [rad] and exact solid angle over that at the centre, and the ratio of the extremes."""
    directions = paraboloid.texel_directions(SIZE, BORDER)[paraboloid.FRONT]
    omega = paraboloid.texel_solid_angles(SIZE, BORDER)
    # Texels that the circle does not cut: the farthest corner lies inside.
    corner = (np.abs(np.arange(SIZE) + 0.5 - SIZE / 2) + 0.5) / (SIZE / 2)
    whole = np.hypot(corner[None, :], corner[:, None]) <= 1.0
    theta = np.arccos(directions[whole][:, 2])
    centre = omega[SIZE // 2, SIZE // 2]
    ratio = omega[whole] / centre
    return {
        "theta": theta,
        "ratio": ratio,
        "measured": {
            "map_size_texels": SIZE,
            "whole_texels": int(whole.sum()),
            "sum_of_both_maps_over_4pi": float(2 * omega.sum() / (4 * np.pi)),
            "ratio_centre_to_rim": float(1 / ratio.min()),
            "ratio_in_the_paper": 4.0,
            "largest_difference_from_cos4": float(np.abs(ratio - np.cos(theta / 2) ** 4).max()),
        },
    }


def draw(data: dict[str, Any]) -> Any:
    """ω/ω_r of every texel and the closed form, over θ."""
    figure = style.figure(6.4, 4.4)
    axes = figure.subplots()
    some = np.argsort(data["theta"])[:: max(1, len(data["theta"]) // 1500)]
    axes.plot(np.degrees(data["theta"][some]), data["ratio"][some], ".", markersize=4, color=style.COLOURS["paraboloid"],
              label=f"texels of a {SIZE}² map, exact solid angles")  # fmt: skip
    theta = np.linspace(0, 90, 181)
    axes.plot(theta, np.cos(np.radians(theta) / 2) ** 4, label="cos⁴(θ/2) = 1/(4‖f‖²)", **style.THEORY)
    measured = data["measured"]["ratio_centre_to_rim"]
    axes.axhline(0.25, color="0.6", linewidth=0.8)
    axes.annotate(
        f"¼ on the rim; outermost whole texel 1/{measured:.3f}", (4, 0.25), xytext=(0, 4), textcoords="offset points", color="0.3"
    )
    style.angle_axis(axes, 90)
    axes.set_ylim(0, 1.05)
    axes.set_ylabel("solid angle of a texel over the centre's, $\\omega/\\omega_r$")
    axes.set_title("Paraboloid map: solid angle of a texel over direction", loc="left")
    axes.legend(frameon=False)
    return figure
