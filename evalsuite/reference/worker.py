"""What a reference worker process can be asked: plain functions of picklable arguments and results."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.lights.model import DecompositionSettings
from evalsuite.reference import render, room, variants
from evalsuite.reference.gbuffer import trace_gbuffer
from evalsuite.reference.passes import RenderState, pass_seed
from evalsuite.reference.shadow_regions import visible_light
from evalsuite.scene.model import Environment, GBuffer, Room, Scene, SceneSource


def probe() -> dict[str, Any]:
    """What this machine offers the reference side; see `variants.probe`."""
    return variants.probe()


def load_model(source: SceneSource) -> Scene:
    """The scene as plain data. Raises EvalsuiteError with file and line."""
    return render.load_cached(source).scene


def read_environment(path: str, repair: bool = False) -> Environment:
    """A lat-long map from a file; see `scene.environment.read_environment`."""
    from evalsuite.scene import environment

    variants.activate()
    return environment.read_environment(path, repair)


def gbuffer(source: SceneSource, supersample: int = 4) -> GBuffer:
    """What Mitsuba's camera sees, on supersample² sub-samples a pixel."""
    return trace_gbuffer(render.load_cached(source), supersample)


def light_visibility(source: SceneSource, decomposition: DecompositionSettings) -> NDArray[np.float32] | None:
    """Part of the area lights' light that reaches each pixel; see `shadow_regions.visible_light`."""
    return visible_light(render.load_cached(source), decomposition)


def advance(
    source: SceneSource,
    target: str,
    state: RenderState | None,
    passes: int,
    seed: int = 0,
    decomposition: DecompositionSettings | None = None,
) -> RenderState:
    """The reference after `passes` more passes; see `render.advance`."""
    return render.advance(source, target, state, passes, seed, decomposition)


def activate() -> dict[str, Any]:
    """Bring Mitsuba up; returns {mitsuba, variant, drjit, llvm, cpu} for provenance. Raises MachineLacks."""
    return variants.facts()


def passes(
    source: SceneSource,
    target: str,
    pass_spp: int | NDArray[np.int32],
    numbers: range,
    seed: int,
    decomposition: DecompositionSettings | None = None,
    look: int = 0,
) -> tuple[NDArray[np.float32], float, float]:
    """Radiance of some passes of a reference, (K, H, W, 3), and the seconds that they took, of the clock and of processors; see
    `render.passes`."""
    started, used = time.perf_counter(), time.process_time()
    found = np.stack(list(render.passes(source, target, pass_spp, numbers, seed, decomposition, look)))
    return found, time.perf_counter() - started, time.process_time() - used


def bake_room(source: SceneSource) -> Room:
    """The scene's room with its light on it; see `room.bake`."""
    variants.activate()
    return room.bake(source)


def probe_room(source: SceneSource, centre: tuple[float, float, float], width: int, error: float) -> tuple:
    """The room's radiance at a point, and its standard error; see `room.probe`."""
    variants.activate()
    return room.probe(source, centre, width, error)


def albedo(
    plugin: Mapping[str, object], cos_thetas: Sequence[float], samples: int = 2**16, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directional albedo ∫ f(v, l) (n·l) dl of a BSDF by Mitsuba's own sampling.

    plugin: Mitsuba dictionary, colours as triples. cos_thetas: K cosines n·v in (0, 1]. samples: per cosine.
    Returns (K, 3) means and their (K, 3) standard errors.
    """
    mi = variants.activate()
    import drjit as dr

    def plain(value: object) -> object:
        return {"type": "rgb", "value": [float(v) for v in value]} if isinstance(value, tuple | list) else value

    bsdf = mi.load_dict({key: plain(value) for key, value in plugin.items()})
    means, errors = [], []
    for number, cosine in enumerate(cos_thetas):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(pass_seed(seed, number), samples)
        si = dr.zeros(mi.SurfaceInteraction3f, samples)
        si.wi = mi.Vector3f(float(np.sqrt(max(1.0 - cosine * cosine, 0.0))), 0.0, float(cosine))
        si.n, si.sh_frame = mi.Normal3f(0.0, 0.0, 1.0), mi.Frame3f(mi.Normal3f(0.0, 0.0, 1.0))
        _, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
        values = np.broadcast_to(np.array(weight, np.float64).T, (samples, 3))
        means.append(values.mean(axis=0))
        errors.append(values.std(axis=0, ddof=1) / np.sqrt(samples))
    return np.array(means), np.array(errors)
