"""The steps that cells are made of: load, certify, draw, render, compare.

Each is an entry of the store, keyed by all that decides it, so an unchanged step is never done twice and a killed run
continues where it stopped. The work itself runs in worker processes.
"""

from __future__ import annotations

import contextlib
import copy
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from evalsuite import references, surroundings
from evalsuite.compare.certificate import certify
from evalsuite.compare.mask import whole_pixels
from evalsuite.compare.regions import Surfaces
from evalsuite.execute.local import Workers
from evalsuite.gpu.plan import plan
from evalsuite.gpu.techniques.base import LOOKUP, Technique
from evalsuite.image import exr
from evalsuite.image.color import luminance
from evalsuite.lights.model import DecompositionSettings
from evalsuite.plan import DISCS, QUALITY, UNSHADOWED
from evalsuite.reference import adaptive, passes
from evalsuite.reference.passes import RenderState
from evalsuite.scene.dependencies import dependencies
from evalsuite.scene.model import GBuffer, Scene, SceneSource
from evalsuite.scene.outline import outline_from_json, outline_to_json
from evalsuite.store.cache import Store, digest, file_digest, package_versions, source_digest
from evalsuite.store.sources import PACKAGE, module_files, technique_files

#: Sub-samples per pixel axis on the GPU: edge-pixel coverage within 0.036 rms of Mitsuba's box filter (4×4).
SUPERSAMPLE = 4

_VERSIONS = ("mitsuba", "drjit", "numpy", "moderngl", "OpenEXR", "flip-evaluator", "scikit-image", "karellen-llvm-core")


@dataclass(frozen=True)
class Settings:
    """What a whole run shares. target_error, cap: relative standard error and samples per pixel at which a reference
    stops. size: (width, height) or None for the scene's own. worst_error: relative standard error of the worst pixel, for
    which each takes as many samples as it needs; None: all pixels take the same."""

    target_error: float = QUALITY["draft"][0]
    cap: int = QUALITY["draft"][1]
    size: tuple[int, int] | None = None
    seed: int = 0
    repair_environment: bool = False
    supersample: int = SUPERSAMPLE
    ledger: bool = True
    worst_error: float | None = None


def about(source: SceneSource, target: str) -> dict[str, str | None]:
    """What a reference is like, so that another's cost tells of its own."""
    environment = source.environment.name if source.environment else None
    return {"scene": source.path.stem, "environment": environment, "target": target, "bsdf": digest(source.bindings)[:12]}


def _asked(settings: Settings, facts: Mapping) -> dict[str, float]:
    """What a cost has to say of a reference whose worst pixel decided its samples: that it did, not the mean error reached."""
    if settings.worst_error is None:
        return {}
    return {"worst_error": settings.worst_error, "reached_error": max(facts["reached_error"], settings.target_error)}


@dataclass
class Progress:
    """Told what goes on; `cli` draws it. Every field is a function that may be called from several threads."""

    cell: Callable[[dict], None] = lambda cell: None
    step: Callable[[str], None] = lambda text: None
    warn: Callable[[str], None] = lambda text: None
    #: So many more samples of a reference, over all pixels, in so many seconds.
    samples: Callable[[float, float], None] = lambda count, seconds: None
    #: So many seconds and samples are foretold for the run.
    expect: Callable[[float, float], None] = lambda seconds, samples: None


@dataclass
class Steps:
    """Makes steps. Thread-safe: each is made once, who needs it meanwhile waits for it."""

    store: Store
    workers: Workers
    settings: Settings = field(default_factory=Settings)
    progress: Progress = field(default_factory=Progress)

    def __post_init__(self) -> None:
        self._steps: dict[tuple[str, str], Future] = {}
        self._models: dict[str, Scene] = {}
        self._seen: dict[str, GBuffer] = {}
        self._lock = threading.Lock()
        self._warned: set[str] = set()
        self._host: dict | None = None
        #: What references took that were rendered, as `store.costs` keeps it; pixels of the pictures that were drawn.
        self.costs: list[dict] = []
        self.drawn: list[int] = []

    def twin(self, settings: Settings, progress: Progress) -> Self:
        """The same steps under other settings; what one has made the other finds."""
        other = copy.copy(self)
        other.settings, other.progress = settings, progress
        return other

    # ---- what the machine is ----------------------------------------------------------------------------------------

    def host(self) -> dict:
        """Renderer, versions and processor, for provenance and keys. Raises MachineLacks when something is missing."""
        with self._lock:
            if self._host is None:
                gl = self.workers.gpu.submit("evalsuite.gpu.worker:probe")
                mitsuba = self.workers.reference.submit("evalsuite.reference.worker:activate")
                self._host = {"gl_renderer": gl.result()["renderer"], **mitsuba.result()}
                self._host["versions"] = package_versions("evalsuite", *_VERSIONS)
            return self._host

    # ---- steps ------------------------------------------------------------------------------------------------------

    def once(self, kind: str, key: str, make: Callable[[], tuple[Path, dict]]) -> tuple[Path, dict, bool]:
        """Entry (folder, meta, came from the store), made at most once per run whichever thread asks."""
        with self._lock:
            future = self._steps.get((kind, key))
            mine = future is None
            if mine:
                future = self._steps[kind, key] = Future()
        if mine:
            try:
                found = self.store.get(kind, key)
                future.set_result((*found, True) if found else (*make(), False))
            except BaseException as error:
                future.set_exception(error)
        return future.result()

    def found(self, kind: str, key: str) -> dict | None:
        """The meta of an entry that was made or found already; None of any other."""
        with self._lock:
            future = self._steps.get((kind, key))
        return future.result()[1] if future and future.done() and not future.exception() else None

    def ahead(self, step: Callable, *arguments: object) -> None:
        """Begin a step that is needed later, on another lane than what comes first. Who asks for it then waits for it, and is
        told what went wrong."""

        def begin() -> None:
            with contextlib.suppress(Exception):
                step(*arguments)

        threading.Thread(target=begin, daemon=True).start()

    def fingerprint(self, source: SceneSource) -> dict:
        """All that decides what a scene is: contents of its files, replaced parts, the code that loads it."""
        return {
            "files": [file_digest(path) for path in dependencies(source.path, source.defines)],
            "defines": source.defines,
            "environment": file_digest(source.environment) if source.environment else None,
            "size": source.size,
            "bindings": source.bindings,
            "repair": source.repair_environment,
            "code": source_digest("scene", "math/sphere.py"),
            "versions": package_versions("mitsuba", "drjit", "OpenEXR"),
        }

    def model(self, source: SceneSource) -> Scene:
        """The loaded scene, kept in memory while a run needs it."""
        key = digest(self.fingerprint(source))
        if key not in self._models:
            self.progress.step(f"loading {source.path.name}")
            scene = self.workers.reference.call("evalsuite.reference.worker:load_model", source)
            with self._lock:
                if len(self._models) > 8:  # environments are tens of megabytes
                    self._models.clear()
                self._models[key] = scene
        return self._models[key]

    def _outline_key(self, source: SceneSource) -> str:
        return digest([self.fingerprint(source), str(source.path), source_digest("scene/outline.py")])

    def has_outline(self, source: SceneSource) -> bool:
        """Whether `outline` would not have to load the scene."""
        return self.store.has("outline", self._outline_key(source))

    def outline(self, source: SceneSource) -> Scene:
        """The scene without its meshes and texels: enough to plan, and quick to read back."""
        key = self._outline_key(source)
        _, meta, _ = self.once("outline", key, lambda: self.store.put("outline", key, outline_to_json(self.model(source))))
        scene = outline_from_json(meta)
        for note in scene.environment.notes if scene.environment else ():
            with self._lock:
                fresh = note not in self._warned
                self._warned.add(note)
            if fresh:
                self.progress.warn(f"{scene.environment.source}: {note}")
        return scene

    def seen(self, source: SceneSource) -> GBuffer:
        """What Mitsuba's camera sees (materials' values do not matter for it)."""
        source = replace(source, bindings={})
        code = source_digest("reference/gbuffer.py", "math/pixel.py")
        key = digest([self.fingerprint(source), self.settings.supersample, code])

        def make() -> tuple[Path, dict]:
            self.progress.step(f"what Mitsuba sees of {source.path.stem}")
            theirs = self.workers.reference.call("evalsuite.reference.worker:gbuffer", source, self.settings.supersample)
            return self.store.put("seen", key, {}, lambda folder: np.savez_compressed(folder / "gbuffer.npz", **vars(theirs)))

        place, *_ = self.once("seen", key, make)
        with self._lock:
            if key not in self._seen:
                if len(self._seen) > 8:  # a few megabytes each
                    self._seen.clear()
                with np.load(place / "gbuffer.npz") as data:
                    self._seen[key] = GBuffer(**data)
            return self._seen[key]

    def certificate(self, source: SceneSource) -> dict:
        """Scene-equivalence certificate: what the GPU side sees of a scene against what Mitsuba sees."""
        source = replace(source, bindings={})
        drawn = [file_digest(path) for path in module_files(PACKAGE / "gpu" / "gbuffer.py")]
        code = [drawn, source_digest("scene/model.py", "reference/gbuffer.py", "math/pixel.py", "compare/certificate.py")]
        key = digest([self.fingerprint(source), self.host()["gl_renderer"], self.settings.supersample, code])

        def make() -> tuple[Path, dict]:
            ours = self.workers.gpu.submit("evalsuite.gpu.worker:gbuffer", self.model(source), self.settings.supersample)
            theirs = self.seen(source)
            return self.store.put("certificate", key, certify(ours.result(), theirs).to_json())

        return self.once("certificate", key, make)[1]

    def resolve(self, source: SceneSource, technique: Technique, parameters: Mapping) -> dict:
        """Parameters that follow from the picture itself (a LOD bias from an exponent, or the reverse), filled in."""
        key = digest([self.fingerprint(source), technique.id, parameters, self._gpu_code(source, technique)])

        def make() -> tuple[Path, dict]:
            scene = self.model(source)
            filled = self.workers.gpu.call("evalsuite.gpu.worker:resolve", scene, technique.name, dict(parameters))
            return self.store.put("resolved", key, {"parameters": filled})

        return self.once("resolved", key, make)[1]["parameters"]

    def _gpu_code(self, source: SceneSource, technique: Technique) -> list:
        """What decides a picture besides the scene: the renderer, what all drawing shares, and the files of the techniques
        that draw the scene's materials."""
        drawn_by = {binding.technique.shader for binding in plan(technique, self.outline(source)).values()}
        files = {path for shader in drawn_by for path in technique_files(shader)} | set(module_files(PACKAGE / "gpu" / "draw.py"))
        code = [file_digest(path) for path in sorted(files)]
        return [self.host()["gl_renderer"], package_versions("moderngl", "numpy"), source_digest("scene/model.py"), code]

    def image(self, source: SceneSource, technique: Technique, parameters: Mapping) -> tuple[Path, dict, bool, str]:
        """GPU picture: image.exr, scored.exr and, for a sampled technique, standard_error.exr."""
        key = self.image_key(source, technique, parameters)

        def make() -> tuple[Path, dict]:
            scene = self.model(source)
            if technique.within_room:
                scene = replace(scene, room=surroundings.room(self, source))
            self.progress.step(f"drawing {source.path.stem} with {technique.id}")
            drawing = self.workers.gpu.call(
                "evalsuite.gpu.worker:render",
                scene,
                technique.name,
                dict(parameters),
                self.settings.supersample,
                self.settings.seed,
            )

            def fill(folder: Path) -> None:
                exr.write(folder / "image.exr", drawing.image)
                np.savez_compressed(folder / "scored.npz", scored=drawing.scored)
                if drawing.standard_error is not None:
                    exr.write(folder / "standard_error.exr", drawing.standard_error)
                if drawing.probe is not None:
                    np.savez(folder / "probe.npz", **drawing.probe)

            self.drawn.append(int(np.prod(drawing.image.shape[:2])))
            names = ("parameters", "cost", "mapping", "fit")
            meta = {name: getattr(drawing, name) for name in names} | {"notes": list(drawing.notes)}
            return self.store.put("image", key, meta, fill)

        return (*self.once("image", key, make), key)

    def image_key(self, source: SceneSource, technique: Technique, parameters: Mapping) -> str:
        """The store's key of a GPU picture."""
        drawn = (self.settings.supersample, self.settings.seed)
        room = surroundings.fingerprint(source) if technique.within_room else None
        return digest([self.fingerprint(source), technique.id, parameters, self._gpu_code(source, technique), *drawn, room])

    def reference(
        self, source: SceneSource, target: str, seed: int = 0, decomposition: DecompositionSettings | None = None
    ) -> tuple[Path, dict, bool, str]:
        """Mitsuba picture: reference.exr, standard_error.exr, halves.npz, spp.exr where pixels differ in their samples; meta:
        samples, reached error, seconds.
        decomposition: how the targets `discs*` take the environment apart (None: with the default settings)."""
        settings = self.settings
        key, plan = self.reference_key(source, target, seed, decomposition)

        def make() -> tuple[Path, dict]:
            size = self.model(source).camera.size  # a scene that does not load says so in its own words
            mask, partial = self.object_mask(source), self.store.partial(key)
            rungs: dict[int, tuple[int, float]] = {}  # samples of a pass → passes, and the error of one
            before, pool = (0, 0.0), self.workers.passes

            def tell(state: RenderState, error: float) -> None:
                nonlocal before
                rungs[state.pass_samples] = state.passes, error * state.passes**0.5
                now = sum(rung * count for rung, (count, _) in rungs.items()), state.seconds / pool.width
                self.progress.samples(now[0] - before[0], now[1] - before[1])
                before = now
                reached = f"{state.spp} spp, {error:.2%} of {settings.target_error:.2%}"
                self.progress.step(f"reference {source.path.stem}, {target}: {reached}")

            state, error = references.sampled(pool, source, size, plan, mask, partial, tell)

            def fill(folder: Path) -> None:
                exr.write(folder / "reference.exr", state.mean)
                exr.write(folder / "standard_error.exr", passes.standard_error(state, mask))
                np.savez(folder / "halves.npz", a=state.halves[0], b=state.halves[1], skew=state.skew)
                if settings.worst_error is not None:
                    exr.write(folder / "spp.exr", adaptive.samples(state))

            facts = {"spp": state.spp, "reached_error": error, "seconds": state.seconds, "capped": error > settings.target_error}
            facts |= adaptive.facts(state, mask, settings.worst_error)
            if settings.worst_error is None:
                facts["pass_errors"] = {rung // mask.size: of_a_pass for rung, (_, of_a_pass) in rungs.items()}
            with self._lock:
                # As long as all workers together would have taken.
                took = {"pixels": mask.size, "cores": pool.cores, "seconds": state.seconds / pool.width}
                self.costs.append({"kind": "reference", **about(source, target), **facts, **took, **_asked(settings, facts)})
            entry = self.store.put("reference", key, facts, fill)
            partial.unlink(missing_ok=True)
            return entry

        return (*self.once("reference", key, make), key)

    def reference_key(
        self, source: SceneSource, target: str, seed: int, decomposition: DecompositionSettings | None = None
    ) -> tuple[str, dict]:
        """The store's key of a reference, and what is asked of the worker for it."""
        plan = {"target": target, "target_error": self.settings.target_error, "cap": self.settings.cap, "seed": seed}
        plan |= {"worst_error": self.settings.worst_error} if self.settings.worst_error is not None else {}
        formulas = ("math/npr.py",) if target == LOOKUP else ()
        code = [source_digest("reference", "compare/mask.py", *formulas)]
        if target in DISCS:
            plan["decomposition"] = decomposition or DecompositionSettings()
            code += [file_digest(path) for path in module_files(PACKAGE / "lights" / "decompose.py")]
        return digest([self.fingerprint(source), plan, *code]), plan

    def object_mask(self, source: SceneSource) -> np.ndarray:
        """Pixels that the bound materials (all, when none is bound) cover whole in Mitsuba's eyes: (H, W) bool."""
        seen = self.seen(source)
        ids = [m.id for m in self.outline(source).materials]
        bound = [ids.index(name) for name in source.bindings if name in ids]
        return whole_pixels(seen.material[bound].sum(0) if bound else seen.coverage)

    def surfaces(self, source: SceneSource, target: str, decomposition: DecompositionSettings) -> Surfaces:
        """What the pixels of a cell show, by which its regions are told apart."""
        seen, outline = self.seen(source), self.outline(source)
        diffuse = [k for k, material in enumerate(outline.materials) if material.plugin == "diffuse"]
        return Surfaces(
            normal=seen.normal,
            position=seen.position,
            material=seen.material.argmax(0).astype(np.int32),
            eye=outline.camera.to_world[:3, 3],
            about_normal=None if target == LOOKUP else seen.material[diffuse].sum(0) > 0.5,
            visible=None if target in UNSHADOWED else self.light_visibility(source, decomposition),
        )

    def light_visibility(self, source: SceneSource, decomposition: DecompositionSettings) -> np.ndarray | None:
        """Part of the light of the environment's area lights that reaches each pixel: (H, W), None without lights."""
        source = replace(source, bindings={})
        code = [source_digest("reference/shadow_regions.py", "reference/gbuffer.py", "math/disc_samples.py")]
        code += [file_digest(path) for path in module_files(PACKAGE / "lights" / "decompose.py")]
        key = digest([self.fingerprint(source), decomposition, code])

        def make() -> tuple[Path, dict]:
            self.progress.step(f"shadows' regions of {source.path.stem}")
            visible = self.workers.reference.call("evalsuite.reference.worker:light_visibility", source, decomposition)

            def fill(folder: Path) -> None:
                if visible is not None:
                    np.savez_compressed(folder / "visible.npz", visible=visible)

            return self.store.put("visibility", key, {"lights": visible is not None}, fill)

        place, meta, _ = self.once("visibility", key, make)
        if not meta["lights"]:
            return None
        with np.load(place / "visible.npz") as data:
            return data["visible"]

    def comparison(
        self, image: tuple[Path, str], reference: tuple[Path, str], coverage: np.ndarray, surfaces: Surfaces | None = None
    ) -> tuple[Path, dict]:
        """metrics.json and the error maps of one cell; with surfaces also where the error is."""
        key = digest(
            [
                image[1],
                reference[1],
                coverage,
                surfaces,
                source_digest("compare", "image/color.py", "math/phong.py"),
                package_versions("flip-evaluator", "scikit-image", "numpy", "scipy"),
            ]
        )

        def make() -> tuple[Path, dict]:
            result = self.workers.compare.call(
                "evalsuite.compare.cell:compare_cell", str(image[0]), str(reference[0]), coverage, surfaces
            )

            def fill(folder: Path) -> None:
                for name, picture in result["images"].items():
                    exr.write(folder / f"{name}.exr", picture)

            return self.store.put("comparison", key, result["meta"], fill)

        place, meta, _ = self.once("comparison", key, make)
        return place, meta

    def lifted(self, source: SceneSource, technique: Technique, parameters: Mapping) -> tuple[Path, dict, str]:
        """A technique's assumptions given up one by one: lifted.npz; meta: causes and a note. parameters: all of them."""
        # Formulas are Python: a technique's own shader does not change them.
        files = {path for path in technique_files(technique.shader) if path.suffix == ".py"}
        code = [file_digest(path) for path in sorted(files | set(module_files(PACKAGE / "gpu" / "lifted.py")))]
        versions = [self.host()["gl_renderer"], package_versions("numpy", "scipy"), source_digest("scene/model.py")]
        key = digest([self.fingerprint(source), technique.id, parameters, self.settings.supersample, code, versions])

        def make() -> tuple[Path, dict]:
            self.progress.step(f"assumptions of {technique.id} in {source.path.stem}")
            found = self.workers.formulas.call(
                "evalsuite.gpu.worker:lifted", self.model(source), technique.name, dict(parameters), self.settings.supersample
            )

            def fill(folder: Path) -> None:
                swapped = {} if found.swapped is None else {"swapped": found.swapped.astype(np.float32), "kernel": found.kernel}
                images = np.array(found.images, np.float32)
                np.savez_compressed(folder / "lifted.npz", images=images, tolerances=np.array(found.tolerances), **swapped)

            return self.store.put("lifted", key, {"causes": list(found.causes), "note": found.note}, fill)

        return (*self.once("lifted", key, make)[:2], key)

    def chain(
        self,
        image: tuple[Path, str],
        references: Sequence[tuple[Path, str]],
        coverage: np.ndarray,
        lifted: tuple[Path, str] | None = None,
    ) -> tuple[Path, dict]:
        """An image's error split along references from full truth downwards and its lifted assumptions: shares of each rung,
        rung-<k>.exr."""
        keys = [*(key for _, key in references), lifted and lifted[1]]
        key = digest([image[1], keys, coverage, source_digest("compare"), package_versions("numpy")])

        def make() -> tuple[Path, dict]:
            folders = [str(folder) for folder, _ in references]
            result = self.workers.compare.call(
                "evalsuite.compare.cell:split_cell", str(image[0]), folders, coverage, lifted and str(lifted[0])
            )

            def fill(folder: Path) -> None:
                for name, picture in result["images"].items():
                    exr.write(folder / f"{name}.exr", picture)

            return self.store.put("chain", key, result["meta"], fill)

        place, meta, _ = self.once("chain", key, make)
        return place, meta

    def albedo(self, bsdf: Mapping) -> dict:
        """Directional albedo of a target BSDF by Mitsuba's own sampling: cos_theta, value and standard_error (luminance)."""
        cosines = [1.0, 0.9, 0.75, 0.5, 0.25, 0.1]
        key = digest([bsdf, cosines, source_digest("reference"), package_versions("mitsuba")])

        def make() -> tuple[Path, dict]:
            value, error = self.workers.reference.call("evalsuite.reference.worker:albedo", dict(bsdf), cosines)
            plain = {"cos_theta": cosines, "value": luminance(value).tolist(), "standard_error": luminance(error).tolist()}
            return self.store.put("albedo", key, plain)

        return self.once("albedo", key, make)[1]
