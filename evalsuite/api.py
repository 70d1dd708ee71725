"""The Python interface: load a scene, draw it, render its ground truth, compare. Same steps, same store, same workers as
the command line, so what one has made the other finds."""

from __future__ import annotations

import atexit
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evalsuite.compare import Comparison
from evalsuite.compare import compare as compare_pictures
from evalsuite.errors import EvalsuiteError, unknown
from evalsuite.execute.local import Workers
from evalsuite.gpu import registry
from evalsuite.gpu.plan import cannot_stand_for
from evalsuite.image import exr
from evalsuite.lights.model import DecompositionSettings
from evalsuite.pipeline import Progress, Run, Settings
from evalsuite.plan import DISCS, QUALITY, TARGETS, Cell, Value
from evalsuite.report import notebook
from evalsuite.scene import builtin
from evalsuite.scene.dependencies import check_parameters
from evalsuite.scene.dependencies import parameters as scene_parameters
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import Store


@dataclass
class SceneHandle:
    """A scene to draw and to render. source: file, environment, size. bindings: BSDFs replaced in both renderers, by id.
    decomposition: how an environment is taken apart into area lights and a remainder. `render` with a technique sets both, as
    a report does for its cells, and `reference` then renders the same materials and lights."""

    source: SceneSource
    bindings: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    decomposition: DecompositionSettings = field(default_factory=DecompositionSettings)

    @property
    def bound(self) -> SceneSource:
        return replace(self.source, bindings=self.bindings)

    def __repr__(self) -> str:
        return f"SceneHandle({', '.join(f'{name} {value}' for name, value in self._facts().items())})"

    def _repr_html_(self) -> str:
        return notebook.scene(self._facts())

    def _facts(self) -> dict[str, str]:
        size = "{} × {} pixels".format(*self.source.size) if self.source.size else ""
        environment = self.source.environment.name if self.source.environment else ""
        stated = " ".join(f"{name}={value}" for name, value in self.source.defines.items())
        bound = ", ".join(f"{name}: {bsdf.get('type')}" for name, bsdf in self.bindings.items())
        facts = {"scene": self.source.path.name, "environment": environment, "size": size, "parameters": stated, "bound": bound}
        return {name: value for name, value in facts.items() if value}


@dataclass(frozen=True, eq=False)
class Reference:
    """Ground truth. mean: (H, W, 3) float32 radiance [W m⁻² sr⁻¹]; standard_error: the same shape, of the mean; halves: two
    independent means of half the samples each; skew: cube root of the third cumulant of the mean's noise [radiance]; mask: (H, W)
    bool, pixels that the scored materials cover whole; spp: samples per pixel; reached_error: relative standard error reached in
    the mask; capped: whether sampling stopped early. With a `worst_error` also samples: (H, W) of each pixel, whose mean spp is;
    reached_worst_error."""

    mean: NDArray[np.float32]
    standard_error: NDArray[np.float32]
    halves: tuple[NDArray[np.float32], NDArray[np.float32]]
    skew: NDArray[np.float32]
    mask: NDArray[np.bool_]
    spp: int
    reached_error: float
    capped: bool
    samples: NDArray[np.float32] | None = None
    reached_worst_error: float | None = None

    def __repr__(self) -> str:
        height, width = self.mask.shape
        capped = ", stopped at the cap" if self.capped else ""
        return f"Reference({width} × {height}, {self.spp} spp, relative standard error {self.reached_error:.2%}{capped})"

    def _repr_html_(self) -> str:
        return notebook.reference(self.mean, self.mask, self.spp, self.reached_error, self.capped)


Comparison._repr_html_ = notebook.comparison  # compare knows no report


@lru_cache(1)
def _workers() -> Workers:
    workers = Workers(jobs=1)
    atexit.register(workers.close)
    return workers


def _run(settings: Settings) -> Run:
    import warnings

    def warn(text: str) -> None:
        warnings.warn(text, stacklevel=4)

    return Run(Store(warn=warn), _workers(), settings, Progress(warn=warn))


def load_scene(
    path: str | Path,
    envmap: str | Path | None = None,
    size: tuple[int, int] | None = None,
    repair_env: bool = False,
    **parameters: Value,
) -> SceneHandle:
    """A built-in scene by name, or any Mitsuba XML file. envmap: a lat-long .exr/.hdr or a name from `evalsuite env list`
    that replaces the scene's environment. size: (width, height) [pixels]. parameters: those that the scene leaves open with
    `<default name="x" value="0"/>`. Raises EvalsuiteError for bad input."""
    environment = builtin.environment_path(str(envmap)) if envmap is not None else None
    file, defines = builtin.scene_path(str(path)), {name: str(value) for name, value in parameters.items()}
    check_parameters(file, defines)
    handle = SceneHandle(SceneSource(file, environment, size, {}, repair_env, defines))
    _run(Settings()).outline(handle.source)
    return handle


def render(
    scene: SceneHandle, technique: str | Path, *, supersample: int = 4, seed: int = 0, **parameters: Value
) -> NDArray[np.float32]:
    """GPU picture, (H, W, 3) float32 linear radiance. technique: an id, or the path of a .glsl file of yours. parameters: the
    technique's (`evalsuite list techniques`).

    The scene's BSDF `subject` is bound to the technique's own target BSDF; without a `subject`, a material parameter
    (`exponent=64`) binds every material that the technique can stand for; else the scene's own materials are drawn.
    Raises EvalsuiteError for an unknown technique or parameter, and for what the technique cannot stand for."""
    chosen = registry.find(str(technique))
    for name in parameters:
        if name not in chosen.defaults():
            raise unknown("parameter", name, list(chosen.defaults()), "`evalsuite list techniques`")
    run = _run(Settings(size=scene.source.size, seed=seed, supersample=supersample))
    run.outline(scene.source).require_drawable()
    cell = Cell(
        scene.source.path.stem,
        scene.source.path,
        None,
        scene.source.environment,
        chosen.name,
        parameters,
        forced=frozenset(parameters),
    )
    source, filled = run.bound_source(cell, chosen, scene.source)
    reason = cannot_stand_for(chosen, run.outline(source))
    if reason:
        raise EvalsuiteError(
            scene.source.path,
            reason,
            "a scene that the technique can draw",
            "choose another technique, or give a material with a parameter such as exponent=64",
        )
    scene.bindings, scene.decomposition = source.bindings, DecompositionSettings.of(filled)
    return exr.read(run.image(source, chosen, filled)[0] / "image.exr")


def reference(
    scene: SceneHandle,
    target: str = "unoccluded",
    *,
    target_error: float = QUALITY["draft"][0],
    max_spp: int = QUALITY["publication"][1],
    worst_error: float | None = None,
    seed: int = 0,
    **decomposition: Value,
) -> Reference:
    """Mitsuba ground truth of the scene with the materials that the last `render` of it bound (its own, before any).

    target: `evalsuite list targets`. target_error: relative standard error to reach (mean over the mask, over the mean
    radiance there). max_spp: cap on samples per pixel. worst_error: the same of the worst pixel, for which each takes as many
    samples as it needs (docs/adaptive.md). decomposition: settings of the environment's decomposition by name
    (stop=0.05), for the targets `discs*`; those not given are the last `render`'s. Raises EvalsuiteError for bad input."""
    if target not in TARGETS:
        raise unknown("target", target, TARGETS, "`evalsuite list targets`")
    settings = replace(scene.decomposition, **_decomposition(target, decomposition))
    run = _run(Settings(target_error=target_error, cap=max_spp, size=scene.source.size, worst_error=worst_error))
    place, meta, *_ = run.reference(scene.bound, target, seed, settings)
    with np.load(place / "halves.npz") as halves:
        a, b, skew = halves["a"], halves["b"], halves["skew"]
    return Reference(
        exr.read(place / "reference.exr"),
        exr.read(place / "standard_error.exr"),
        (a, b),
        skew,
        run.object_mask(scene.bound),
        meta["spp"],
        meta["reached_error"],
        meta["capped"],
        exr.read(place / "spp.exr")[..., 0] if worst_error is not None else None,
        meta.get("reached_worst_error"),
    )


def _decomposition(target: str, given: Mapping[str, Value]) -> dict[str, object]:
    """Settings of the decomposition, each in its type. Raises EvalsuiteError for unknown names and values."""
    from evalsuite.gpu.techniques.shadow import DECOMPOSITION

    known = {parameter.name: parameter for parameter in DECOMPOSITION} if target in DISCS else {}
    parsed = {}
    for name, value in given.items():
        if name not in known:
            expected = f"one of {', '.join(known)}" if known else f"none: only {', '.join(DISCS)} take the environment apart"
            raise EvalsuiteError(f"target {target}", f"the parameter '{name}'", expected)
        try:
            parsed[name] = known[name].parse(value)
        except (TypeError, ValueError) as error:
            raise EvalsuiteError(f"target {target}, parameter {name}", repr(value), known[name].expected) from error
    return parsed


def of_decomposition(scene: str | Path, target: str, given: Mapping[str, Value]) -> dict[str, Value]:
    """Those of the given parameters that `reference` takes for a target; the scene comes first with its own of that name."""
    names = {f.name for f in fields(DecompositionSettings)} if target in DISCS else set()
    return {name: value for name, value in given.items() if name in names - set(scene_parameters(builtin.scene_path(str(scene))))}


def compare(
    image: NDArray, reference: Reference | NDArray, *, mask: NDArray | None = None, standard_error: NDArray | None = None
) -> Comparison:
    """Metrics with 95 % intervals and error maps of (image, reference); signed error = image − reference.

    reference: what `reference` returned (its noise and mask are used), or any picture of the same shape."""
    if isinstance(reference, Reference):
        return compare_pictures(
            image,
            reference.mean,
            standard_error=reference.standard_error,
            halves=reference.halves,
            skew=reference.skew,
            mask=reference.mask if mask is None else mask,
        )
    return compare_pictures(image, reference, standard_error=standard_error, mask=mask)
