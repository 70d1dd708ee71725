"""What the commands do, without their printing: `cli` parses and prints, this connects the parts."""

from __future__ import annotations

import datetime
import importlib.util
import json
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from evalsuite import budget, forecast, rounds
from evalsuite.compare import compare, headroom_pool
from evalsuite.errors import EvalsuiteError, MachineLacks, WorkerFailed
from evalsuite.execute.local import Lane, Workers
from evalsuite.image import exr
from evalsuite.pipeline import Run, Settings, reproduce, run_cells
from evalsuite.plan import Cell, Choice, Report, choice_to_json
from evalsuite.progress_bar import progress_bar
from evalsuite.store import costs, shared
from evalsuite.store import results as store_results
from evalsuite.store.cache import Store, write_atomic


def run_report(
    report: Report,
    cells: list[Cell],
    settings: Settings,
    directory: Path,
    *,
    jobs: int | None,
    scheduler: str | None = None,
    read_cache: bool,
    missing_only: bool,
    until_decided: bool = False,
    budget_s: float | None = None,
    choice: Choice | None = None,
    console: Console,
) -> dict:
    """Make the cells, write results.json and the page into `directory`; returns the results. budget_s: about how long it may
    take, the settings then being the finest to go to."""
    from evalsuite.report import page

    started = time.perf_counter()

    store_results.prepare(directory)
    store_results.no_way_out(directory)
    earlier = store_results.read(directory)["cells"] if missing_only and store_results.finished(directory) else []
    made = {c["id"]: c for c in earlier if c["status"] == "scored"}
    # Only a cell that the same command would make again is not missing: another quality or size is another result.
    kept = {c.id: made[c.id] for c in cells if c.id in made and made[c.id]["reproduce"] == reproduce(c, settings)}
    todo = [cell for cell in cells if cell.id not in kept]
    with (
        progress_bar(console, len(todo), budget_s) as told,
        _workers(jobs, scheduler, store := Store(read=read_cache, warn=told.warn)) as workers,
    ):
        run = Run(store, workers, settings, told)
        if not budget_s:
            run.progress = replace(told, samples=_foretelling(run, todo))
        first = budget.pilot(run, todo, budget_s) if budget_s else run
        fresh = {cell["id"]: (cell, files) for cell, files in run_cells(first, todo)}
        for cell in kept.values():
            files = {name: (directory / path).absolute() for name, path in cell["images"].items()}  # a worker is elsewhere
            fresh[cell["id"]] = (cell, files)
        made = [fresh[cell.id] for cell in cells]
        spent = {}
        if budget_s:
            made, comparisons, spent["budget"] = budget.spend(
                run, first, cells, made, budget_s, lambda: time.perf_counter() - started
            )
        else:
            made, comparisons = rounds.until_decided(run, cells, made) if until_decided else rounds.decide(run, made)
        header = {
            "report": report.name,
            "title": report.title,
            "description": report.description,
            "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "host": run.host() | {"git": _git()},
            "run": _asked(settings, choice or Choice()) | ({"budget_s": budget_s} if budget_s else {}),
            "comparisons": comparisons,
            **spent,
            **run.findings(made),
        }
    found = headroom_pool.summary([cell for cell, _ in made])
    header |= {"headroom_summary": found} if found else {}
    with store_results.writing(directory):
        results = store_results.write(directory, header, made)
        page.write(results, directory)
    if budget_s:
        costs.append(run.store.root, run.costs)
    elif not until_decided:  # both render some references twice
        pairs = [(cell, fresh[cell.id][0]) for cell in todo]
        row = forecast.of_run(run, pairs, directory, time.perf_counter() - started)
        costs.append(run.store.root, [*run.costs, row])
    return results


def _workers(jobs: int | None, scheduler: str | None, store: Store) -> Workers:
    if scheduler is None:
        return Workers(jobs)
    if jobs is not None:
        raise EvalsuiteError(f"--jobs {jobs}", f"also --scheduler {scheduler}", "one of both", "a cluster has the workers it has")
    from evalsuite.execute.cluster import ClusterWorkers

    return ClusterWorkers(scheduler, store)


def predict(
    cells: list[Cell],
    settings: Settings,
    *,
    jobs: int | None,
    scheduler: str | None = None,
    read_cache: bool,
    console: Console,
) -> dict | None:
    """What a run of these cells would take (`forecast.Forecast`); None where the store knows of no earlier one. Raises
    EvalsuiteError for what could not be run."""
    store = Store(read=read_cache)
    if not costs.read(store.root):
        return None
    with _workers(jobs, scheduler, store) as workers, console.status("looking at what there is"):
        found = forecast.forecast(Run(store, workers, settings), cells)
        return found and found.to_json()


def _asked(settings: Settings, choice: Choice) -> dict:
    """What a run was asked for, so that `evalsuite check` can ask for the same."""
    size = list(settings.size) if settings.size else None
    stated = {"target_error": settings.target_error, "cap": settings.cap, "size": size, "seed": settings.seed}
    stated |= {"repair_env": settings.repair_environment, "ledger": settings.ledger}
    stated |= {} if settings.worst_error is None else {"worst_error": settings.worst_error}
    return {**stated, "choice": choice_to_json(choice)}


def _foretelling(run: Run, cells: list[Cell]) -> Callable[[float, float], None]:
    """The run's `progress.samples`, which lets the progress bar be told what the run will take, once a first reference is under
    way (a run whose references are in the store is over before) and if that takes no loading of scenes."""
    samples, pending = run.progress.samples, [cells]

    def expect() -> None:
        if forecast.at_hand(run, cells):
            found = forecast.forecast(run, cells)
            if found:
                run.progress.expect(found.seconds[0], found.samples[0])

    def told(count: float, seconds: float) -> None:
        with suppress(IndexError):
            pending.pop()
            run.ahead(expect)
        samples(count, seconds)

    return told


def _git() -> str | None:
    """Commit of the checkout that evalsuite runs from, with `-dirty` for local changes; None for an installed package."""
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10).stdout.strip() or None
    except (OSError, subprocess.TimeoutExpired):
        return None


def compare_files(image: Path, reference: Path, standard_error: Path | None, mask: Path | None, directory: Path | None) -> dict:
    """Metrics of two pictures; with `directory`, also the error maps and metrics.json there."""
    lane = Lane("compare")
    try:
        return lane.call("evalsuite.commands:_compare_files", image, reference, standard_error, mask, directory)
    finally:
        lane.close()


def _compare_files(image: Path, reference: Path, standard_error: Path | None, mask: Path | None, directory: Path | None) -> dict:
    pictures = [exr.read(path) for path in (image, reference)]
    if pictures[0].shape != pictures[1].shape:
        sizes = ["{1}x{0}".format(*picture.shape[:2]) for picture in pictures]
        raise EvalsuiteError(image, f"a picture of {sizes[0]}", f"{sizes[1]}, the size of {reference}", "render both at one size")
    noise = exr.read(standard_error) if standard_error else None
    inside = exr.read(mask).mean(axis=-1) > 0.5 if mask else None
    try:
        result = compare(*pictures, standard_error=noise, mask=inside)
    except EvalsuiteError as error:  # it names the picture by its role; the user knows it by its file
        files = {"image": image, "reference": reference, "reference standard error": standard_error, "mask": mask}
        raise EvalsuiteError(files.get(error.where) or error.where, error.got, error.expected, error.fix) from error
    if directory is not None:
        store_results.prepare(directory)
        for name in ("difference", "relative", "zscore", "flip_map"):
            picture = getattr(result, name)
            if picture is not None:
                exr.write(directory / f"{ {'difference': 'error', 'flip_map': 'flip'}.get(name, name) }.exr", picture)
        write_atomic(directory / "metrics.json", json.dumps(result.to_json(), indent=1) + "\n")
    return result.to_json()


def examine() -> dict:
    """What `doctor` says: {"checks": [{name, ok, text, fix}], "gl": …, "mitsuba": …}."""
    checks: list[dict] = []

    def ask(name: str, function: str, fix: str) -> dict | None:
        lane = Lane("doctor", limit_s=600)
        try:
            return lane.call(function)
        except (MachineLacks, WorkerFailed) as error:
            checks.append(
                {"name": name, "ok": False, "text": str(error), "fix": error.fix if isinstance(error, MachineLacks) else fix}
            )
        finally:
            lane.close()
        return None

    checks.append(
        {"name": "Python", "ok": sys.version_info >= (3, 11), "text": sys.version.split()[0], "fix": "Python 3.11 or newer"}
    )
    gl = ask("OpenGL", "evalsuite.gpu.worker:probe", "apt-get install libegl1 libgl1-mesa-dri")
    if gl:
        kind = "software" if gl.get("software") else "hardware"
        checks.append({"name": "OpenGL", "ok": True, "text": f"{gl['renderer']}, {gl['version']} ({kind})", "fix": ""})
    mitsuba = ask("Mitsuba", "evalsuite.reference.worker:probe", "pip install mitsuba==3.9.1")
    if mitsuba:
        checks.append(
            {
                "name": "Mitsuba",
                "ok": bool(mitsuba["mitsuba"]),
                "fix": "pip install mitsuba==3.9.1",
                "text": f"{mitsuba['mitsuba']}, Dr.Jit {mitsuba['drjit']}, variants {', '.join(mitsuba['variants']) or 'none'}",
            }
        )
        llvm = mitsuba["llvm"]
        tried = "; ".join(f"{c['path']}: {c['verdict']}" for c in mitsuba["candidates"]) or "none found"
        checks.append(
            {
                "name": "LLVM",
                "ok": llvm is not None,
                "fix": mitsuba["fix"],
                "text": f"{llvm['version']} ({llvm['path']})" if llvm else tried,
            }
        )
    for name, module, package in (
        ("FLIP", "flip_evaluator", "flip-evaluator"),
        ("OpenEXR", "OpenEXR", "OpenEXR"),
        ("FlipBook viewer", "simpleimageio", "simpleimageio"),
    ):
        found = importlib.util.find_spec(module) is not None
        checks.append({"name": name, "ok": found, "text": "installed" if found else "absent", "fix": f"pip install {package}"})
    store = Store(shared="")
    try:
        store_results.prepare(store.root)
        checks.append({"name": "Cache", "ok": True, "text": str(store.root), "fix": ""})
    except EvalsuiteError as error:
        checks.append(
            {"name": "Cache", "ok": False, "text": str(error), "fix": "set EVALSUITE_CACHE to a folder that can be written"}
        )
    return {"checks": checks + shared.checks(), "gl": gl, "mitsuba": mitsuba}


def cache_facts() -> dict:
    """Where the store is, entries and megabytes of each kind; what is in the shared store, None without one."""
    store = Store()
    kinds: dict[str, list[int]] = {}
    for kind, folder in store.entries():
        count = kinds.setdefault(kind, [0, 0])
        count[0] += 1
        count[1] += sum(p.stat().st_size for p in folder.iterdir())
    rows = [{"kind": kind, "entries": n, "megabytes": round(size / 1e6, 1)} for kind, (n, size) in sorted(kinds.items())]
    return {"path": str(store.root), "kinds": rows, "shared": store.shared.facts() if store.shared else None}
