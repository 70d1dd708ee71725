"""Mirror reflection by one cubemap look-up (Heidrich, course notes §2.2)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, mirror
from evalsuite.gpu.techniques.base import SAMPLING, Float, Parameter, Settings, Technique
from evalsuite.math import phong
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) times the bilinear look-up in level 0 about r."""
    cube = common.twin_cube(environment, settings["face_size"])
    return mirror.factor(normals, to_view, material) * cube.bilinear(phong.reflect(to_view, normals), 0)


TECHNIQUE = Technique(
    id="mirror-cube",
    title="Mirror, cube map",
    paper="Heidrich: Environment Maps and Their Applications (course notes), §2.2",
    equations="r = 2(n·v)n − v; L = F(n·v) · texture(env, r)",
    parameters=(
        mirror.SPECULAR_REFLECTANCE,
        Parameter("filter", "finest", "finest: bilinear in level 0; hardware: trilinear at the hardware's own λ", "technique",
                  common.choice("finest", "hardware"), "finest or hardware"),
        mirror.FACE_SIZE,
    ),
    assumptions=(
        mirror.DISTANT,
        "A bilinear look-up in cube texels resembles one in the map's own.",
    ),
    stands_for=mirror.STANDS_FOR,
    target_bsdf=mirror.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=common.prepare_cube,
    twin=twin,
    twin_settings={"face_size": 64},
    defines=lambda settings: {"HARDWARE_LOD": 1} if settings["filter"] == "hardware" else {},
    fill=mirror.fill_face_size,
    lifts=mirror.lifted(twin),
    left=SAMPLING,
)  # fmt: skip
