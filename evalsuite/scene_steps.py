"""Steps that all cells of a scene share: load it, see it through both renderers, certify it, find its lights' shadows.

A step is an entry of the store, keyed by all that decides it, so an unchanged step is never done twice and a killed run
continues where it stopped. The work itself runs in worker processes.
"""

from __future__ import annotations

import contextlib
import copy
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from evalsuite.compare.certificate import certify
from evalsuite.compare.mask import whole_pixels
from evalsuite.execute.local import Workers
from evalsuite.lights.model import DecompositionSettings
from evalsuite.scene.dependencies import dependencies
from evalsuite.scene.model import GBuffer, Scene, SceneSource
from evalsuite.scene.outline import outline_from_json, outline_to_json
from evalsuite.settings import Progress, Settings
from evalsuite.store.cache import Store, digest, file_digest, package_versions, source_digest
from evalsuite.store.sources import PACKAGE, module_files

_VERSIONS = ("mitsuba", "drjit", "numpy", "moderngl", "OpenEXR", "flip-evaluator", "scikit-image", "karellen-llvm-core")


@dataclass
class SceneSteps:
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

    def object_mask(self, source: SceneSource) -> np.ndarray:
        """Pixels that the bound materials (all, when none is bound) cover whole in Mitsuba's eyes: (H, W) bool."""
        seen = self.seen(source)
        ids = [m.id for m in self.outline(source).materials]
        bound = [ids.index(name) for name in source.bindings if name in ids]
        return whole_pixels(seen.material[bound].sum(0) if bound else seen.coverage)

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
