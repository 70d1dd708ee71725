"""Glossy reflection from hardware's box-filtered MIPs at a LOD bias (Kautz, Daubert, Seidel §4.2, §5.2).

The bias fixes no exponent by itself: hardware's λ depends on curvature, distance and resolution. Exponent and bias are
therefore matched over a picture: mean λ + b = the level whose mean texel has the lobe's solid angle.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, lifts
from evalsuite.gpu.techniques.base import Float, Parameter, Settings, StandsFor, Technique
from evalsuite.math import cubemap, phong
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

_FIT_PIXELS = 800
_FIT_FACE_SIZE = 32


def fill(scene: Scene, settings: Settings, technique: Technique | None = None) -> dict[str, object]:
    """face_size, and whichever of bias and exponent is open from the other. technique: whose picture (this one's)."""
    filled = common.fill_face_size(scene, settings)
    face_size = filled.get("face_size", settings["face_size"])
    _, lod, mask = subject_reflection(scene, face_size, technique)
    mean = float(lod[mask].mean(dtype=np.float64)) if mask.any() else 0.0
    if "bias" not in settings["given"]:
        filled["bias"] = float(phong.exponent_to_lod(settings["exponent"], face_size)) - mean
    elif "exponent" not in settings["given"]:
        filled["exponent"] = float(phong.lod_to_exponent(mean + settings["bias"], face_size))
    return filled


def subject_reflection(scene: Scene, face_size: int, technique: Technique | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """r, λ and mask over the subject, whatever its BSDF is now; without a subject over what the technique stands for."""
    from evalsuite.gpu.reflection import reflection

    named = {i for i in scene.used_materials if scene.materials[i].id in scene.subject}
    return reflection(scene, face_size, frozenset(named) or (technique or TECHNIQUE).scored_materials(scene))


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """The lobe's colour and the bias."""
    return {"specular_reflectance": common.lobe_uniforms(material, settings)["specular_reflectance"], "bias": settings["bias"]}


def fit(scene: Scene, env: GpuEnvironment, settings: Settings, technique: Technique | None = None) -> dict[str, float] | None:
    """The Phong exponent that comes nearest to what the look-up at λ + b returned: see `fit_look_up`."""
    sampler = env.cube(settings["face_size"]).sampler
    return fit_look_up(scene, env, settings, lambda r, lod: sampler.lookup(r, lod + settings["bias"]), technique)


def fit_look_up(
    scene: Scene, env: GpuEnvironment, settings: Settings, look_up: Callable[[Float, Float], Float], technique: Technique | None
) -> dict[str, float] | None:
    """The Phong exponent whose unclipped lobe about r comes nearest to what the look-up returned, in the least squares of
    radiance over at most 800 pixels: {exponent, rel_rmse (of the mean look-up), pixels, mean_lambda}. None under a constant
    map, which every lobe fits. look_up: r (P, 3), λ (P,) → radiance (P, 3)."""
    direction, lod, mask = subject_reflection(scene, settings["face_size"], technique)
    pixels = np.flatnonzero(mask)
    if not len(pixels):
        return None
    pixels = pixels[np.unique(np.linspace(0, len(pixels) - 1, _FIT_PIXELS).astype(int))]
    r = direction.reshape(-1, 3)[pixels].astype(np.float64)
    r /= np.linalg.norm(r, axis=-1, keepdims=True)
    looked_up = look_up(r, lod.ravel()[pixels].astype(np.float64))
    mean = looked_up.mean()
    if mean <= 0 or looked_up.std(axis=0).max() < 1e-4 * mean:
        return None
    found = fit_exponent(env.cube(settings["face_size"]).sampler, r, looked_up)
    return {**found, "pixels": len(pixels), "mean_lambda": float(lod[mask].mean())}


def fit_exponent(sampler: cubemap.SeamlessCube, r: Float, looked_up: Float) -> dict[str, float]:
    """{exponent, rel_rmse} of the best-fitting lobe. sampler: the cubemap; r: (P, 3) unit; looked_up: (P, 3)."""
    level = next(level for level in sampler.levels if level.shape[1] <= _FIT_FACE_SIZE)
    width = level.shape[1]
    solid_angle = np.tile(cubemap.texel_solid_angles(width).ravel(), 6)
    # log cos once, then each exponent costs one exp; float32 holds a 1e-4 fit.
    cosine = (r @ cubemap.texel_directions(width).reshape(-1, 3).T).astype(np.float32)
    log_cosine = np.log(np.maximum(cosine, 1e-12))
    weighted = np.concatenate([level.reshape(-1, 3), np.ones((6 * width * width, 1))], axis=1) * solid_angle[:, None]
    weighted = weighted.astype(np.float32)

    def error(log_exponent: float) -> float:
        sums = np.exp(np.float32(np.exp(log_exponent)) * log_cosine) @ weighted
        # Divided by the same sum of the lobe: the coarse grid then keeps a constant map exact.
        difference = sums[:, :3] / np.maximum(sums[:, 3:], 1e-30) - looked_up
        return float(np.sqrt((difference.astype(np.float64) ** 2).mean()))

    # Lobes sharper than a texel of this grid cannot be told apart.
    sharpest = 4.0 * float(phong.lod_to_exponent(0.0, width))
    grid = np.linspace(np.log(0.25), np.log(sharpest), 10)
    errors = [error(x) for x in grid]
    best = int(np.argmin(errors))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    x, least = _golden(error, low, high, 10)
    if errors[best] < least:
        x, least = grid[best], errors[best]
    return {"exponent": float(np.exp(x)), "rel_rmse": least / float(looked_up.mean())}


def _golden(f, low: float, high: float, steps: int) -> tuple[float, float]:
    """Golden-section minimum (x, f(x)) of f over [low, high]."""
    ratio = (np.sqrt(5) - 1) / 2
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    fa, fb = f(a), f(b)
    for _ in range(steps):
        if fa < fb:
            high, b, fb = b, a, fa
            a = high - ratio * (high - low)
            fa = f(a)
        else:
            low, a, fa = a, b, fb
            b = low + ratio * (high - low)
            fb = f(b)
    return (a, fa) if fa < fb else (b, fb)


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """k_s times the trilinear look-up about r at settings["lambda"] (N,) + bias: λ belongs to pixels, not to surfaces."""
    cube = common.twin_cube(environment, settings["face_size"])
    radiance = cube.lookup(phong.reflect(to_view, normals), np.asarray(settings["lambda"]) + settings["bias"])
    return np.asarray(common.rgb(material.get("specular_reflectance", 1.0))) * radiance


TECHNIQUE = Technique(
    id="glossy-boxmip",
    title="Glossy, box-filtered MIPs at a LOD bias",
    paper="Kautz, Daubert, Seidel: Advanced Environment Mapping in VR Applications, 2004, §4.2 and §5.2",
    equations="L_p(r) = k_s · texture(env, r, bias b), level λ + b with λ the hardware's own",
    parameters=(
        common.material_parameter("exponent", 50.0, "Phong exponent N; default: from bias if given, else the subject's own"),
        common.material_parameter("specular_reflectance", common.WHITE, "k_s, the lobe's integral"),
        Parameter("bias", None, "LOD bias b [levels]; default: mean λ + b is the level whose mean texel has the lobe's solid "
                  "angle 2π/(N + 1)", "technique", common.number(-32, 32), "a number of MIP levels"),
        common.FACE_SIZE,
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "A box in texture space stands for a cosine-power lobe, and one width for all pixels whatever their λ.",
        "Each face is filtered by itself, so that faces show at large b.",
        "The tangent plane cuts nothing off the lobe.",
    ),
    stands_for={
        "phong": StandsFor("k_s as it is; N and b matched by solid angle over the picture", uniforms, common.no_diffuse_part)
    },
    target_bsdf=common.lobe_target("phong"),
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=common.prepare_cube,
    twin=twin,
    twin_settings={"face_size": 32},
    resolves=True,
    fill=fill,
    fit=fit,
    lifts=lambda settings: lifts.of_box_mips(twin, lifts.exact_glossy),
    represented=lifts.as_cube,
    free=(common.FREE_BIAS,),
)  # fmt: skip
