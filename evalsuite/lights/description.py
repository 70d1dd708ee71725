"""A decomposition's lights as JSON: what `lights.json` and a cell of results.json hold."""

from __future__ import annotations

import numpy as np

from evalsuite.image.color import luminance
from evalsuite.lights.model import Decomposition


def described(found: Decomposition) -> list[dict]:
    """For each light: direction (local frame), angular_radius_deg, solid_angle [sr], radiance [W m⁻² sr⁻¹], irradiance [W m⁻²],
    share (of the map's luminance)."""
    power = float(luminance(found.integral))
    return [
        {
            "direction": [float(x) for x in light.direction],
            "angular_radius_deg": float(np.degrees(light.angular_radius)),
            "solid_angle": light.solid_angle,
            "radiance": list(light.radiance),
            "irradiance": list(light.irradiance),
            "share": float(luminance(np.array(light.irradiance))) / power if power > 0 else 0.0,
        }
        for light in found.lights
    ]
