"""Passes of ground truth, rendered by Mitsuba; `reference.passes` adds them up."""

from __future__ import annotations

import json
import time
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.image.files import file_stamp
from evalsuite.lights.model import DecompositionSettings
from evalsuite.reference import wavefront
from evalsuite.reference.integrators import TARGETS, integrator
from evalsuite.reference.passes import RUNGS, RenderState, added, blank, pass_seed
from evalsuite.reference.room import near_field
from evalsuite.reference.variants import activate
from evalsuite.scene.dependencies import dependencies
from evalsuite.scene.load import LoadedScene, load
from evalsuite.scene.model import SceneSource


def passes(
    source: SceneSource,
    target: str,
    pass_spp: int | NDArray[np.int32],
    numbers: range,
    seed: int = 0,
    decomposition: DecompositionSettings | None = None,
    look: int = 0,
) -> Iterator[NDArray[np.float32]]:
    """Radiance (H, W, 3) of the passes `numbers` of `target`, of `pass_spp` samples a pixel each. seed: of the run. look: of a
    state whose pixels take different numbers of samples (`RenderState`).
    decomposition: how a target that takes the environment apart does so (None: with the default settings). Raises EvalsuiteError
    for a scene that cannot be loaded, an unknown target, or samples that are NaN or Inf (never swept away)."""
    loaded = load_cached(source, target in TARGETS and TARGETS[target].within_room)
    chosen = integrator(target, loaded.scene.environment, decomposition)
    for number in numbers:
        if isinstance(pass_spp, int):
            image = chosen.render(loaded.mitsuba, 0, seed=pass_seed(seed, number), spp=pass_spp)
            radiance = np.array(image, dtype=np.float32)[..., :3]
        else:
            radiance = wavefront.picture(loaded, chosen, pass_spp, seed, number, look)
        _require_finite(radiance, source, target, number)
        yield radiance


def fresh(source: SceneSource, seed: int = 0, pass_spp: int = RUNGS[1]) -> RenderState:
    """A state without any pass, of the scene's size."""
    return blank(load_cached(source).scene.camera.size, seed, pass_spp)


def advance(
    source: SceneSource,
    target: str,
    state: RenderState | None,
    count: int,
    seed: int = 0,
    decomposition: DecompositionSettings | None = None,
) -> RenderState:
    """The state after `count` more passes of `target`; see `passes`. state: None to start; a state keeps its own seed."""
    state = state or fresh(source, seed)
    width, height = load_cached(source).scene.camera.size
    if state.even.shape != (height, width, 3):
        raise EvalsuiteError("reference", f"a state of {state.even.shape[1]}×{state.even.shape[0]}", f"{width}×{height}")
    numbers, started = range(state.passes, state.passes + count), time.perf_counter()
    state = added(state, passes(source, target, state.pass_spp, numbers, state.seed, decomposition, state.look))
    return replace(state, seconds=state.seconds + time.perf_counter() - started)


def _require_finite(radiance: NDArray[np.float64], source: SceneSource, target: str, number: int) -> None:
    bad = ~np.isfinite(radiance).all(axis=2)
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise EvalsuiteError(
            source.path,
            f"NaN or Inf in {int(bad.sum())} pixels of `{target}`, pass {number}, the first in row {row}, column {column}",
            "finite radiance",
            "look for NaN in textures or extreme BSDF values",
        )


_KEEP = 4
_loaded: OrderedDict[str, LoadedScene] = OrderedDict()


def load_cached(source: SceneSource, within_room: bool = False) -> LoadedScene:
    """The loaded scene, from this process's last few when neither the file nor anything else has changed. within_room: with
    the room that it names instead of its environment."""
    activate()
    key = _key(source, within_room)
    if key not in _loaded:
        _loaded[key] = near_field(load_cached(source), source) if within_room else load(source)
        while len(_loaded) > _KEEP:
            _loaded.popitem(last=False)
    _loaded.move_to_end(key)
    return _loaded[key]


def _key(source: SceneSource, within_room: bool) -> str:
    def stamp(path: Any) -> Any:
        try:
            return [str(path.absolute()), *file_stamp(path)]
        except (OSError, AttributeError):
            return str(path)

    bindings = {name: dict(plugin) for name, plugin in source.bindings.items()}
    # Meshes, bitmaps and the room too: a long-lived process must see them change.
    files = [stamp(path) for path in dependencies(source.path, source.defines)]
    facts = [files, stamp(source.environment), source.size, bindings, source.repair_environment]
    facts += [within_room, dict(source.defines)]
    return json.dumps(facts, sort_keys=True, default=str)
