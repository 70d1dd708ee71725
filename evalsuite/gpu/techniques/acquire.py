"""An environment map of the object's real surroundings, drawn anew in each frame (Kautz, Daubert, Seidel §5.1)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import cubemap, phong, sh
from evalsuite.math.probe import SH_FACE_SIZE
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

FRAMES = 4  # that acquisition is timed over; the first warms caches and does not count


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size, and the middle of the subject's bounding box as the probe's place (Kautz et al.: the object's centre)."""
    filled = common.fill_face_size(scene, settings)
    if settings["position"] is None:
        named = {i for i in scene.used_materials if scene.materials[i].id in scene.subject}
        of = named or TECHNIQUE.scored_materials(scene)
        points = np.concatenate([mesh.positions for mesh in scene.meshes if mesh.material in of])
        filled["position"] = tuple(float(c) for c in 0.5 * (points.min(axis=0) + points.max(axis=0)).astype(np.float64))
    return filled


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The six faces from the probe's place, their MIPs and L_i, as often as it takes to time one frame."""
    from evalsuite.gpu.probe.faces import Probe

    if scene.room is None:
        raise EvalsuiteError(scene.path, "a scene without a room", "one that names its real surroundings",
                             'add <default name="room" value="FILE.xml"/>')  # fmt: skip
    probe = Probe(scene.room, settings["face_size"], settings["light"] == "direct")
    frame_ms = float(np.mean([probe.draw(settings["position"]) for _ in range(FRAMES)][1:]))
    uniforms = {
        "env_face_size": float(probe.face_size),
        "env_max_level": float(probe.cube.max_level),
        "sh": probe.coefficients,
    }
    notes = [_note(settings, scene)]
    if (covered := probe.coverage()) < 1.0 - 1e-4:
        notes.append(f"the room leaves {1 - covered:.1%} of the sphere open around the probe, which counts as black")
    seen = {"position": settings["position"], "faces": probe.cube.level0}
    return Prepared(uniforms, {"env_cube": probe.texture}, notes=tuple(notes), frame_ms=frame_ms, probe=seen)


def _note(settings: Settings, scene: Scene) -> str:
    place = ", ".join(f"{c:.3g}" for c in settings["position"])
    light = (
        "lamps unshadowed, without interreflection"
        if settings["light"] == "direct"
        else f"light baked by Mitsuba with {scene.room.spp} paths a sample (standard error {scene.room.standard_error:.1%})"
    )
    triangles, size = len(scene.room.corners), settings["face_size"]
    return f"probe at ({place}): six faces of {size}² from {triangles} one-sided triangles; {light}"


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Ray-cast faces of settings["room"] in float64, then (k_d/π) Σ Â_i L_i Y_i(n) + k_s · trilinear look-up about r."""
    from evalsuite.gpu.probe import twin as probe

    faces = probe.faces(settings["room"], settings["position"], settings["face_size"], settings["light"] == "direct")
    cube = cubemap.SeamlessCube(cubemap.box_mips(faces))
    small = next(level for level in cube.levels if level.shape[1] <= SH_FACE_SIZE)
    diffuse = material.get("reflectance", material.get("diffuse_reflectance", 0.0))
    out = np.asarray(common.rgb(diffuse)) / np.pi * sh.irradiance(sh.project_cube(small), normals)
    if "exponent" in material:
        radiance = cube.lookup(phong.reflect(to_view, normals), phong.exponent_to_lod(material["exponent"], cube.width))
        out += np.asarray(common.rgb(material.get("specular_reflectance", 1.0))) * radiance
    return out


def _matte(material: Material, settings: Settings) -> dict[str, object]:
    return {**common.diffuse_uniforms(material, settings), "specular_reflectance": (0.0, 0.0, 0.0)}


def _position(value: object) -> tuple[float, float, float]:
    values = [float(x) for x in (value.replace(",", " ").split() if isinstance(value, str) else value)]
    if len(values) != 3 or not np.isfinite(values).all():
        raise ValueError(value)
    return values[0], values[1], values[2]


TECHNIQUE = Technique(
    id="acquire",
    title="Environment map drawn from the real room in each frame",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §5.1",
    equations="six 90° views → cubemap; L_d by Eq 11–12 from 8 × 8 texels a face, L_p by the MIP level of McGuire's Eq 12",
    parameters=(
        *common.bsdf_parameters("diffuse"),
        Parameter("light", "baked", "light on the room's surfaces: 'baked' by Mitsuba once for each place of the lamps, with "
                  "interreflection; 'direct' from the lamps in each frame, unshadowed", "technique",
                  common.choice("baked", "direct"), "baked or direct"),
        Parameter("position", None, "the probe's place, \"x y z\"; default: the middle of the subject's bounding box",
                  "technique", _position, "three numbers"),
        common.FACE_SIZE,
    ),
    assumptions=(
        "What is seen from one point, the object's middle, is seen from all of its surface: no parallax.",
        "The object itself, its shadow and its reflection are not in the probe.",
        "The room's surfaces are diffuse, and their light is linear over a lattice of a 32nd of the room.",
        "light=direct: no shadows and no interreflection in the room.",
        "Nine harmonics hold the irradiance; a trilinear look-up about r stands for the glossy lobe.",
    ),
    stands_for={
        "diffuse": StandsFor("reflectance as it is, by SH9", _matte),
        "phong": StandsFor("phong's exponent N as s, its diffuse part by SH9", common.lobe_uniforms),
        "blinnphong": StandsFor("blinnphong's exponent s as it is, its diffuse part by SH9", common.lobe_uniforms),
    },
    target_bsdf=common.named_target,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("sh.glsl", "mcguire.glsl"),
    prepare=prepare,
    twin=twin,
    target="near-field",
    within_room=True,
    twin_bound=5e-4,
    twin_bound_reason="a sample on an edge between two surfaces of the room falls to either: 1/16 of a texel",
    twin_settings={"face_size": 16},
    fill=fill,
)  # fmt: skip
