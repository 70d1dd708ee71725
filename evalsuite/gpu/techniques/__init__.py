"""The techniques: one visible table. Importable without OpenGL; each lives in <id>.py with its shader <id>.glsl beside it."""

from __future__ import annotations

from collections.abc import Mapping

from evalsuite.gpu.techniques import (
    acquire,
    brute_force,
    diffuse_map,
    diffuse_sh9,
    diffuse_sh9_windowed,
    diffuse_topmip,
    fresnel_add,
    fresnel_blend,
    fresnel_mirror,
    glossy_boxmip,
    glossy_boxmip_lod,
    glossy_boxmip_seamless,
    glossy_hierarchical,
    glossy_isotropic_3d,
    glossy_mcguire,
    glossy_phong_map,
    glossy_warped,
    kautz_combined,
    mcguire_combined,
    mirror_cube,
    mirror_paraboloid,
    mirror_paraboloid_2pass,
    mirror_sphere,
    npr_cool_warm,
    npr_hatching,
    npr_silhouette,
    npr_sketch,
    shadow_none,
    shadow_pcss,
    shadow_sampled,
    shadow_wedges,
    split_sum,
)
from evalsuite.gpu.techniques.base import Technique

TECHNIQUES: Mapping[str, Technique] = {
    technique.id: technique
    for technique in (
        mirror_sphere.TECHNIQUE,
        mirror_cube.TECHNIQUE,
        mirror_paraboloid.TECHNIQUE,
        mirror_paraboloid_2pass.TECHNIQUE,
        diffuse_map.TECHNIQUE,
        diffuse_sh9.TECHNIQUE,
        diffuse_topmip.TECHNIQUE,
        glossy_phong_map.TECHNIQUE,
        glossy_boxmip.TECHNIQUE,
        glossy_boxmip_lod.TECHNIQUE,
        glossy_boxmip_seamless.TECHNIQUE,
        glossy_mcguire.TECHNIQUE,
        glossy_hierarchical.TECHNIQUE,
        glossy_isotropic_3d.TECHNIQUE,
        glossy_warped.TECHNIQUE,
        fresnel_mirror.TECHNIQUE,
        fresnel_add.TECHNIQUE,
        fresnel_blend.TECHNIQUE,
        kautz_combined.TECHNIQUE,
        mcguire_combined.TECHNIQUE,
        acquire.TECHNIQUE,
        npr_sketch.TECHNIQUE,
        npr_cool_warm.TECHNIQUE,
        npr_silhouette.TECHNIQUE,
        npr_hatching.TECHNIQUE,
        shadow_none.TECHNIQUE,
        shadow_wedges.TECHNIQUE,
        shadow_sampled.TECHNIQUE,
        shadow_pcss.TECHNIQUE,
        split_sum.TECHNIQUE,
        diffuse_sh9_windowed.TECHNIQUE,
        brute_force.TECHNIQUE,
    )
}
