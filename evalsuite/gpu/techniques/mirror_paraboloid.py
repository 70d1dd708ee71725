"""Mirror reflection by dual paraboloid maps in one pass (Heidrich, course notes §2.3)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import dual_paraboloid, mirror
from evalsuite.gpu.techniques.base import SAMPLING, Float, Settings, Technique
from evalsuite.math import phong
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) times α · front + (1 − α) · back, bilinear look-ups in level 0 about r."""
    r = phong.reflect(to_view, normals)
    front, back = dual_paraboloid.twin_maps(environment, r, settings, ring=0.0)
    alpha = front[:, 3:]
    return mirror.factor(normals, to_view, material) * (alpha * front[:, :3] + (1.0 - alpha) * back[:, :3])


TECHNIQUE = Technique(
    id="mirror-paraboloid",
    title="Mirror, dual paraboloid maps in one pass",
    paper="Heidrich: Environment Maps and Their Applications (course notes), §2.3",
    equations="Eq 1–12: (s, t, 1, 1) = T·P·S·M⁻¹·(r, 1); L = F(n·v) · (α · front + (1 − α) · back), S forming d₀ + r",
    parameters=(mirror.SPECULAR_REFLECTANCE, dual_paraboloid.FILTER, dual_paraboloid.MAP_SIZE, dual_paraboloid.BORDER),
    assumptions=(
        mirror.DISTANT,
        "A bilinear look-up in texels that are equal on the paraboloid resembles one in the map's own.",
        "Where the maps meet, blending them over one texel hides the seam.",
    ),
    stands_for=mirror.STANDS_FOR,
    target_bsdf=mirror.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("paraboloid.glsl",),
    twin_settings={"map_size": 128},
    prepare=lambda env, settings, scene: dual_paraboloid.prepare(env, settings, ring=0.0),
    twin=twin,
    defines=dual_paraboloid.defines,
    fill=dual_paraboloid.fill,
    lifts=mirror.lifted(twin),
    left=SAMPLING,
)
