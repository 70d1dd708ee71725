"""Where on the object: named sets of its pixels, from what the camera sees, from the light it is reached by, and from the
reference. They overlap: a pixel is in every region that it belongs to.

A technique that filters a cube map errs where the faces meet. Which part of the map a pixel looks at is its normal n on a
diffuse material, else the mirror direction **r = 2(n·v)n − v**. Cube maps have their faces along the world's axes, however the
environment is turned (`math.cubemap`). For a direction d with magnitudes a ≥ b ≥ c, |d| = 1, the angle to the face's centre is
**acos a**, to the nearest edge **asin((a − b)/√2)**, to the nearest corner **acos((a + b + c)/√3)**.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from evalsuite.math.phong import reflect

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: A pixel's box filter and sub-samples mix two surfaces; screen-space derivatives, of 2 × 2 pixels, carry that two pixels on.
SILHOUETTE_PIXELS = 3.0
#: Two neighbouring pixels lie on two surfaces where the second is off the first's tangent plane by this many pixel widths …
STEP_PIXELS = 3.0
#: … or where their normals are this far apart [degrees].
CREASE_DEG = 30.0
GRAZING = 0.3  # n·v
#: Angles [degrees] from an edge, a corner and the centre of a face: 15, 6 and 10 % of all directions.
EDGE_DEG, CORNER_DEG, CENTRE_DEG = 5.0, 10.0, 15.0
HIGHLIGHT_PERCENTILE = 99.0
#: Regions have these numbers, from 1, and the outline of the largest blob the next one. Of several that a pixel is in, a picture
#: shows the first.
ORDER = (
    "highlight", "silhouette", "penumbra", "umbra", "face-corner", "face-edge", "grazing", "face-centre", "unshadowed",
)  # fmt: skip
OUTLINE = len(ORDER) + 1
#: Below the first part of the lights' light a pixel is in the umbra, above the second it is unshadowed.
UMBRA, UNSHADOWED = 0.01, 0.99


@dataclass(frozen=True, eq=False)
class Surfaces:
    """What a cell's pixels show. normal: (H, W, 3) unit, world. position: (H, W, 3) [world units]. material: (H, W) index of the
    one that covers most. eye: (3,) the camera's place. about_normal: (H, W) bool, where the technique looks its map up at n and
    not at r; None where it looks up no map of directions. visible: (H, W) part of the area lights' light that arrives."""

    normal: NDArray[np.float32]
    position: NDArray[np.float32]
    material: NDArray[np.int32]
    eye: Float
    about_normal: Mask | None = None
    visible: NDArray[np.float32] | None = None  # None without area lights, or without visibility

    @property
    def to_view(self) -> Float:
        """v, (H, W, 3) unit."""
        away = np.asarray(self.eye, np.float64) - self.position
        return away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-300)

    @property
    def n_dot_v(self) -> Float:
        """(H, W)."""
        return (self.to_view * self.normal).sum(-1)

    @property
    def looked_up(self) -> Float | None:
        """Direction at which the technique looks its map up, (H, W, 3), or None."""
        if self.about_normal is None:
            return None
        return np.where(self.about_normal[..., None], self.normal, reflect(self.to_view, self.normal))


def face_angles(directions: ArrayLike) -> tuple[Float, Float, Float]:
    """Angles [degrees] of directions (..., 3), of any length, to the nearest face centre, edge and corner of a cube along the
    axes."""
    d = np.sort(np.abs(np.asarray(directions, np.float64)), axis=-1)
    c, b, a = np.moveaxis(d / np.maximum(np.linalg.norm(d, axis=-1, keepdims=True), 1e-300), -1, 0)
    centre, edge = np.arctan2(np.hypot(b, c), a), np.arcsin(np.clip((a - b) / np.sqrt(2.0), 0.0, 1.0))
    corner = np.arccos(np.clip((a + b + c) / np.sqrt(3.0), -1.0, 1.0))
    return np.degrees(centre), np.degrees(edge), np.degrees(corner)


def masks(surfaces: Surfaces, inside: Mask, luminance: ArrayLike) -> dict[str, Mask]:
    """Name → (H, W) bool within the object mask `inside`; those without a pixel are left out. luminance: (H, W), whose
    brightest 1 % are the highlight."""
    regions = {
        "silhouette": inside & silhouette(surfaces, inside),
        "grazing": inside & (surfaces.n_dot_v < GRAZING),
    }
    directions = surfaces.looked_up
    if directions is not None:
        centre, edge, corner = face_angles(directions)
        regions |= {
            "face-centre": inside & (centre < CENTRE_DEG),
            "face-edge": inside & (edge < EDGE_DEG) & (corner >= CORNER_DEG),
            "face-corner": inside & (corner < CORNER_DEG),
        }
    regions["highlight"] = _brightest(np.asarray(luminance), inside)
    if surfaces.visible is not None:
        umbra, unshadowed = surfaces.visible < UMBRA, surfaces.visible > UNSHADOWED
        regions |= {
            "umbra": inside & umbra,
            "penumbra": inside & ~umbra & ~unshadowed,
            "unshadowed": inside & unshadowed,
        }
    return {name: region for name, region in regions.items() if region.any()}


def picture(regions: Mapping[str, Mask], blob: Mask | None, shape: tuple[int, int]) -> NDArray[np.float32]:
    """(H, W): which regions each pixel is in, Σ 2^(k−1) over their numbers k in ORDER; OUTLINE is the blob's inner border."""
    sets = np.zeros(shape, np.int32)
    for number, name in enumerate(ORDER, 1):
        if name in regions:
            sets[regions[name]] |= 1 << (number - 1)
    if blob is not None:
        sets[blob & ~ndimage.binary_erosion(blob)] |= 1 << (OUTLINE - 1)
    return sets.astype(np.float32)


def first(sets: ArrayLike) -> NDArray[np.float32]:
    """(H, W): the number a pixel of `picture` has the colour of: OUTLINE on the outline, else the first it is in, 0 in none."""
    sets = np.asarray(sets).astype(np.int64)
    lowest = np.log2(np.maximum(sets & -sets, 1)) + 1.0
    return np.where(sets >> (OUTLINE - 1) & 1, OUTLINE, np.where(sets > 0, lowest, 0.0)).astype(np.float32)


def silhouette(surfaces: Surfaces, inside: Mask) -> Mask:
    """(H, W): within SILHOUETTE_PIXELS of the mask's border, or of a jump from one surface to another: of material, in depth
    (off the tangent plane) or in the normal."""
    near = ndimage.distance_transform_edt(inside) <= SILHOUETTE_PIXELS if not inside.all() else np.zeros_like(inside)
    n, p = surfaces.normal.astype(np.float64), surfaces.position.astype(np.float64)
    distance, width = np.linalg.norm(p - surfaces.eye, axis=-1), pixel_width(surfaces, inside)
    jump = np.zeros_like(inside)
    for axis in (0, 1):
        one = (slice(None),) * axis + (slice(None, -1),)
        two = (slice(None),) * axis + (slice(1, None),)
        both, between = inside[one] & inside[two], p[two] - p[one]
        off = np.maximum(np.abs((between * n[one]).sum(-1)), np.abs((between * n[two]).sum(-1)))
        step = off > STEP_PIXELS * width * np.minimum(distance[one], distance[two])
        crease = (n[one] * n[two]).sum(-1) < np.cos(np.radians(CREASE_DEG))
        found = both & (step | crease | (surfaces.material[one] != surfaces.material[two]))
        jump[one] |= found
        jump[two] |= found
    if jump.any():
        near |= ndimage.distance_transform_edt(~jump) <= SILHOUETTE_PIXELS - 1.0  # the jump's own pixels are at 0
    return near


def pixel_width(surfaces: Surfaces, inside: Mask) -> float:
    """Angle between neighbouring pixels [rad]: the median over the mask, 0 where no two are neighbours."""
    v, both = surfaces.to_view, inside[:, :-1] & inside[:, 1:]
    return float(np.median(np.linalg.norm(v[:, 1:] - v[:, :-1], axis=-1)[both])) if both.any() else 0.0


def _brightest(luminance: NDArray, inside: Mask) -> Mask:
    """The brightest 1 % within the mask. Where more than twice as many share the limit's value (a picture of flat parts), only
    those above it; none where it is the largest."""
    values = luminance[inside]
    limit = np.percentile(values, HIGHLIGHT_PERCENTILE, method="higher")
    found = inside & (luminance >= limit)
    return found if found.sum() <= 0.02 * values.size + 1 else inside & (luminance > limit)
