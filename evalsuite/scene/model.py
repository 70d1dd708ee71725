"""The one scene description that both renderers draw: plain frozen dataclasses, no Mitsuba, no OpenGL.

Conventions (all as in Mitsuba): world is right-handed; a camera looks along its local +z with +y up and +x to the
image's left; images are (H, W, 3), row 0 at the top, linear Rec.709; `to_view` and `to_light` point away from the surface.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError

Rgb = tuple[float, float, float]

#: Id of the BSDF that reports bind and score.
SUBJECT = "subject"

#: BSDF plugins that the GPU side can draw, and the parameters under which `scene.load` files them.
DRAWABLE: Mapping[str, tuple[str, ...]] = {
    "diffuse": ("reflectance",),
    "conductor": ("specular_reflectance", "eta", "k"),
    "roughconductor": ("specular_reflectance", "eta", "k", "alpha", "distribution"),
    "phong": ("specular_reflectance", "diffuse_reflectance", "exponent"),
    "blinnphong": ("specular_reflectance", "diffuse_reflectance", "exponent"),
    "kautz": ("fresnel_normal", "diffuse_reflectance", "exponent"),
    "fresnelmirror": ("eta", "diffuse_reflectance", "combine"),
    "plastic": ("eta", "diffuse_reflectance", "specular_reflectance", "nonlinear"),
    "roughplastic": ("eta", "diffuse_reflectance", "specular_reflectance", "nonlinear", "alpha", "distribution"),
    "npr": ("style", "viewer", "cool", "warm", "width", "strokes"),
}


#: A binding's value for a parameter that keeps what the scene's own BSDF has there (a bitmap, say).
OWN = "<own>"
#: Names of one quantity: a `diffuse`'s albedo is the `diffuse_reflectance` of a BSDF with another lobe besides.
ALBEDO = ("reflectance", "diffuse_reflectance")


def own_name(key: str, has: Container[str]) -> str | None:
    """What a scene's own BSDF, which has these parameters, calls the parameter `key`; None where it has none such."""
    names = (key, *(ALBEDO if key in ALBEDO else ()))
    return next((name for name in names if name in has), None)


@dataclass(frozen=True)
class SceneSource:
    """What decides a scene before anything is loaded: small, picklable, hashable by `store`.

    path: the Mitsuba XML file. environment: a lat-long .exr/.hdr that replaces the scene's environment, or None.
    size: (width, height) in pixels that replaces the film's, or None. bindings: BSDF id → Mitsuba plugin dictionary of
    plain values (`{"type": "phong", "exponent": 50.0, "specular_reflectance": (1, 1, 1)}`) that replaces that BSDF in
    both renderers. repair_environment: replace NaN/Inf texels (with a warning) instead of raising. defines: values of the
    parameters that the XML leaves open (`<default name="x" value="0"/>`), other than their defaults.
    """

    path: Path
    environment: Path | None = None
    size: tuple[int, int] | None = None
    bindings: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    repair_environment: bool = False
    defines: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Camera:
    """Perspective pinhole camera. to_world: (4, 4) float64, camera → world. fov_x_deg: horizontal field of view of the
    full film [degrees]. film: (width, height) of the full film, crop: (x, y, width, height) of the picture within it
    [pixels]; the picture has the crop's size. principal_point: offset of the principal point as a fraction of the film,
    positive moves the content left/up. near, far: clipping distances along the viewing axis [world units]."""

    to_world: NDArray[np.float64]
    fov_x_deg: float
    film: tuple[int, int]
    crop: tuple[int, int, int, int]
    principal_point: tuple[float, float] = (0.0, 0.0)
    near: float = 1e-2
    far: float = 1e4

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the picture [pixels]."""
        return self.crop[2], self.crop[3]


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """positions: (V, 3) float32 world. normals: (V, 3) float32 unit shading normals (flat-shaded meshes are unwelded, so
    that each triangle carries its own). uvs: (V, 2) float32 or None. faces: (F, 3) uint32, counter-clockwise from
    outside. material: index into `Scene.materials`."""

    name: str
    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.uint32]
    material: int
    uvs: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False)
class Texture:
    """A bitmap over a surface's uv, as Mitsuba's `bitmap` looks it up: texels: (H, W, 3) float32, linear Rec.709 reflectance
    (or raw values), texel centres at ((i + ½)/W, (j + ½)/H) of the transformed coordinates, row 0 at v = 0. to_uv: (3, 3)
    float64 transform of (u, v, 1). wrap: repeat, mirror or clamp. nearest: no interpolation. source: file it came from."""

    texels: NDArray[np.float32]
    to_uv: NDArray[np.float64]
    wrap: str = "repeat"
    nearest: bool = False
    source: str = ""

    def __str__(self) -> str:
        return f"bitmap {Path(self.source).name}".rstrip()


@dataclass(frozen=True, eq=False)
class Material:
    """One BSDF as the scene states it. id: the XML id (or `<plugin>-<n>`). plugin: Mitsuba's name, `twosided` and `normalmap`
    taken off and noted. parameters: as listed in `DRAWABLE`; colours are linear Rec.709 triples or Textures. normal_map: raw
    Texture, normal = 2 texel − 1 in the frame of ∂p/∂u and the shading normal, or None. undrawable: why the GPU side cannot
    draw it (None if it can). location: "file.xml (line 4, col 4)"."""

    id: str
    plugin: str
    parameters: Mapping[str, float | Rgb | str | bool | Texture]
    two_sided: bool = False
    undrawable: str | None = None
    location: str = ""
    normal_map: Texture | None = None

    @property
    def textures(self) -> dict[str, Texture]:
        """Its textured parameters."""
        return {name: value for name, value in self.parameters.items() if isinstance(value, Texture)}


@dataclass(frozen=True, eq=False)
class Environment:
    """Distant radiance. radiance: (H, W, 3) float32 [W m⁻² sr⁻¹], lat-long in Mitsuba's `envmap` layout: texel centres in
    u (periodic), texel corners in v (row 0 is the +y pole, row H−1 the −y pole), any `scale` multiplied in. A constant
    environment is 1×1. to_world: (3, 3) float64 rotation or reflection, local → world; look-up at direction d uses
    `to_world.T @ d`. source: file or plugin it came from. notes: what was clamped or repaired, which the user
    is warned of. remarks: what else happened to the map (baked, padded), for the page."""

    radiance: NDArray[np.float32]
    to_world: NDArray[np.float64]
    source: str
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Room:
    """The real surroundings as F one-sided triangles with light on them, sampled on a lattice of each (`math.mesh_colors`):
    what the GPU side draws for a probe. corners: (F, 3, 3) float32 world, counter-clockwise from the side that is seen.
    divisions: (F,) int32 cuts of each edge. radiance, emission: (S, 3) float32 [W m⁻² sr⁻¹], all of the outgoing light and
    the part that is emitted; reflectance: (S, 3) float32, diffuse; S samples, triangle after triangle. spp: paths a sample.
    standard_error: of radiance, mean over the samples, over the mean that they reflect."""

    corners: NDArray[np.float32]
    divisions: NDArray[np.int32]
    radiance: NDArray[np.float32]
    emission: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    spp: int = 0
    standard_error: float = 0.0


@dataclass(frozen=True, eq=False)
class Scene:
    """All that both renderers draw. environment is None for scenes lit by area lights alone (which only Mitsuba draws;
    `mitsuba_only` names such elements for the page). subject: ids of the materials that reports bind and score, empty
    when the scene names none (then every drawable material counts). room_file: the Mitsuba XML of its real surroundings, or
    None; room: those with light baked onto them, where a technique asks for it (`reference.room.bake`). refused: elements no
    renderer here can draw alike (a cylinder with no tessellation, an instance, a medium …), each with its location."""

    name: str
    path: Path
    camera: Camera
    meshes: tuple[TriangleMesh, ...]
    materials: tuple[Material, ...]
    environment: Environment | None
    mitsuba_only: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    subject: tuple[str, ...] = ()
    room_file: Path | None = None
    room: Room | None = None

    @property
    def used_materials(self) -> list[int]:
        """Indices of the materials that a mesh carries, ascending."""
        return sorted({mesh.material for mesh in self.meshes if len(mesh.faces)})

    def require_drawable(self) -> None:
        """Raise EvalsuiteError naming the first element (with its line) that the GPU side cannot draw."""
        if self.refused:
            raise EvalsuiteError(
                self.path,
                self.refused[0],
                "triangle meshes (with uvs under bitmaps), a perspective camera and an envmap, constant or sunsky emitter",
                "remove it, or render with `evalsuite reference`",
            )
        for material in (self.materials[index] for index in self.used_materials):
            if material.undrawable:
                raise EvalsuiteError(
                    material.location or self.path,
                    f"{material.plugin} '{material.id}' ({material.undrawable})",
                    f"a BSDF the GPU side can draw: {', '.join(DRAWABLE)}",
                    "change it, or render the scene with `evalsuite reference` alone",
                )
        if self.environment is None:
            raise EvalsuiteError(
                self.path,
                "no envmap, constant or sunsky emitter",
                "an environment for the GPU side to light the scene with",
                "add one, or give --env FILE",
            )


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What a camera sees, averaged over the same s² sub-pixel positions in both renderers (`math.pixel.subsamples`).
    coverage: (H, W) float32 fraction of sub-samples that hit a surface.
    material: (M, H, W) float32 the same per material. depth: (H, W) float32 mean distance along the viewing axis of the
    hits [world units], 0 where none. normal: (H, W, 3) float32 mean world shading normal of the hits, normalised, turned
    towards the viewer only on two-sided back faces; 0 where none. position: (H, W, 3) float32 mean world hit position.
    background: (H, W, 3) float32 mean environment radiance along *all* sub-sample view rays, hits or not."""

    coverage: NDArray[np.float32]
    material: NDArray[np.float32]
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    position: NDArray[np.float32]
    background: NDArray[np.float32]
