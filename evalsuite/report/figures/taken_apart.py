"""Pictures of an environment map, of the area lights found in it and of what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evalsuite.image.color import luminance, tone_map
from evalsuite.lights.decompose import decompose, flat_discs
from evalsuite.lights.model import Decomposition
from evalsuite.math.sphere import latlong_directions
from evalsuite.report.figures.grids import Panel

Float = NDArray[np.floating]

#: Widest panel [pixels], and half the width of an outline in it [degrees], where texels are not wider.
WIDTH, LINE_DEG = 512, 0.7
YELLOW, BLACK = (240, 228, 66), (0, 0, 0)


@dataclass(frozen=True, eq=False)
class TakenApart:
    """A map and its lights. white: radiance that panels show as white [W m⁻² sr⁻¹], twice what nine tenths of the map's texels
    stay below. share: of the map's luminance in the lights."""

    radiance: Float
    found: Decomposition
    white: float
    share: float

    @classmethod
    def of(cls, radiance: Float) -> TakenApart:
        found = decompose(radiance)
        level = float(np.quantile(luminance(radiance), 0.9)) or float(radiance.max()) or 1.0
        share = float(luminance(found.irradiance)) / max(float(luminance(found.integral)), 1e-300)
        return cls(radiance, found, 2.0 * level, share)

    def whole(self, caption: str = "") -> Panel:
        return self._panel(self.radiance, caption)

    def lights(self, caption: str = "", rest: bool = False) -> Panel:
        """Each light as the flat disc that it is, outlined, before black or before the rest of the map."""
        discs = flat_discs(self.found)
        panel = self._panel(discs + self.found.remainder if rest else discs, caption)
        directions = latlong_directions(*panel.pixels.shape[:2])
        line = max(LINE_DEG, 99.0 / len(directions))
        for light in self.found.lights:
            # |d − c| = 2 sin(angle/2)
            chord = np.linalg.norm(directions - np.asarray(light.direction), axis=-1)
            off = np.degrees(np.abs(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)) - light.angular_radius))
            panel.pixels[off < 2.0 * line] = BLACK
            panel.pixels[off < line] = YELLOW
        return panel

    def rest(self, caption: str = "") -> Panel:
        return self._panel(self.found.remainder, caption)

    def _panel(self, radiance: Float, caption: str) -> Panel:
        return Panel(np.round(255 * tone_map(_reduced(radiance), 1.0 / self.white)).astype(np.uint8), caption)


def _reduced(radiance: Float) -> Float:
    """Means of square blocks, so many texels each as leave the map no wider than WIDTH."""
    k = -(-radiance.shape[1] // WIDTH)
    height, width = (size // k for size in radiance.shape[:2])
    return radiance[: height * k, : width * k].reshape(height, k, width, k, 3).mean(axis=(1, 3))
