"""Environment maps in four representations and as pictures: lat-long, cube, dual paraboloid, sphere map; any into any.

Every conversion takes for each texel of the new map the mean radiance over its solid angle, looked up bilinearly in the old
one. Directions are the lat-long map's own (y up). As pictures:
  latlong     2:1, Mitsuba's `envmap` layout (math.sphere)
  cube        6:1, the faces +x −x +y −y +z −z side by side, each as OpenGL has it (math.cubemap)
  paraboloid  2:1, front | back about the z axis, +y up (math.paraboloid)
  sphere      1:1, the picture of a mirror ball seen from `view`, up up (math.sphere_map)
Written files say which they are in attributes of the EXR header (`evalsuite_layout`, `evalsuite_border`, `evalsuite_view`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.math import cubemap, paraboloid, sphere, sphere_map

Float = NDArray[np.float64]
Header = Mapping[str, object]

LAYOUT, BORDER, VIEW = "evalsuite_layout", "evalsuite_border", "evalsuite_view"
_BAND = 1 << 18  # directions looked up at a time: bounded memory, warm caches


@dataclass(frozen=True, eq=False)
class LatLong:
    """radiance: (H, W, 3) [W m⁻² sr⁻¹]."""

    radiance: NDArray
    name: ClassVar[str] = "latlong"

    @property
    def spacing(self) -> float:
        """Smallest distance of texels that matters [rad]."""
        return sphere.latlong_spacing(*self.radiance.shape[:2])

    @property
    def face_width(self) -> float:
        """Width of a cube's faces with as fine texels."""
        return max(1.0, self.radiance.shape[1] / 4.0)

    def lookup(self, directions: Float) -> Float:
        """Radiance (..., 3) at directions (..., 3)."""
        return sphere.latlong_lookup(self.radiance, directions)

    def integral(self) -> Float:
        """∫ L dω, (3,), with exact solid angles."""
        return np.einsum("yxc,yx->c", self.radiance.astype(np.float64), sphere.latlong_solid_angles(*self.radiance.shape[:2]))

    def picture(self) -> tuple[NDArray, dict[str, object]]:
        """(H, W, 3) and the header's attributes."""
        return self.radiance, {LAYOUT: self.name}

    @classmethod
    def of(cls, source: Map, size: int | None, view: tuple[float, float, float]) -> LatLong:
        """Resampled; size: width, even. Each texel is the mean over its cell, δ = π/(H − 1) tall and half that at the poles."""
        width = size or 2 * round(2.0 * source.face_width)
        height = max(width // 2, 3)
        delta, k = np.pi / (height - 1), _subsamples(2.0 * np.pi / width, source.spacing)
        total, weight = 0.0, np.zeros((height, 1))
        for j in range(k):
            edge = [np.clip((np.arange(height) - 0.5 + (j + i) / k) * delta, 0.0, np.pi) for i in (0, 1)]
            omega = (np.cos(edge[0]) - np.cos(edge[1]))[:, None]
            v = (0.5 * (edge[0] + edge[1]) / np.pi)[:, None]
            for i in range(k):
                u = ((np.arange(width) + (i + 0.5) / k) / width)[None, :]
                total = total + omega[..., None] * _in_bands(source, sphere.latlong_to_direction(u, v))
                weight += omega
        return cls(total / weight[..., None])

    @classmethod
    def from_picture(cls, picture: NDArray, header: Header) -> LatLong:
        """Any picture."""
        return cls(picture)


@dataclass(frozen=True, eq=False)
class Cube:
    """faces: (6, w, w, 3) in OpenGL's order."""

    faces: NDArray
    name: ClassVar[str] = "cube"

    @property
    def spacing(self) -> float:
        """Of texels on average [rad]: the centre's 2/w, less in the corners, where their solid angle is 3√3 times less."""
        return 2.0 / self.faces.shape[1] / np.sqrt(3.0)

    @property
    def face_width(self) -> float:
        """w."""
        return float(self.faces.shape[1])

    def lookup(self, directions: Float) -> Float:
        """Radiance (..., 3) at directions (..., 3), seamless."""
        return self._sampler.bilinear(directions, 0)

    @cached_property
    def _sampler(self) -> cubemap.SeamlessCube:
        return cubemap.SeamlessCube([self.faces])

    def integral(self) -> Float:
        """∫ L dω, (3,), with exact solid angles."""
        return cubemap.integral(self.faces)

    def picture(self) -> tuple[NDArray, dict[str, object]]:
        """(w, 6w, 3) and the header's attributes."""
        return np.concatenate(list(self.faces), axis=1), {LAYOUT: self.name}

    @classmethod
    def of(cls, source: Map, size: int | None, view: tuple[float, float, float]) -> Cube:
        """Resampled; size: width of a face."""
        width = size or max(4, round(source.face_width))
        return cls(cubemap.resample(lambda d: _in_bands(source, d), width, _subsamples(2.0 / width, source.spacing)))

    @classmethod
    def from_picture(cls, picture: NDArray, header: Header) -> Cube:
        """A 6:1 strip."""
        height, width = picture.shape[:2]
        _require(width == 6 * height, cls.name, picture, "six square faces side by side")
        return cls(np.stack(np.split(picture, 6, axis=1)))


@dataclass(frozen=True, eq=False)
class DualParaboloid:
    """maps: (2, n, n, 3), row 0 at y = −1; border [texels]."""

    maps: NDArray
    border: float
    name: ClassVar[str] = "paraboloid"

    @property
    def radius(self) -> float:
        """Of the circle [texels]."""
        return 0.5 * self.maps.shape[1] - self.border

    @property
    def spacing(self) -> float:
        """Of texels on the rim [rad], half that at the centre."""
        return 1.0 / self.radius

    @property
    def face_width(self) -> float:
        """Width of a cube's faces with as many texels."""
        return self.radius / paraboloid.matched_radius(1)

    def lookup(self, directions: Float) -> Float:
        """Radiance (..., 3) at directions (..., 3)."""
        return paraboloid.DualParaboloid([self.maps], self.border).bilinear(directions)

    def integral(self) -> Float:
        """∫ L dω, (3,), with exact solid angles."""
        return paraboloid.integral(self.maps, self.border)

    def picture(self) -> tuple[NDArray, dict[str, object]]:
        """(n, 2n, 3) and the header's attributes."""
        return np.concatenate(list(self.maps[:, ::-1]), axis=1), {LAYOUT: self.name, BORDER: float(self.border)}

    @classmethod
    def of(cls, source: Map, size: int | None, view: tuple[float, float, float]) -> DualParaboloid:
        """Resampled; size: width of each map, with a border of 2 texels."""
        radius = paraboloid.matched_radius(1) * source.face_width if size is None else 0.5 * size - 2.0
        size = size or 2 * int(np.ceil(radius + 2.0))
        border = 0.5 * size - radius
        k = _subsamples(2.0 / radius, source.spacing)
        return cls(paraboloid.resample(lambda d: _in_bands(source, d), size, border, k), border)

    @classmethod
    def from_picture(cls, picture: NDArray, header: Header) -> DualParaboloid:
        """Two squares side by side; without a header the circles touch the edges."""
        height, width = picture.shape[:2]
        _require(width == 2 * height, cls.name, picture, "two square maps side by side")
        return cls(np.stack(np.split(picture, 2, axis=1))[:, ::-1], _border(header, height))


@dataclass(frozen=True, eq=False)
class SphereMap:
    """texels: (n, n, 3), row 0 at the bottom; border [texels]; view: v₀."""

    texels: NDArray
    border: float
    view: tuple[float, float, float]
    name: ClassVar[str] = "sphere"

    @property
    def radius(self) -> float:
        """Of the disc [texels]."""
        return 0.5 * self.texels.shape[0] - self.border

    @property
    def spacing(self) -> float:
        """Of texels at the centre [rad]."""
        return 2.0 / self.radius

    @property
    def face_width(self) -> float:
        """Width of a cube's faces with as many texels."""
        return self.radius / sphere_map.matched_radius(1)

    def lookup(self, directions: Float) -> Float:
        """Radiance (..., 3) at directions (..., 3)."""
        return sphere_map.map_lookup(self.texels, self.border, directions @ sphere_map.frame(self.view))

    def integral(self) -> Float:
        """∫ L dω, (3,), with exact solid angles."""
        return sphere_map.integral(self.texels, self.border)

    def picture(self) -> tuple[NDArray, dict[str, object]]:
        """(n, n, 3) and the header's attributes."""
        view = " ".join(repr(float(x)) for x in self.view)
        return self.texels[::-1], {LAYOUT: self.name, BORDER: float(self.border), VIEW: view}

    @classmethod
    def of(cls, source: Map, size: int | None, view: tuple[float, float, float]) -> SphereMap:
        """Resampled for the viewing direction v₀ = view (towards the viewer); size: width, with a border of 1 texel."""
        radius = sphere_map.matched_radius(1) * source.face_width if size is None else 0.5 * size - 1.0
        size = size or 2 * int(np.ceil(radius + 1.0))
        border, frame = 0.5 * size - radius, sphere_map.frame(view)
        counts = sphere_map.subsamples(size, border, source.spacing)
        return cls(sphere_map.resample(lambda d: _in_bands(source, d @ frame.T), size, border, counts), border, view)

    @classmethod
    def from_picture(cls, picture: NDArray, header: Header) -> SphereMap:
        """A square; without a header the disc touches the edges and is seen from +z."""
        height, width = picture.shape[:2]
        _require(width == height, cls.name, picture, "a square map")
        try:
            view = tuple(float(x) for x in str(header.get(VIEW, "0 0 1")).split())
            assert len(view) == 3 and 0 < np.linalg.norm(view) < np.inf
        except (ValueError, AssertionError):
            raise EvalsuiteError("the map", f"the header {VIEW} = {header[VIEW]!r}", "three numbers, not all 0") from None
        return cls(picture[::-1], _border(header, height), view)


Map = LatLong | Cube | DualParaboloid | SphereMap
REPRESENTATIONS: Mapping[str, type[Map]] = {kind.name: kind for kind in (LatLong, Cube, DualParaboloid, SphereMap)}
SMALLEST = {"latlong": 4, "cube": 1, "paraboloid": 8, "sphere": 6}


def recognise(picture: NDArray, header: Header) -> str | None:
    """Which representation a picture is: what its header says, else lat-long where about 2:1 and a cube where 6:1, else None."""
    said = header.get(LAYOUT)
    if said in REPRESENTATIONS:
        return str(said)
    height, width = picture.shape[:2]
    if width == 6 * height:
        return Cube.name
    if width == height == 1:
        return LatLong.name  # a constant
    return LatLong.name if 1.5 <= width / height <= 2.5 else None


def convert(source: Map, to: str, size: int | None = None, view: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Map:
    """The map in another representation. size: width of the lat-long, of a face, of one paraboloid map, of the sphere map;
    default: as many texels as the source. view: of sphere maps."""
    return REPRESENTATIONS[to].of(source, size, view)


def _subsamples(texel: float, spacing: float) -> int:
    """Sub-samples a side of a texel [rad] so that they lie at most 0.4 of the source's spacing apart."""
    return 1 if np.isinf(spacing) else int(np.clip(np.ceil(texel / (0.4 * spacing)), 2, 64))


def _in_bands(source: Map, directions: Float) -> Float:
    flat = directions.reshape(-1, 3)
    bands = [source.lookup(flat[i : i + _BAND]) for i in range(0, len(flat), _BAND)]
    return np.concatenate(bands).reshape(*directions.shape[:-1], -1) if bands else np.zeros((*directions.shape[:-1], 3))


def _require(fits: bool, name: str, picture: NDArray, expected: str) -> None:
    height, width = picture.shape[:2]
    if not fits or height < 1:
        raise EvalsuiteError(f"the map as {name}", f"{width} × {height} texels", expected, "give --from what it is")


def _border(header: Header, size: int) -> float:
    try:
        border = float(header.get(BORDER, 0.0))
    except (TypeError, ValueError):
        border = np.nan
    if not 0.0 <= border <= size / 4:
        raise EvalsuiteError("the map", f"the header {BORDER} = {header[BORDER]!r}", f"texels, from 0 to {size / 4:g}")
    return border
