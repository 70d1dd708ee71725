"""A decomposed environment as what the shadow techniques' shaders read: lights, and the prefiltered rest."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import environment
from evalsuite.gpu.environment import GpuEnvironment
from evalsuite.gpu.prefilter.lobe_map import lobe_map
from evalsuite.gpu.techniques.glossy_phong_map import default_face_size
from evalsuite.lights import decompose
from evalsuite.lights.model import DecompositionSettings
from evalsuite.scene.model import Environment, Scene

DIFFUSE_FACE_SIZE = 64


@dataclass(frozen=True, eq=False)
class Lighting:
    """L lights at infinity and the ambient rest. directions: (L, 3) unit, world, to the centres. radii: (L,) angular [rad].
    irradiances: (L, 3), of all a light's radiance from its centre at normal incidence [W m⁻²]. uniforms, textures, defines: of
    library/lighting.glsl. prepare_ms: decomposition and prefiltering, once an environment."""

    directions: NDArray[np.float64]
    radii: NDArray[np.float64]
    irradiances: NDArray[np.float64]
    uniforms: Mapping[str, object]
    textures: Mapping[str, object]
    defines: Mapping[str, object]
    prepare_ms: float
    notes: tuple[str, ...]


def lighting(env: GpuEnvironment, settings: Mapping[str, object], scene: Scene) -> Lighting:
    """The environment's lights and the prefiltered remainder. Raises EvalsuiteError."""
    start = time.perf_counter()
    chosen = DecompositionSettings.of(settings)
    found = env.kept(("decomposition", chosen), lambda: decompose.of(env.environment, chosen))
    elapsed = 1e3 * (time.perf_counter() - start)
    own = env.environment
    rest = environment.of(Environment(found.remainder, own.to_world, f"remainder of {own.source}"))
    textures, ambient_ms = ambient(rest, scene)
    directions = np.array([own.to_world @ light.direction for light in found.lights]).reshape(-1, 3)
    irradiances = np.array([light.irradiance for light in found.lights]).reshape(-1, 3)
    uniforms = {}
    if len(directions):
        uniforms = {"light_direction": directions, "light_irradiance": irradiances}
    share = float(found.irradiance.sum() / max(float(found.integral.sum()), 1e-300))
    count = f"{len(directions)} light{'' if len(directions) == 1 else 's'}"
    return Lighting(
        directions,
        np.array([light.angular_radius for light in found.lights]),
        irradiances,
        uniforms,
        textures,
        {"LIGHTS": len(directions)},
        elapsed + ambient_ms,
        (f"{count}, with {share:.1%} of the environment's energy; the rest is ambient light without shadows",),
    )


def ambient(env: GpuEnvironment, scene: Scene) -> tuple[dict[str, object], float]:
    """Textures `ambient_diffuse` (E/π about n) and `ambient_glossy` (Phong lobe about r, of the scene's exponent), and the
    milliseconds they took. Raises EvalsuiteError for a scene with lobes of several exponents."""
    diffuse = lobe_map(env, 1.0, DIFFUSE_FACE_SIZE)
    exponent = phong_exponent(scene)
    if exponent is None:
        return {"ambient_diffuse": diffuse.texture, "ambient_glossy": diffuse.texture}, diffuse.prepare_ms
    glossy = lobe_map(env, exponent, default_face_size(exponent))
    return {"ambient_diffuse": diffuse.texture, "ambient_glossy": glossy.texture}, diffuse.prepare_ms + glossy.prepare_ms


def phong_exponent(scene: Scene) -> float | None:
    """The exponent of the scene's phong materials, None without one. Raises EvalsuiteError where they differ."""
    materials = [scene.materials[i] for i in scene.used_materials if scene.materials[i].plugin == "phong"]
    exponents = {float(m.parameters.get("exponent", 50.0)): m for m in materials}
    if len(exponents) > 1:
        (first, _), (second, material), *_ = exponents.items()
        raise EvalsuiteError(
            material.location or scene.path,
            f"exponent {second:g} beside {first:g}",
            "one exponent for all phong materials, as one prefiltered map holds one lobe",
            "give all lobes of the scene one exponent",
        )
    return next(iter(exponents), None)
