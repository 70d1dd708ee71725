"""`evalsuite figures`, without its printing: the cells of all chosen figures in one run, then each figure from its own, the page
of all, and the lock."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from evalsuite import commands_rendered, own_meshes
from evalsuite.errors import EvalsuiteError
from evalsuite.execute.local import Lane
from evalsuite.pipeline import Settings
from evalsuite.plan import Report
from evalsuite.report import figures, figures_page
from evalsuite.report.figures import lock
from evalsuite.scene import builtin
from evalsuite.stand_ins import named
from evalsuite.store import results as store_results
from evalsuite.store.cache import file_digest


def make(
    ids: Sequence[str],
    directory: Path,
    maps: Mapping[str, Path],
    meshes: Mapping[str, Path],
    settings: Settings,
    *,
    jobs: int | None,
    read_cache: bool,
    console: Console,
) -> list[tuple[list[Path], dict]]:
    """Draw figures into `directory`, with the run of all their cells in `directory`/cells; paths and measured numbers of each.
    maps, meshes: the papers' own, role → file, as far as given. Raises EvalsuiteError."""
    chosen = figures.choose(ids)
    store_results.prepare(directory)
    report = Report("figures", "The papers' figures", "The cells behind the figures, each against Mitsuba's truth.", ())
    scenes = _scenes(meshes, directory)
    cells = commands_rendered.render(report, [f.id for f in chosen if f.rendered], directory, maps, settings, jobs=jobs,
                                     read_cache=read_cache, console=console, scenes=scenes)  # fmt: skip
    made, entries = [], {}
    for figure in chosen:
        own = cells.get(figure.id)
        made.append(figures.make(figure, directory, own, named(figure.maps, maps)))
        entries[figure.id] = lock.entry(made[-1][1], lock.results_of(own.cells, own.directory) if own else {})
    lock.write(directory, asked(settings, maps, meshes), entries)
    figures_page.write(directory)
    return made


def _scenes(meshes: Mapping[str, Path], directory: Path) -> dict[str, Path]:
    if not meshes:
        return {}
    lane = Lane("reference")  # a broken mesh can take a process down
    try:
        return own_meshes.scenes(meshes, directory, lambda source: lane.call("evalsuite.reference.worker:load_model", source))
    finally:
        lane.close()


def asked(settings: Settings, maps: Mapping[str, Path], meshes: Mapping[str, Path]) -> dict:
    """What figures were asked for, as the lock has it: noise, size, and the papers' own files with their SHA-256."""
    given = {option: {role: {"file": str(path.resolve()), "sha256": file_digest(path)} for role, path in files.items()}
             for option, files in (("env", maps), ("mesh", meshes))}  # fmt: skip
    size = list(settings.size) if settings.size else None
    return {"target_error": settings.target_error, "cap": settings.cap, "size": size, **given}


def lock_of(directory: Path) -> Path:
    """The lock of a folder of figures; where it has none, the one that ships."""
    own = directory / lock.NAME
    return own if own.exists() else builtin.reports_directory() / "figures" / lock.NAME


def _as_locked(where: str, stated: Mapping) -> Path:
    """A user's own file, with the content that it had. Raises EvalsuiteError for one that is gone or was changed."""
    path = Path(stated["file"])
    if not path.is_file():
        raise EvalsuiteError(where, f"{path}, which is gone", "the file it was made with", "put it back")
    if file_digest(path) != stated.get("sha256"):
        raise EvalsuiteError(
            where, f"{path}, which was changed", "the file it was made with", "put it back, or make the figures again"
        )
    return path


def verify(ids: Sequence[str], locked: Path, *, jobs: int | None, read_cache: bool, console: Console) -> list[dict]:
    """Make figures again as a lock says they were made, and hold them against it; one dictionary a figure (`lock.Check`). ids: of
    them; none is all that the lock has. Raises EvalsuiteError for a lock that cannot be read, or files of it gone or changed."""
    whole = lock.read(locked)
    known = [name for name in figures.FIGURES if name in whole["figures"]]
    wanted = [figure.id for figure in figures.choose(ids)] if ids else known
    for name in wanted:
        if name not in known:
            raise EvalsuiteError(f"{locked}, {name}", "not in it", "a figure made before", f"type `evalsuite figures {name}`")
    stated = whole["asked"]
    own = {
        option: {role: _as_locked(f"{locked}, {role}", one) for role, one in stated[option].items()} for option in ("env", "mesh")
    }
    settings = Settings(stated["target_error"], stated["cap"], tuple(stated["size"]) if stated["size"] else None, 0, False,
                        ledger=False)  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="evalsuite-") as folder:
        make(wanted, Path(folder), own["env"], own["mesh"], settings, jobs=jobs, read_cache=read_cache, console=console)
        again = lock.read(Path(folder) / lock.NAME)["figures"]
    return [asdict(lock.check(name, whole["figures"][name], again[name])) for name in wanted]
