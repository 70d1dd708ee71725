"""A cell's environment for its page: the map as a picture, and outlines of the lights that a technique takes out of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr, ldr
from evalsuite.image.color import luminance, tone_map
from evalsuite.math.disc_coverage import tangent_frame
from evalsuite.math.sphere import direction_to_latlong
from evalsuite.report import scales

#: Of the map's luminances what is shown as white, and how far above it: lamps are white, what they light is not black.
PERCENTILE, ABOVE = 90.0, 2.0
#: Points of a light's rim.
POINTS = 90


def section(cell: Mapping, directory: Path) -> dict[str, object] | None:
    """What `environment.html` shows of a cell's environment, None where it has no map or its file cannot be read. Writes the
    picture, which all cells of an environment share, unless it is there. Raises EvalsuiteError if the folder is not writable."""
    given = (cell.get("images") or {}).get("environment")
    if not given or not (directory / given).resolve().is_relative_to(Path(directory).resolve()):
        return None
    try:
        radiance = exr.read(directory / given)
    except EvalsuiteError:
        return None
    preview = f"cells/environments/{Path(given).parent.name}.webp"
    brightness = luminance(radiance)
    white = ABOVE * float(np.percentile(brightness, PERCENTILE)) or float(brightness.max()) or 1.0
    if not (directory / preview).exists():
        ldr.write_webp(directory / preview, tone_map(radiance, 1.0 / white))
    height, width = radiance.shape[:2]
    lights = [_outline(number, light) for number, light in enumerate(cell.get("lights") or [], 1)]
    return {"preview": preview, "width": width, "height": height, "scale": scales.radiance(1.0 / white), "lights": lights,
            "share": sum(light["share"] for light in cell.get("lights") or [])}  # fmt: skip


def _outline(number: int, light: Mapping) -> dict[str, object]:
    """A light as the page draws it, its number beside it; in degrees of longitude and latitude from the map's upper left."""
    centre, r = np.asarray(light["direction"], np.float64), np.radians(light["angular_radius_deg"])
    t, b = tangent_frame(centre)
    around = np.linspace(0.0, 2.0 * np.pi, POINTS + 1)[:, None]
    u, v = direction_to_latlong(np.cos(r) * centre + np.sin(r) * (np.cos(around) * t + np.sin(around) * b))
    x, y = (float(c) * s for c, s in zip(direction_to_latlong(centre), (360.0, 180.0), strict=True))
    beside = float(np.degrees(r)) / max(np.sin(np.radians(y)), 0.2) + 5.0
    label = round(x + beside if x + beside < 355.0 else x - beside, 1), round(min(max(y, 5.0), 175.0), 1)
    return {"number": number, "label": label, "path": _path(360.0 * u, 180.0 * v), **light}


def _path(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
    """An SVG path that is lifted where it crosses the map's seam."""
    jumps = np.abs(np.diff(x, prepend=x[0])) > 180.0
    jumps[0] = True
    return " ".join(f"{'M' if jump else 'L'}{a:.1f} {b:.1f}" for a, b, jump in zip(x, y, jumps, strict=True))
