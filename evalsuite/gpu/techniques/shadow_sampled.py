"""Soft shadows as the mean of many hard ones (Heckbert and Herf 1997): samples of the environment's lights, or of all of the map
(Agarwal et al. 2003), each with a shadow map."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common, shadow
from evalsuite.gpu.techniques.base import Float, Frame, Parameter, PassInputs, Prepared, Settings, Technique
from evalsuite.lights import decompose
from evalsuite.lights.model import DecompositionSettings
from evalsuite.lights.structured import structured
from evalsuite.math.disc_samples import light_samples
from evalsuite.scene.model import Environment, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment
    from evalsuite.gpu.shadow.maps import ShadowMaps

BATCH = 32  # maps at once


@dataclass(frozen=True, eq=False)
class Samples:
    """to_light: (N, 3) unit, world. irradiance: (N, 3) at normal incidence [W m⁻²]. Each is a light of one direction."""

    to_light: Float
    irradiance: Float


def samples(environment: Environment, settings: Settings) -> Samples:
    """What `sampling` names: `samples` directions of each light's disc, uniform in solid angle, or of the whole map in all."""
    count = int(settings["samples"])
    if settings["sampling"] == "structured":
        found = structured(environment.radiance, count)
        return Samples(found.directions @ environment.to_world.T, found.irradiances)
    lights = decompose.of(environment, DecompositionSettings.of(settings)).lights
    to_light = [light_samples(light.direction, light.angular_radius, count, i) for i, light in enumerate(lights)]
    irradiance = np.repeat(np.array([light.irradiance for light in lights]).reshape(-1, 3) / count, count, axis=0)
    return Samples(np.concatenate([np.zeros((0, 3)), *to_light]) @ environment.to_world.T, irradiance)


def prepare(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """Samples, the maps' places and, where lights are sampled, the prefiltered rest."""
    from evalsuite.gpu.shadow.lighting import lighting
    from evalsuite.gpu.shadow.maps import ShadowMaps

    whole = settings["sampling"] == "structured"
    rest = None if whole else lighting(env, settings, scene)
    start = time.perf_counter()
    deciding = tuple(sorted((k, v) for k, v in settings.items() if k in _DECIDING))
    found = env.kept(("samples", deciding), lambda: samples(env.environment, settings))
    prepare_ms = 1e3 * (time.perf_counter() - start) + (rest.prepare_ms if rest else 0.0)
    notes = rest.notes if rest else (f"{len(found.to_light)} directional lights stand for the whole map",)
    prepared = Prepared({}, rest.textures if rest else {}, prepare_ms, notes,
                        defines={"LIGHTS": 0, "BATCH": 0, "AMBIENT": int(not whole)})  # fmt: skip
    if not len(found.to_light):
        return prepared
    maps = ShadowMaps(scene, settings["map_size"], BATCH)
    return replace(
        prepared,
        notes=(*notes, f"{len(found.to_light)} shadow maps in each frame, {maps.batch} at once"),
        defines={**prepared.defines, "BATCH": maps.batch},
        textures={**prepared.textures, "map_depths": maps.depths},
        before_pass=_Batches(maps, found).before_pass,
        rounds=-(-len(found.to_light) // maps.batch),
    )


class _Batches:
    """One batch of maps a round, drawn before the first of its sub-samples."""

    def __init__(self, maps: ShadowMaps, found: Samples) -> None:
        self.maps, self.found, self.fit = maps, found, maps.fit(found.to_light)
        self._round, self._inputs = -1, PassInputs()

    def before_pass(self, frame: Frame, clip: Float) -> PassInputs:
        """The maps of this round, and what their samples add to a mean over the rounds."""
        from evalsuite.gpu.shadow.maps import padded

        if frame.round != self._round:
            part = slice(frame.round * self.maps.batch, (frame.round + 1) * self.maps.batch)
            fit = self.fit.part(part)
            irradiance = padded(frame.rounds * self.found.irradiance[part], self.maps.batch)
            uniforms = {**self.maps.uniforms(fit), "sample_irradiance": irradiance, "sample_count": len(fit.to_light)}
            self._inputs = PassInputs(uniforms, {}, self.maps.draw(fit))
            self._round = frame.round
        return self._inputs


def twin(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
    """Σ V E f (n·l)₊ over the samples, plus the remainder's ambient light where lights are sampled, (N, 3).
    settings["visibility"]: V, (N, S)."""
    found = samples(environment, settings)
    out = np.zeros((len(normals), 3))
    if settings["sampling"] == "lights":
        _, rest = shadow.decomposed(environment, DecompositionSettings.of(settings))
        out += shadow.twin_ambient(rest, normals, to_view, material, settings)
    visibility = np.asarray(settings["visibility"], np.float64).T
    for to_light, e, visible in zip(found.to_light, found.irradiance, visibility, strict=True):
        out += visible[:, None] * e * shadow.twin_reflected(normals, to_view, to_light, material)
    return out


_PARAMETERS = (
    Parameter("sampling", "lights", "what is sampled: the discs of the environment's lights, or, with structured importance "
              "sampling, the whole map, which then leaves no ambient rest", "technique",
              common.choice("lights", "structured"), "lights or structured"),
    Parameter("samples", 64, "of each light, or of the whole map", "technique", common.integer(1, 4096),
              "a whole number from 1 to 4096"),
)  # fmt: skip
MAP_SIZE = Parameter("map_size", 1024, "shadow map width [texels]", "technique", common.integer(16, 8192), "16 to 8192")
_DECIDING = frozenset(p.name for p in (*_PARAMETERS, *shadow.DECOMPOSITION))

TECHNIQUE = Technique(
    id="shadow-sampled",
    title="Mean of hard shadows from sampled lights, prefiltered rest",
    paper="Heckbert and Herf 1997; structured importance sampling: Agarwal, Ramamoorthi, Belongie and Jensen 2003",
    equations="L_o = ambient(remainder) + Σ_i (E_i/n) Σ_j V(l_ij) f(l_ij) (n·l_ij)₊",
    parameters=(*shadow.MATERIAL, *_PARAMETERS, MAP_SIZE, *shadow.DECOMPOSITION),
    assumptions=(
        "The lights' discs, or with structured samples the whole map, are as many directions as there are samples.",
        "The rest of the map, where lights are sampled, casts no shadow.",
        "What is narrower than a shadow map's texel may cast no shadow.",
        shadow.ASSUMPTIONS[2],
    ),
    stands_for=shadow.STANDS_FOR,
    target_bsdf=common.named_target,
    shader=Path(__file__).with_suffix(".glsl"),
    library=("lighting.glsl", "shadow_maps.glsl"),
    prepare=prepare,
    twin=twin,
    target="direct",
    casts_shadows=True,
    free=(shadow.FREE_LIGHTS,),
    chain=lambda settings: (*shadow.TO_CENTRES[:2], ("discs", "light samples")) if settings["sampling"] == "lights" else (),
)
