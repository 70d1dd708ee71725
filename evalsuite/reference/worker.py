"""What a reference worker process can be asked: plain functions of picklable arguments and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.reference import render, variants
from evalsuite.reference.gbuffer import trace_gbuffer
from evalsuite.reference.render import RenderState
from evalsuite.scene.model import Environment, GBuffer, Scene, SceneSource


def probe() -> dict[str, Any]:
    """What this machine offers the reference side; see `variants.probe`."""
    return variants.probe()


def activate() -> dict[str, Any]:
    """Bring Mitsuba up; its facts for provenance: mitsuba, drjit, variant, llvm, cpu. Raises MachineLacks."""
    mi = variants.activate()
    import drjit as dr

    return {
        "mitsuba": mi.__version__,
        "drjit": dr.__version__,
        "variant": mi.variant(),
        "llvm": ".".join(str(number) for number in dr.detail.llvm_version()),
        "cpu": variants.cpu_model(),
    }


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


def advance(source: SceneSource, target: str, state: RenderState | None, passes: int, seed: int = 0) -> RenderState:
    """The reference after `passes` more passes; see `render.advance`."""
    return render.advance(source, target, state, passes, seed)


#: Passes between two looks at the error, which is also how much work a killed run can lose: a few seconds.
PASSES_PER_STEP = 16


def activate() -> dict[str, Any]:
    """Bring Mitsuba up; returns {mitsuba, variant, drjit, llvm, cpu} for provenance. Raises MachineLacks."""
    return variants.facts()


def sample(source: SceneSource, plan: Mapping[str, Any], mask: NDArray[np.bool_], partial: str) -> dict[str, Any]:
    """One step of a reference: continue from the file `partial` (if there is one), a few passes further, and leave the state
    there; the step that reaches the goal returns the picture instead and leaves the file alone.

    plan: target, target_error, cap (samples per pixel), seed. mask: (H, W), where the error counts.
    Returns done, spp, reached_error, capped, seconds, and when done mean, standard_error and halves.
    """
    path = Path(partial)
    state = render.load_state(path, plan["seed"])
    passes = render.plan(state, plan["target_error"], plan["cap"], mask) if state else 2
    if passes:
        state = render.advance(source, plan["target"], state, min(passes, PASSES_PER_STEP), plan["seed"])
    reached = render.relative_error(state, mask)
    done = render.plan(state, plan["target_error"], plan["cap"], mask) == 0
    step = {
        "done": done,
        "spp": state.spp,
        "reached_error": reached,
        "capped": reached > plan["target_error"],
        "seconds": state.seconds,
    }
    if not done:
        render.save_state(state, path)
        return step
    return step | {"mean": state.mean, "standard_error": state.standard_error, "halves": state.halves}


CHUNK_SECONDS = 15.0  # a step of `sample` ends about then, so that progress shows and little is lost when killed


def sample(
    source: SceneSource, plan: Mapping[str, Any], mask: NDArray | None, partial: str, spp: int = 0
) -> dict[str, float | int | bool]:
    """One step of a reference whose state lives in the file `partial`: continues what is there, writes it atomically.

    plan: target, target_error (relative, inside the mask), cap (samples per pixel), seed. spp: what the caller knows to be
    done; informative only, the file decides. Returns spp, reached_error, seconds, capped (stopped by the cap above the
    target error) and done.
    """
    file, target, seed = Path(partial), str(plan["target"]), int(plan.get("seed", 0))
    target_error, cap = float(plan["target_error"]), int(plan["cap"])
    state, goal = _read_state(file) or (render.advance(source, target, None, 0, seed), 0)
    # The goal is planned from the state alone and kept until it is reached; the clock only decides how many steps that
    # takes. So neither a slow machine nor a kill changes which samples the result is made of.
    if state.passes >= goal:
        goal = state.passes + render.plan(state, target_error, cap, mask)
    if state.passes < goal:
        pace = state.seconds / state.passes if state.passes else CHUNK_SECONDS
        passes = min(goal - state.passes, max(int(CHUNK_SECONDS / max(pace, 1e-6)), 1))
        state = render.advance(source, target, state, passes)
        _write_state(file, state, goal)
    error = render.relative_error(state, mask)
    done = state.passes >= goal and render.plan(state, target_error, cap, mask) == 0
    return {
        "spp": state.spp,
        "reached_error": error,
        "seconds": state.seconds,
        "capped": done and error > target_error,
        "done": done,
    }


def finish(partial: str) -> dict[str, Any]:
    """mean, standard_error (H, W, 3) float32 and halves (a pair of them) of the reference in the file `partial`."""
    found = _read_state(Path(partial))
    if found is None:
        raise EvalsuiteError(partial, "no readable state", "the state of a reference", "render it again")
    state = found[0]
    return {"mean": state.mean, "standard_error": state.standard_error, "halves": state.halves}


def _read_state(file: Path) -> tuple[RenderState, int] | None:
    """State and goal [passes] from a file; None when there is none or it is not one of ours."""
    try:
        with np.load(file, allow_pickle=False) as data:
            counts = [int(data[name]) for name in ("pass_spp", "passes", "seed")]
            return RenderState(data["even"], data["odd"], data["squares"], *counts, float(data["seconds"])), int(data["goal"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _write_state(file: Path, state: RenderState, goal: int) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    temporary = file.with_name(file.name + ".writing")
    with temporary.open("wb") as stream:
        np.savez(stream, goal=goal, **{f.name: getattr(state, f.name) for f in dataclasses.fields(state)})
    os.replace(temporary, file)


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
        sampler.seed(render.pass_seed(seed, number), samples)
        si = dr.zeros(mi.SurfaceInteraction3f, samples)
        si.wi = mi.Vector3f(float(np.sqrt(max(1.0 - cosine * cosine, 0.0))), 0.0, float(cosine))
        si.n, si.sh_frame = mi.Normal3f(0.0, 0.0, 1.0), mi.Frame3f(mi.Normal3f(0.0, 0.0, 1.0))
        _, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
        values = np.broadcast_to(np.array(weight, np.float64).T, (samples, 3))
        means.append(values.mean(axis=0))
        errors.append(values.std(axis=0, ddof=1) / np.sqrt(samples))
    return np.array(means), np.array(errors)
