"""Content-addressed store: an entry's name is the hash of all that decides its content, so it is never made twice.

An entry is a folder, filled elsewhere on the same disk and renamed into its place in one step: it is there whole or not at all,
whatever kills the process. Concurrent runs may share a store; who comes second throws his copy away. What disks do to an entry
afterwards its checksums tell: a damaged one is never used, but made anew.

Behind it there may be a shared store, which other machines see too (`store.shared`): what is missing here is taken from there,
what is made here is sent there.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterable, Mapping
from dataclasses import is_dataclass
from functools import lru_cache
from importlib import metadata
from pathlib import Path

import numpy as np
import platformdirs

from evalsuite.errors import Unwritable
from evalsuite.image.files import UNFINISHED, file_stamp
from evalsuite.store import checksums
from evalsuite.store.claims import Claim, exclusive, tick, touch
from evalsuite.store.shared import VARIABLE, Shared

#: Suffix of a reference on its way.
PARTIAL = ".state"
SHADERS = (".glsl", ".comp", ".vert", ".frag", ".geom")


def cache_directory() -> Path:
    """$EVALSUITE_CACHE, else the user's cache folder."""
    return Path(os.environ.get("EVALSUITE_CACHE") or platformdirs.user_cache_path("evalsuite"))


def digest(value: object) -> str:
    """SHA-256 (hex) of any nest of plain values, dataclasses, paths and arrays, independent of dictionary order."""
    return hashlib.sha256(json.dumps(_plain(value), sort_keys=True, allow_nan=True).encode()).hexdigest()


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return ["array", str(value.dtype), list(value.shape), hashlib.sha256(np.ascontiguousarray(value)).hexdigest()]
    if isinstance(value, np.generic):
        return value.item()
    if is_dataclass(value) and not isinstance(value, type):
        return _plain({name: getattr(value, name) for name in value.__dataclass_fields__})
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (str, int, float, bool)) or value is None:
        return value
    return str(value)


@lru_cache(maxsize=4096)
def _file_digest(path: Path, stamp: tuple[int, ...]) -> str:
    del stamp  # part of the key: a changed file is read again
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 (hex) of a file's bytes."""
    return _file_digest(path, file_stamp(path))


@lru_cache(maxsize=64)
def source_digest(*modules: str) -> str:
    """Hash of the package's own source files: `source_digest("reference", "gpu/*.py")` takes folders and patterns.
    A result made by other code is another result. Raises ValueError for a pattern that names nothing."""
    root = Path(__file__).resolve().parent.parent
    files: set[Path] = set()
    for module in modules:
        found = root.glob(f"{module}/**/*" if (root / module).is_dir() else module)
        sources = {p for p in found if p.suffix in {".py", *SHADERS}}
        if not sources:
            raise ValueError(module)
        files |= sources
    return digest([[str(p.relative_to(root)), file_digest(p)] for p in sorted(files)])


@lru_cache
def package_versions(*names: str) -> dict[str, str]:
    """Installed versions of distributions, for keys and provenance."""
    found = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "absent"
    return found


class Store:
    """Entries `<root>/<kind>/<key>/`, each with a `meta.json` and checksums. Safe among threads and processes.

    warn: told in one line what the user should know and need not act on. shared: URL of the shared store, "" for none, None for
    $EVALSUITE_SHARED. Raises EvalsuiteError for a URL that can never work."""

    def __init__(
        self,
        root: Path | None = None,
        *,
        read: bool = True,
        warn: Callable[[str], None] = lambda text: None,
        shared: str | None = None,
    ) -> None:
        self.root, self.warn, self._read = Path(root or cache_directory()), warn, read
        self._given = root
        url = os.environ.get(VARIABLE, "") if shared is None else shared
        self.shared = Shared(url, warn) if url else None
        self.written = 0  # bytes of the entries that this object made
        self._claimed: Claim | None = None
        self._claiming = threading.Lock()

    @property
    def description(self) -> tuple[Path | None, str]:
        """(root, URL of the shared store or ""): a worker elsewhere makes `Store(root, shared=url)` of it. The root is None
        unless one was chosen here: each machine has its own. The URL may hold credentials."""
        return self._given, self.shared.url if self.shared else ""

    def path(self, kind: str, key: str) -> Path:
        return self.root / kind / key[:2] / key

    def has(self, kind: str, key: str) -> bool:
        """Whether `get` would look at an entry, here or in the shared store; not whether it is whole."""
        return self._read and (self.path(kind, key).is_dir() or (self.shared is not None and self.shared.has(kind, key)))

    def get(self, kind: str, key: str) -> tuple[Path, dict] | None:
        """Folder and metadata of an entry, fetched from the shared store where it is not here, or None. It stays while this
        process lives."""
        return (self._here(kind, key) or self._fetched(kind, key)) if self._read else None

    def _here(self, kind: str, key: str) -> tuple[Path, dict] | None:
        place = self.path(kind, key)
        if not place.is_dir():
            return None
        try:
            damaged = checksums.damages(place) if self._claim().use(place) else None
            if damaged == []:
                return place, json.loads((place / "meta.json").read_bytes())
        except OSError:
            return None
        if damaged:
            anew = "fetched or made anew" if self.shared else "made anew"
            self.warn(f"{damaged[0].file}: damaged on its disk; {anew} (`evalsuite cache verify` looks for more)")
        return None

    def _fetched(self, kind: str, key: str) -> tuple[Path, dict] | None:
        if self.shared is None:
            return None
        claim, fresh, place = self._claim(), None, None
        try:
            fresh = claim.room()
            if not self.shared.fetch(kind, key, fresh):
                return None
            place = self._place(claim, fresh, self.path(kind, key)) if claim.keeps else fresh
            return place, json.loads((place / "meta.json").read_bytes())
        except OSError:  # what this disk lacks `put` will say
            return None
        finally:
            if fresh not in (None, place):
                shutil.rmtree(fresh, ignore_errors=True)

    def share(self, kind: str, key: str) -> bool:
        """Send an entry that is here to the shared store unless it is there, so that other machines' `get` finds it; whether that
        was done. (`put` sends what it makes, not what was here before there was a shared store.)"""
        if self.shared is None or (found := self._here(kind, key)) is None:
            return False
        return self.shared.send(kind, key, found[0], self._claim().folder / f"{uuid.uuid4().hex[:12]}.zip")

    def put(self, kind: str, key: str, meta: Mapping, fill: Callable[[Path], None] | None = None) -> tuple[Path, dict]:
        """Make an entry: `fill(folder)` writes its files. It goes to the shared store too. Raises Unwritable when the disk is
        full or not writable."""
        place = self.path(kind, key)
        try:
            claim = self._claim()
            fresh = claim.room()
            try:
                if fill is not None:
                    fill(fresh)
                (fresh / "meta.json").write_text(json.dumps(_plain(meta), indent=1))
                checksums.write(fresh)
                self.written += sum(file.stat().st_size for file in fresh.iterdir())
                place = self._place(claim, fresh, place) if claim.keeps else fresh
            except BaseException:
                shutil.rmtree(fresh, ignore_errors=True)
                raise
        except OSError as error:
            raise unwritable(self.root, error) from error
        if self.shared is not None:
            self.shared.send(kind, key, place, claim.folder / f"{fresh.name}.zip", anew=not self._read)
        return place, json.loads((place / "meta.json").read_text())

    def _place(self, claim: Claim, fresh: Path, place: Path) -> Path:
        gone = claim.folder / f"{fresh.name}.old"
        with exclusive(self.root):
            moment = tick(self.root)
            if self._read and place.is_dir() and checksums.damages(place) == []:
                os.replace(fresh, gone)  # another run was first, with the same content
                touch(place, moment)
            else:
                place.parent.mkdir(parents=True, exist_ok=True)
                # `store.kept` tells pictures apart by their times: no two of a store have the same.
                for path in (*fresh.iterdir(), fresh):
                    touch(path, moment)
                if place.exists():
                    os.replace(place, gone)
                os.replace(fresh, place)
        shutil.rmtree(gone, ignore_errors=True)
        return place

    # A reference on its way: overwritten as it grows, gone when it is done.
    def partial(self, key: str) -> Path:
        claim = self._claim()
        return (self.root if claim.keeps else claim.folder) / "partial" / f"{key}{PARTIAL}"

    def entries(self) -> Iterable[tuple[str, Path]]:
        """(kind, folder) of every entry."""
        for meta in sorted(self.root.glob("[!.]*/*/[!.]*/meta.json")):
            yield meta.parent.parent.parent.name, meta.parent

    def _claim(self) -> Claim:
        with self._claiming:
            if self._claimed is None:
                try:
                    self._claimed = Claim(self.root)
                except OSError as error:
                    raise unwritable(self.root, error) from error
                if not self._claimed.keeps:
                    why = self._claimed.problem.strerror
                    self.warn(f"{self.root}: {why}; what the cache lacks is made for this run and not kept")
            return self._claimed


def unwritable(where: Path, error: OSError) -> Unwritable:
    """The one line for a folder that cannot be written: no permission, a full or read-only disk, a file in the way."""
    return Unwritable(
        where,
        error.strerror or str(error),
        "a folder that can be written, with space left",
        "choose another (--out, or EVALSUITE_CACHE for the cache)",
    )


def write_atomic(path: Path, data: bytes | str) -> None:
    """Write a file beside its place and rename it: readers see the old content or the new, never half of it."""
    data = data.encode() if isinstance(data, str) else data
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=UNFINISHED, dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
            os.chmod(name, 0o644)
            os.replace(name, path)
        except OSError:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise unwritable(path.parent, error) from error
