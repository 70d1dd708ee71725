"""A dielectric's mirror reflection alone (Heidrich, course notes, §3.1.1): a cubemap look-up weighted by the Fresnel term."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, dielectric
from evalsuite.gpu.techniques.base import SAMPLING, Float, Settings, StandsFor, Technique
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) times the bilinear look-up in level 0 about r."""
    return dielectric.twin_parts(environment, normals, to_view, material, settings)[1]


LIFTS = dielectric.lifted(lambda weight, mirror, matte, material: mirror, matte=False)


TECHNIQUE = Technique(
    id="fresnel-mirror",
    title="Fresnel-weighted mirror",
    paper=dielectric.PAPER,
    equations="Eq 13: F = ½ (g−c)²/(g+c)² [1 + (c(g+c)−1)²/(c(g−c)+1)²], c = n·v, g² = η² + c² − 1; L = F · texture(env, r)",
    parameters=(dielectric.ETA, dielectric.FACE_SIZE),
    assumptions=(
        dielectric.DISTANT,
        dielectric.LOOK_UP,
        "F outside the integral is exact here: a mirror sees one direction.",
    ),
    stands_for={
        "fresnelmirror": StandsFor("fresnelmirror as it is, F(n·v) of its η", dielectric.uniforms, common.no_diffuse_part)
    },
    target_bsdf=dielectric.target("add"),
    shader=Path(__file__).with_suffix(".glsl"),
    library=("dielectric.glsl",),
    prepare=common.prepare_cube,
    twin=twin,
    twin_settings=dielectric.TWIN_SETTINGS,
    fill=dielectric.fill,
    lifts=lambda settings: LIFTS,
    left=SAMPLING,
)  # fmt: skip
