"""The steps that cells are made of, beside those of their scenes (`scene_steps`): draw, render, compare, split the error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from evalsuite import references, surroundings
from evalsuite.compare.regions import Surfaces
from evalsuite.gpu.plan import plan
from evalsuite.gpu.techniques.base import LOOKUP, Technique
from evalsuite.image import exr
from evalsuite.image.color import luminance
from evalsuite.lights.model import DecompositionSettings
from evalsuite.plan import DISCS, UNSHADOWED
from evalsuite.reference import adaptive, passes
from evalsuite.reference.passes import RenderState
from evalsuite.scene.model import SceneSource
from evalsuite.scene_steps import SceneSteps
from evalsuite.settings import Settings
from evalsuite.store.cache import digest, file_digest, package_versions, source_digest
from evalsuite.store.sources import PACKAGE, module_files, technique_files


def about(source: SceneSource, target: str) -> dict[str, str | None]:
    """What a reference is like, so that another's cost tells of its own."""
    environment = source.environment.name if source.environment else None
    return {"scene": source.path.stem, "environment": environment, "target": target, "bsdf": digest(source.bindings)[:12]}


def _asked(settings: Settings, facts: Mapping) -> dict[str, float]:
    """What a cost has to say of a reference whose worst pixel decided its samples: that it did, not the mean error reached."""
    if settings.worst_error is None:
        return {}
    return {"worst_error": settings.worst_error, "reached_error": max(facts["reached_error"], settings.target_error)}


class Steps(SceneSteps):
    """The steps of a cell: draw, render, compare, split its error."""

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
                took = {"seconds": state.seconds / pool.width, "processor": state.processor, "cores": pool.cores}
                row = {"kind": "reference", "pixels": mask.size, **about(source, target), **facts, **took}
                self.costs.append(row | _asked(settings, facts))
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
