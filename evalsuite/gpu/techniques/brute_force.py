"""The shader-side oracle: the reflection integral itself, by importance sampling in the fragment shader.

Half of the directions come from the lat-long map (luminance × solid angle of its bilinear cells), half from the BRDF's
lobes; the balance heuristic joins them. It draws from the map, not from a cubemap, and is unbiased.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import SAMPLING, Float, Frame, Parameter, Prepared, Settings, StandsFor, Technique
from evalsuite.math import phong
from evalsuite.math.sphere import latlong_lookup, latlong_to_direction
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

_DIFFUSE, _PHONG, _BLINN_PHONG = 0, 1, 2


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The map and its sampling tables."""
    return Prepared({**env.uniforms, "map_has_energy": env.has_energy}, {"env_latlong": env.latlong, **env.sampling})


def rounds(settings: Settings, subsamples: int) -> int:
    """Passes a sub-sample. llvmpipe leaves any shader's loops after 65535 turns in all, and a pair takes up to 30 (two
    binary searches); many short passes also keep a GPU's watchdog calm."""
    return max(1, -(-_pairs(settings, subsamples) // 1024))


def _pairs(settings: Settings, subsamples: int) -> int:
    pairs = settings["samples"] // (2 * subsamples)
    if pairs < 2:
        raise EvalsuiteError("brute-force, parameter samples", str(settings["samples"]),
                             f"at least {4 * subsamples} with {subsamples} sub-samples a pixel",
                             "raise samples or lower the supersampling")  # fmt: skip
    return pairs


def per_pass(frame: Frame, settings: Settings) -> dict[str, object]:
    """How many pairs of directions this pass takes, and its own stream of random numbers."""
    pairs = _pairs(settings, frame.subsamples) // frame.rounds
    return {"pairs": pairs, "stream": (frame.seed * 65536 + frame.index) & 0x7FFFFFFF}


def _uniforms(kind: int):
    def uniforms(material: Material, settings: Settings) -> dict[str, object]:
        own = common.diffuse_uniforms if kind == _DIFFUSE else common.lobe_uniforms
        return {**own(material, settings), "brdf": kind}

    return uniforms


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Midpoint quadrature of f(l, v) L(l) (n·l)₊ over settings["cells"] (default 4) × 4 points per bilinear cell."""
    height, width = environment.radiance.shape[:2]
    k = settings.get("cells", 4)
    rows, columns = max(height - 1, 1) * k, width * k
    v, u = (np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns
    local = latlong_to_direction(u[None, :], v[:, None]).reshape(-1, 3)
    edge = np.cos(np.pi * np.arange(rows + 1) / rows)
    solid_angle = np.repeat((edge[:-1] - edge[1:]) * 2.0 * np.pi / columns, columns)
    radiance = latlong_lookup(environment.radiance, local) * solid_angle[:, None]
    to_light = local @ np.asarray(environment.to_world, np.float64).T
    out = np.empty((len(normals), 3))
    for i, (n, w) in enumerate(zip(normals, to_view, strict=True)):
        glossy, matte = _integrand(n, w, to_light, material)
        out[i] = common.rgb(material.get("specular_reflectance", 1.0)) * (glossy @ radiance)
        out[i] += common.rgb(material.get("reflectance", material.get("diffuse_reflectance", 0.0))) * (matte @ radiance)
    return out


def _integrand(normal: Float, to_view: Float, to_light: Float, material: Settings) -> tuple[Float, Float]:
    """BRDF × (n·l)₊ of the glossy and the diffuse part, each for unit reflectance, (D,)."""
    cosine = np.maximum(to_light @ normal, 0.0)
    matte = cosine / np.pi
    if "reflectance" in material:
        return np.zeros_like(matte), matte
    if settings_plugin(material) == "phong":
        lobe = phong.phong_lobe(material["exponent"], to_light @ phong.reflect(to_view, normal))
        return lobe * (cosine > 0), matte
    half_vector = to_light + to_view
    half_vector /= np.maximum(np.linalg.norm(half_vector, axis=-1, keepdims=True), 1e-30)
    return phong.blinn_phong_brdf(material["exponent"], half_vector @ normal) * cosine, matte


def settings_plugin(material: Settings) -> str:
    """Which lobe a twin's material parameters mean: their "plugin" entry, blinnphong without one."""
    return str(material.get("plugin", "blinnphong"))


TECHNIQUE = Technique(
    id="brute-force",
    title="Brute-force integral in the shader",
    paper="evalsuite's own oracle; multiple importance sampling after Veach and Guibas 1995",
    equations="L_o = ∫ f(l, v) L(l) (n·l)₊ dl",
    parameters=(
        *common.bsdf_parameters("phong"),
        Parameter("samples", 256, "directions a pixel in all, over its sub-samples", "technique",
                  common.integer(4, 1 << 24), "a whole number from 4"),
    ),
    assumptions=(
        "The environment is distant and nothing occludes it.",
        "None beyond the reference's own: what remains is noise.",
    ),
    stands_for={
        "diffuse": StandsFor("diffuse as it is", _uniforms(_DIFFUSE)),
        "phong": StandsFor("phong as it is", _uniforms(_PHONG)),
        "blinnphong": StandsFor("blinnphong as it is", _uniforms(_BLINN_PHONG)),
    },
    target_bsdf=common.named_target,
    shader=Path(__file__).with_suffix(".glsl"),
    prepare=prepare,
    twin=twin,
    random=True,
    rounds=rounds,
    per_pass=per_pass,
    left=SAMPLING,
)  # fmt: skip
