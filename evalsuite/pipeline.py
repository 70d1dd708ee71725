"""plan → cells → results. With `steps`, the one place that sees gpu and reference together.

A cell is drawn on one side and rendered on the other, certified, compared and written down. Cells share steps: two
techniques with the same target share one reference.
"""

from __future__ import annotations

import shlex
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from evalsuite import environment_view, headroom, surroundings
from evalsuite.errors import EvalsuiteError, MachineLacks, Unwritable, WorkerFailed
from evalsuite.execute.local import MOST_CELLS
from evalsuite.gpu import registry
from evalsuite.gpu.plan import cannot_stand_for
from evalsuite.gpu.techniques.base import LOOKUP, Technique
from evalsuite.image.color import luminance
from evalsuite.ledger import LIFTED, truths
from evalsuite.lights.model import DecompositionSettings
from evalsuite.plan import NEAR_FIELD, Cell, usual_cap
from evalsuite.scene import builtin
from evalsuite.scene.model import OWN, SUBJECT, Scene, SceneSource, own_name
from evalsuite.settings import Progress, Settings
from evalsuite.steps import Steps
from evalsuite.store.cache import digest, source_digest

__all__ = ["Progress", "Run", "Settings", "reproduce", "run_cells"]

#: What a comparison says that a cell's results repeat.
SCORED = ("metrics", "exposure", "mask_pixels", "mean_image", "mean_reference", "regions", "curves", "blob", "looked_up")


class Run(Steps):
    """Makes cells out of steps."""

    def source(self, cell: Cell) -> SceneSource:
        defines = {name: str(value) for name, value in cell.defines.items()}
        return SceneSource(cell.path, cell.environment_path, self.settings.size, {}, self.settings.repair_environment, defines)

    def bind(self, cell: Cell, technique: Technique, outline: Scene, parameters: Mapping) -> dict[str, dict]:
        """Which BSDFs the cell replaces in both renderers: the scene's `subject`; without one, and only when the user gave
        a material parameter with -p, every material that the technique can stand for."""
        ids = [m.id for m in outline.materials]
        if SUBJECT in ids:
            names = [SUBJECT]
        elif cell.forced & {p.name for p in technique.parameters if p.kind == "material"}:
            names = [m.id for m in outline.materials if not m.undrawable and m.plugin in technique.stands_for]
        else:
            names = []
        bound = {}
        for name in names:
            target = technique.target_bsdf(parameters)
            own = outline.materials[ids.index(name)].textures
            # A bitmap of the scene's stays unless the cell states another value.
            bound[name] = target | {key: OWN for key in target if own_name(key, own) and key not in cell.parameters}
        return bound

    def bound_source(self, cell: Cell, technique: Technique, plain: SceneSource) -> tuple[SceneSource, dict]:
        """The scene with the cell's materials bound, and the technique's parameters but for those that its materials give."""
        outline, stated = self.outline(plain), technique.parse(cell.parameters)
        parameters = technique.defaults() | stated
        source = replace(plain, bindings=self.bind(cell, technique, outline, parameters))
        if technique.resolves and not cannot_stand_for(technique, self.outline(source)):
            parameters = self.resolve(source, technique, stated)
            return replace(plain, bindings=self.bind(cell, technique, outline, parameters)), parameters
        # A default must not pass for what the scene's own material says: the technique reads that there.
        of_technique = {p.name for p in technique.parameters if p.kind == "technique"}
        return source, {name: value for name, value in parameters.items() if name in stated or name in of_technique}

    def prepared(self, cell: Cell) -> tuple[str, SceneSource, dict]:
        """Why the cell is skipped, empty for one that is made, and its `bound_source` (the plain one where its technique does not
        go with the target). Raises EvalsuiteError for a scene that cannot be loaded or drawn."""
        technique, plain = registry.find(cell.technique), self.source(cell)
        if reason := technique.reason_against_target(cell.target):
            return reason, plain, {}
        outline = self.outline(plain)
        outline.require_drawable()
        source, parameters = self.bound_source(cell, technique, plain)
        reason = cannot_stand_for(technique, self.outline(source)) or ""
        if cell.target == NEAR_FIELD and outline.room_file is None:
            reason = "the scene names no room, so there is no near field to render"
        return reason, source, parameters

    def evaluate(self, cell: Cell) -> tuple[dict, dict[str, Path]]:
        """One cell's results (as in results.json, image paths left to `materialise`) and its image files.

        What goes wrong here is this cell's alone and stands in its message; only MachineLacks and Unwritable are raised."""
        started = time.perf_counter()
        technique = registry.find(cell.technique)
        result = {
            "id": cell.id,
            "scene": cell.scene,
            "environment": cell.environment,
            "technique": technique.id,
            "parameters": cell.stated,
            "target": cell.target,
            "scene_file": str(cell.path),
            "seed": self.settings.seed,
            "target_error": self.settings.target_error,
            "status": "failed",
            "message": "",
            "certificate": None,
            "metrics": {},
            "regions": {},
            "curves": {},
            "blob": None,
            "ledger": [],
            "truths": {},
            "environment_id": None,
            "lights": [],
            "headroom": [],
            "cost": {},
            "images": {},
            "mapping": [],
            "notes": [],
            "warnings": [],
            "fit": None,
            "technique_info": technique.to_json(),
            "reproduce": reproduce(cell, self.settings),
        }
        files: dict[str, Path] = {}
        try:
            self._fill(cell, technique, result, files)
        except (MachineLacks, Unwritable):
            raise
        except EvalsuiteError as error:  # this cell's own trouble: an object out of view, a worker's death
            result["message"] = str(error)
        result["cost"]["wall_s"] = round(time.perf_counter() - started, 3)
        return result, files

    def _fill(self, cell: Cell, technique: Technique, result: dict, files: dict[str, Path]) -> None:
        reason, source, parameters = self.prepared(cell)
        if reason:
            result |= {"status": "skipped", "message": reason}
            return
        outline = self.outline(self.source(cell))
        if outline.environment:
            result["warnings"] += outline.environment.notes
            result["notes"] += outline.environment.remarks
        result["notes"] += [f"Drawn by Mitsuba only: {name}" for name in outline.mitsuba_only]
        kept = [key for bound in source.bindings.values() for key, value in bound.items() if value == OWN]
        certificate = self.certificate(source)
        result["certificate"] = certificate
        image, image_meta, image_cached, image_key = self.image(source, technique, parameters)
        if self.settings.ledger and certificate["passed"] and self._lifts(technique, cell.target, image_meta["parameters"]):
            self.ahead(self.lifted, source, technique, image_meta["parameters"])  # Mitsuba need not wait for formulas
        reference, reference_meta, reference_cached, reference_key = self.reference(
            source, cell.target, self.settings.seed, DecompositionSettings.of(parameters)
        )
        result["all_parameters"] = image_meta["parameters"] | dict.fromkeys(kept, "the scene's own bitmap") | dict(cell.defines)
        result["reference_id"] = reference_key[:16]  # cells with the same have the very same reference
        self._told(image_meta, reference_meta, image_cached and reference_cached, result)
        if (image / "probe.npz").exists():
            result["probe"] = surroundings.probe_error(self, source, image / "probe.npz")
        self._worst(reference, reference_meta, result, files)
        lit = cell.target != LOOKUP
        if lit and outline.environment.radiance.shape == (1, 1, 3) and source.bindings and not kept:
            # In a furnace the truth is albedo × radiance: show the albedo itself beside what the technique returns.
            light = float(luminance(outline.environment.radiance)[0, 0])
            result["albedo"] = self.albedo(next(iter(source.bindings.values()))) | {"radiance": light}
        files |= {
            "image": image / "image.exr",
            "reference": reference / "reference.exr",
            "standard_error": reference / "standard_error.exr",
        }
        environment, facts = environment_view.view(self, source, technique, cell.target, parameters) if lit else (None, {})
        files |= {"environment": environment} if environment else {}
        result |= facts
        if (image / "standard_error.exr").exists():
            files["image_standard_error"] = image / "standard_error.exr"
        if not certificate["passed"]:
            result |= {
                "status": "uncertified",
                "message": "the renderers do not see the same scene: " + "; ".join(certificate["reasons"]),
            }
            return
        if self.settings.ledger:
            self._begin_next_truth(technique, cell.target, source, image_meta["parameters"])
        surfaces = self.surfaces(source, cell.target, DecompositionSettings.of(parameters))
        place, meta = self.comparison((image, image_key), (reference, reference_key), self.seen(source).coverage, surfaces)
        result |= {name: meta[name] for name in SCORED} | {"status": "scored"}
        result["notes"] += meta["notes"]
        files |= {name: place / f"{name}.exr" for name in ("error", "relative", "zscore", "flip", "mask", "regions")}
        if cell.headroom:
            truth, seen = (reference, reference_key), self.seen(source).coverage
            result["headroom"] = [
                headroom.headroom(self, free, source, technique, parameters, image_meta["parameters"], truth, seen)
                for free in headroom.free_parameters(technique, cell.target)
            ]
            if not result["headroom"]:
                result["notes"].append(f"Headroom: {technique.id} has no parameter that is free against {cell.target}")
        if self.settings.ledger:
            self._ledger(technique, cell.target, source, image_meta["parameters"], (image, image_key), result, files)

    def _told(self, drawn: Mapping, rendered: Mapping, cached: bool, result: dict) -> None:
        """What a picture and a reference say of themselves. drawn, rendered: their facts in the store."""
        result |= {"mapping": drawn["mapping"], "fit": drawn["fit"], "reached_error": rendered["reached_error"]}
        result["notes"] += drawn["notes"]
        result["cost"] = {
            **drawn["cost"],
            "reference_s": rendered["seconds"],
            "reference_spp": rendered["spp"],
            **({"reference_spp_max": rendered["spp_max"]} if "spp_max" in rendered else {}),
            "cached": cached,
        }
        if rendered["capped"]:
            result["warnings"].append(
                f"sampling stopped at the cap of {rendered['spp']} spp: the reference's relative standard error is "
                f"{rendered['reached_error']:.2%}, asked for was {self.settings.target_error:.2%}"
            )

    def _worst(self, reference: Path, meta: Mapping, result: dict, files: dict[str, Path]) -> None:
        """What there is to say of a reference whose pixels differ in their samples."""
        if (asked := self.settings.worst_error) is None:
            return
        reached = meta["reached_worst_error"]
        result |= {"worst_error": asked, "reached_worst_error": reached}
        files["spp"] = reference / "spp.exr"
        if reached > asked:
            result["warnings"].append(
                f"the worst pixel's standard error is {reached:.2%} of the mean radiance, asked for was {asked:.2%}: the cap of "
                f"{self.settings.cap} samples a pixel, or noise that the first passes had not shown"
            )

    def _lifts(self, technique: Technique, target: str, parameters: Mapping) -> bool:
        """Whether the ledger of a cell goes on below its truths, by lifting the technique's assumptions."""
        below = any(name == "unoccluded" for name, _ in truths(technique, target, parameters, True))
        return below and bool(technique.lifted(parameters))

    def _begin_next_truth(self, technique: Technique, target: str, source: SceneSource, parameters: Mapping) -> None:
        """Begin the next reference of a cell's ledger, one at a time: Mitsuba need not wait for the comparison."""
        for name, _ in truths(technique, target, parameters, False)[1:2]:
            self.ahead(self.reference, source, name, self.settings.seed, DecompositionSettings.of(parameters))

    def _ledger(
        self,
        technique: Technique,
        target: str,
        source: SceneSource,
        parameters: Mapping,
        image: tuple[Path, str],
        result: dict,
        files: dict[str, Path],
    ) -> None:
        """The cell's error by cause, from its target down to the picture. parameters: all of the technique's."""
        causes: list[str] = []
        lifted = None
        if self._lifts(technique, target, parameters):
            folder, meta, key = self.lifted(source, technique, parameters)
            causes, lifted = meta["causes"], (folder, key) if meta["causes"] else None
            result["notes"] += [f"Ledger: {meta['note']}"] if meta["note"] else []
        chain, references = truths(technique, target, parameters, bool(causes)), []
        if not chain:
            return
        for name, _ in chain:
            folder, meta, _, key = self.reference(source, name, self.settings.seed, DecompositionSettings.of(parameters))
            references.append((folder, key))
            if name != target:
                result["truths"][name] = key[:16]
                files[f"target-{name}"] = folder / "reference.exr"
            if meta["capped"] and name != target:
                result["warnings"].append(f"the reference of {name} stopped at the cap, at {meta['reached_error']:.2%}")
        place, meta = self.chain(image, references, self.seen(source).coverage, lifted)
        names = [*(name for name, _ in chain), *(LIFTED.get(cause, cause) for cause in reversed(causes)), technique.id]
        rungs = [*(cause for _, cause in chain), *reversed(causes)]
        result["ledger"] = [
            {"rung": cause, "from": start, "to": end, **rung}
            for cause, (start, end), rung in zip(rungs, pairwise(names), meta["rungs"], strict=True)
        ]
        result |= {"ledger_total": meta["total"], "ledger_closure": meta["closure"]}
        files |= {f"rung-{k}": place / f"rung-{k}.exr" for k in range(len(rungs))}

    def findings(self, made: Sequence[tuple[dict, Mapping[str, Path]]]) -> dict:
        """What finished cells say together (`compare.findings`), kept while nothing they hold changes but the time they took."""
        from evalsuite.compare.findings import findings

        timing = {"wall_s", "cached", "reference_s"}
        facts = [cell | {"cost": {k: v for k, v in cell["cost"].items() if k not in timing}} for cell, _ in made]
        key = digest([facts, source_digest("compare")])
        return self.once("findings", key, lambda: self.store.put("findings", key, findings(made)))[1]


def reproduce(cell: Cell, settings: Settings) -> str:
    """The command that makes this cell again, whatever report it stands in."""
    words = [
        "evalsuite",
        "run",
        "--scene",
        cell.scene if cell.path.parent == builtin.scenes_directory() else str(cell.path),
        "-t",
        cell.technique,
        "--target",
        cell.target,
    ]
    for name, value in (*cell.parameters.items(), *cell.defines.items()):
        words += ["-p", f"{name}={value}"]
    if cell.environment:
        words += ["--env", cell.environment if cell.environment_path.name != cell.environment else str(cell.environment_path)]
    words += ["--target-error", f"{settings.target_error:g}"]
    if settings.worst_error is not None:
        words += ["--worst-error", f"{settings.worst_error:g}"]
    if settings.cap != usual_cap(settings.target_error):
        words += ["--cap", str(settings.cap)]
    if cell.headroom:
        words.append("--headroom")
    if not settings.ledger:
        words.append("--no-ledger")
    if settings.size:
        words += ["--size", "{}x{}".format(*settings.size)]
    if settings.repair_environment:
        words.append("--repair-env")
    if settings.seed:
        words += ["--seed", str(settings.seed)]
    return shlex.join(words)


def run_cells(run: Run, cells: list[Cell]) -> list[tuple[dict, dict[str, Path]]]:
    """Evaluate cells, several at a time so that both renderers and the comparisons stay busy; results in the given order.

    Every scene is loaded before the first is rendered, so bad input is refused (EvalsuiteError) at once and costs nothing."""
    run.host()
    for source in {digest(run.source(cell)): run.source(cell) for cell in cells}.values():
        try:
            run.outline(source).require_drawable()
        except WorkerFailed:  # kept with the step: each cell of this scene will say so, the other scenes go on
            continue
    return evaluate_all([(run, cell) for cell in cells])


def evaluate_all(asked: Sequence[tuple[Run, Cell]]) -> list[tuple[dict, dict[str, Path]]]:
    """`run_cells` of runs that share their steps, of scenes that are known to load."""
    if not asked:
        return []
    results: list = [None] * len(asked)
    workers = asked[0][0].workers

    gate, ended, under_way = threading.Condition(), threading.Event(), 0

    def one(index: int) -> None:
        nonlocal under_way
        with gate:
            while under_way >= workers.cells and not ended.is_set():
                gate.wait(1.0)  # workers may come meanwhile
            under_way += 1
        if ended.is_set():
            return
        try:
            run, cell = asked[index]
            results[index] = run.evaluate(cell)
            run.progress.cell(results[index][0])
        finally:
            with gate:
                under_way -= 1
                gate.notify()

    pool = ThreadPoolExecutor(min(len(asked), MOST_CELLS))
    try:
        for future in [pool.submit(one, index) for index in range(len(asked))]:
            future.result()
    except BaseException:
        ended.set()
        pool.shutdown(wait=False, cancel_futures=True)
        workers.close()
        raise
    pool.shutdown()
    return results
