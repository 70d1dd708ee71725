"""Mirror reflection by dual paraboloid maps in two passes with an alpha test (Heidrich and Seidel 1998, §5)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.gpu.techniques import common, dual_paraboloid, mirror
from evalsuite.gpu.techniques.base import SAMPLING, Float, Parameter, Settings, Technique
from evalsuite.math import phong
from evalsuite.scene.model import Environment


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """F(n·v) times the last map whose alpha, in 8 bits, is 1 about r; black where neither is."""
    r = phong.reflect(to_view, normals)
    radiance = np.zeros((len(r), 3))
    for texel in dual_paraboloid.twin_maps(environment, r, settings, settings["ring"]):
        drawn = np.round(255.0 * texel[:, 3]) == 255
        radiance[drawn] = texel[drawn, :3]
    return mirror.factor(normals, to_view, material) * radiance


TECHNIQUE = Technique(
    id="mirror-paraboloid-2pass",
    title="Mirror, dual paraboloid maps in two passes",
    paper="Heidrich, Seidel: View-independent Environment Maps, 1998, §5",
    equations="§5: (s, t, 1, 1) = T·P·S·M⁻¹·(r, 1); each map drawn where its alpha equals 1, the back one last",
    parameters=(
        mirror.SPECULAR_REFLECTANCE,
        dual_paraboloid.FILTER,
        dual_paraboloid.MAP_SIZE,
        dual_paraboloid.BORDER,
        Parameter("ring", 2.0, "texels beyond the circle whose alpha is 1 too; below √2 bilinear alpha leaves gaps between the "
                  "maps", "technique", common.number(0.0, 64.0), "a number of texels from 0 to 64"),
    ),
    assumptions=(
        mirror.DISTANT,
        "A bilinear look-up in texels that are equal on the paraboloid resembles one in the map's own.",
        "The ring covers what filtering takes from alpha at the rim. Plain MIPs average alpha too: from λ ≈ 1 on a gap is left.",
    ),
    stands_for=mirror.STANDS_FOR,
    target_bsdf=mirror.target_bsdf,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("paraboloid.glsl",),
    twin_settings={"map_size": 128},
    prepare=lambda env, settings, scene: dual_paraboloid.prepare(env, settings, settings["ring"]),
    twin=twin,
    defines=dual_paraboloid.defines,
    layers=lambda settings: ({"HEMISPHERE": 0}, {"HEMISPHERE": 1}),
    fill=dual_paraboloid.fill,
    lifts=mirror.lifted(twin),
    left=SAMPLING,
)  # fmt: skip
