"""What a Dask worker does with a task of ours: find the files, hand it to a process of its own, send back what that returns.

Native code runs in a lane as it does at home (`execute.local`): it may abort or hang and costs one task, and meanwhile the Dask
worker answers its scheduler."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.execute.local import Pool
from evalsuite.scene import builtin
from evalsuite.scene.dependencies import dependencies
from evalsuite.scene.model import SceneSource
from evalsuite.store.cache import Store, file_digest, package_versions, source_digest

_VERSIONS = ("evalsuite", "mitsuba", "drjit", "numpy", "scipy", "OpenEXR", "flip-evaluator", "scikit-image")


@dataclass(frozen=True)
class Stored:
    """A file or folder of an entry of the store. root, shared: of the store of who sends it; name: within the entry."""

    root: Path
    shared: str
    kind: str
    key: str
    name: str = ""


@dataclass(frozen=True)
class Shipped:
    """A file that comes with evalsuite, wherever that is installed. name: within its folder of scenes."""

    name: str


@dataclass(frozen=True)
class Placed:
    """A scene whose files are to be the same here. path, environment: where they are. digests: SHA-256 of all files, sorted."""

    source: SceneSource
    path: object
    environment: object
    digests: tuple[str, ...]


@cache
def code() -> Mapping[str, str]:
    """What decides a result here: versions of packages, and evalsuite's own code."""
    return {**package_versions(*_VERSIONS), "evalsuite's code": source_digest("**/*.py")[:12]}


def sent(value: object, store: Store) -> object:
    """An argument as it travels: paths by what they stand for."""
    if isinstance(value, SceneSource):
        plain = replace(value, path=Path(), environment=None)
        return Placed(plain, sent(value.path, store), sent(value.environment, store), _digests(value))
    if isinstance(value, str | Path) and Path(value).is_absolute():
        path = Path(value)
        if path.is_relative_to(store.root) and len(parts := path.relative_to(store.root).parts) > 2:
            _share(store, parts[0], parts[2])
            return Stored(store.root, store.shared.url if store.shared else "", parts[0], parts[2], "/".join(parts[3:]))
        scenes = builtin.scenes_directory()
        return Shipped(str(path.relative_to(scenes))) if path.is_relative_to(scenes) else value
    if isinstance(value, Mapping):
        return {key: sent(item, store) for key, item in value.items()}
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        return type(value)(sent(item, store) for item in value)
    return value


def _digests(source: SceneSource) -> tuple[str, ...]:
    files = dependencies(source.path, source.defines) + ([source.environment] if source.environment else [])
    return tuple(sorted(file_digest(path) for path in files))


def _share(store: Store, kind: str, key: str) -> None:
    """See to it that an entry is in the shared store, if there is one: it may be older than that."""
    entry = (store.root, store.shared.url, kind, key) if store.shared else None
    if entry and entry not in _sent:
        store.share(kind, key)
        _sent.add(entry)


_sent: set[tuple] = set()


def found(value: object) -> object:
    """The argument again, with paths of this machine. Raises EvalsuiteError for what this machine does not see."""
    if isinstance(value, Stored):
        place = Store(value.root, shared="").path(value.kind, value.key)
        if not place.is_dir():
            entry = _store(value.shared).get(value.kind, value.key)
            if entry is None:
                fix = "give all machines one folder (EVALSUITE_CACHE) or one shared store (EVALSUITE_SHARED)"
                raise EvalsuiteError(f"{_here()}, {place}", "no such entry", "what the run has made so far", fix)
            place = entry[0]
        return place / value.name
    if isinstance(value, Shipped):
        return builtin.scenes_directory() / value.name
    if isinstance(value, Placed):
        source = replace(value.source, path=found(value.path), environment=found(value.environment))
        fix = "put scenes and maps where all machines see them under the same path"
        try:
            digests = _digests(source)
        except (OSError, EvalsuiteError) as error:
            got = error.got if isinstance(error, EvalsuiteError) else error.strerror or "an error"
            raise EvalsuiteError(f"{_here()}, {source.path}", got, "the run's own files", fix) from error
        if digests != value.digests:
            raise EvalsuiteError(f"{_here()}, {source.path}", "another scene of that name", "the run's own files", fix)
        return source
    if isinstance(value, Mapping):
        return {key: found(item) for key, item in value.items()}
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        return type(value)(found(item) for item in value)
    return value


def run(expected: Mapping[str, str], function: str, *arguments: object) -> object:
    """A task of a run elsewhere. expected: its `code`. Raises what the function raises, and EvalsuiteError for a worker that
    would not find the same."""
    ours = code()
    other = [f"{name} {ours.get(name)} (there {value})" for name, value in expected.items() if ours.get(name) != value]
    if other:
        raise EvalsuiteError(
            _here(), ", ".join(other), "the same as where the run was started", "install the same on all machines"
        )
    return _pool().call(function, *(found(argument) for argument in arguments))


@cache
def _store(shared: str) -> Store:
    return Store(shared=shared)


_starting = threading.Lock()


def _pool() -> Pool:
    with _starting:  # `cache` alone lets two threads make two
        return _made()


@cache
def _made() -> Pool:
    from distributed import get_worker

    # Dask starts its workers as daemons, which may have no children: a rule for those that would be left behind. Ours end with
    # their parent (`local._start_worker`).
    multiprocessing.process.current_process()._config["daemon"] = False
    return Pool("cluster", get_worker().state.nthreads, threads=1)


def _here() -> str:
    from distributed import get_worker

    try:
        return f"worker {get_worker().address}"
    except ValueError:
        return "worker"
