"""What a decomposed environment is: disc-shaped area lights and the map that is left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from evalsuite.math.sphere import latlong_solid_angles

Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class DecompositionSettings:
    """Parameters of the decomposition, with the paper's values.

    sizes: filters in the bank. smallest_deg, largest_deg: angular extents of the smallest and the largest, the diameter of
    the surround [degrees]. spacing: of the sizes in between, geometric or linear. inner: radius of the centre over that of the
    surround. surround: weight of the surround, negative, where the centre has 1. candidates: part of the map's texels, the
    brightest, that filters are centred on. stop: a light below this part of the sum of those before it ends the search and is
    not kept. least_response: a best response not above it ends the search too; −inf leaves that to `stop`. max_lights: cap.
    """

    sizes: int = 20
    smallest_deg: float = 4.5
    largest_deg: float = 45.0
    spacing: str = "geometric"
    inner: float = 0.75
    surround: float = -10.0
    candidates: float = 0.1
    stop: float = 0.02
    least_response: float = 0.0
    max_lights: int = 64

    @classmethod
    def of(cls, parameters: Mapping[str, object]) -> DecompositionSettings:
        """From a technique's parameters of the same names; what they lack keeps its default."""
        return cls(**{f.name: parameters[f.name] for f in fields(cls) if parameters.get(f.name) is not None})


@dataclass(frozen=True)
class Light:
    """A disc of the sphere with one radiance. direction: unit, to its centre, in the map's local frame (that of
    `math.sphere`). angular_radius: [rad]. irradiance: RGB ∫ L dω over the texels it stands for [W m⁻²], what it would give a
    surface if all of it came from the centre at normal incidence."""

    direction: tuple[float, float, float]
    angular_radius: float
    irradiance: Rgb

    @property
    def solid_angle(self) -> float:
        """2π(1 − cos r) [sr]."""
        return float(4.0 * np.pi * np.sin(0.5 * self.angular_radius) ** 2)

    @property
    def radiance(self) -> Rgb:
        """The disc's radiance, irradiance / solid angle [W m⁻² sr⁻¹]."""
        return tuple(float(e) / self.solid_angle for e in self.irradiance)


@dataclass(frozen=True, eq=False)
class Decomposition:
    """lights: in the order found. remainder: (H, W, 3) float32 radiance, the map with the lights' texels black. table: a row
    for each light and one for the candidate that ended the search; what the search saw. shape: of the map, (H, W)."""

    lights: tuple[Light, ...]
    remainder: NDArray[np.float32]
    table: tuple[Mapping[str, object], ...] = field(default=())

    @property
    def shape(self) -> tuple[int, int]:
        return self.remainder.shape[:2]

    @property
    def irradiance(self) -> NDArray[np.float64]:
        """Σ of the lights' irradiances, (3,)."""
        return np.sum([light.irradiance for light in self.lights], axis=0) if self.lights else np.zeros(3)

    @property
    def integral(self) -> NDArray[np.float64]:
        """Σ lights + ∫ remainder dω, (3,): the map's own ∫ L dω."""
        return self.irradiance + np.einsum("yxc,yx->c", self.remainder.astype(np.float64), latlong_solid_angles(*self.shape))
