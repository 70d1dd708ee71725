"""A folder of files at a URL that fsspec knows: looked for, fetched, put whole or not at all. Errors are the libraries' own."""

from __future__ import annotations

import os
import re
import uuid
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, unquote

from evalsuite.errors import EvalsuiteError, unknown
from evalsuite.image.files import UNFINISHED

#: Where one request puts a whole object. Elsewhere a file is written beside its place and renamed.
OBJECTS = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az"}
#: Distributions of protocols that fsspec leaves to others; what it says itself of the rest names them too.
PACKAGES = {"s3": "s3fs", "s3a": "s3fs", "gs": "gcsfs", "gcs": "gcsfs", "abfs": "adlfs", "abfss": "adlfs", "az": "adlfs"}
#: Options whose values are nobody's business.
_SECRET = re.compile("key|secret|token|pass|user|sas|sig|cred|connection|auth", re.IGNORECASE)


class Place:
    """url: an fsspec URL or a plain path. shown: the same without credentials. Raises EvalsuiteError for one that can never
    work; whether it answers is seen when it is first asked."""

    def __init__(self, url: str, name: str) -> None:
        self.shown = _shown(url)
        self.protocol = _protocol(url, f"{name} {self.shown}")
        # Another process may have another working directory.
        self.url = url if "://" in url else os.path.abspath(os.path.expanduser(url))

    @cached_property
    def _at(self) -> tuple[Any, str]:
        """The file system and the path in it. Some connect here."""
        from fsspec.core import url_to_fs

        fs, root = url_to_fs(self.url)
        return fs, root.rstrip("/")

    def size(self, name: str) -> int | None:
        """Bytes of a file, None where there is none."""
        fs, root = self._at
        try:
            found = fs.info(f"{root}/{name}")
        except FileNotFoundError:
            return None
        return int(found.get("size") or 0) if found["type"] == "file" else None

    def sizes(self) -> dict[str, int]:
        """Bytes of every file, by its path from here."""
        fs, root = self._at
        files = fs.find(root, detail=True)
        return {name[len(root) + 1 :]: int(about.get("size") or 0) for name, about in files.items()}

    def get(self, name: str, file: Path) -> None:
        """Copy what is here into a file."""
        fs, root = self._at
        fs.get_file(f"{root}/{name}", str(file))

    def put(self, file: Path, name: str) -> None:
        """Copy a file to here, in one step as others see it."""
        fs, root = self._at
        path = f"{root}/{name}"
        if self.protocol in OBJECTS:
            fs.put_file(str(file), path)
            return
        folder = path.rpartition("/")[0]
        aside = f"{folder}/{UNFINISHED}{uuid.uuid4().hex[:12]}"
        fs.makedirs(folder, exist_ok=True)
        try:
            fs.put_file(str(file), aside)
            os.replace(aside, path) if getattr(fs, "local_file", False) else fs.mv(aside, path)
        except BaseException:
            with suppress(Exception):
                fs.rm_file(aside)
            raise

    def discreet(self, text: str) -> str:
        """A library's words in one short line, without what must stay secret."""
        fs, _ = self.__dict__.get("_at", (None, ""))
        hidden = _secrets(self.url) | _secrets_among(getattr(fs, "storage_options", {}))
        for secret in sorted(hidden, key=len, reverse=True):
            text = text.replace(secret, "…")
        return "".join(c if c.isprintable() else "\ufffd" for c in " ".join(text.split()))[:200]


def _protocol(url: str, where: str) -> str:
    """The protocol of a URL, "file" of a plain path; its package is there. Raises EvalsuiteError."""
    scheme, mark, rest = url.partition("://")
    formed = re.fullmatch(r"[A-Za-z][\w+.-]*", scheme) if mark else _is_path(url)
    if not formed or not url.isprintable() or "::" in url:
        raise EvalsuiteError(where, "no URL", "one that fsspec knows, as s3://bucket/folder, or the path of a folder")
    if mark and not rest.split("?")[0].rpartition("@")[2].strip("/"):
        raise EvalsuiteError(where, "no bucket or folder", f"{scheme}://… with a name")
    try:
        import fsspec
    except ImportError:
        raise EvalsuiteError(where, "no fsspec", "the package fsspec", "pip install 'evalsuite[cluster]'") from None
    protocol = scheme if mark else "file"
    try:
        fsspec.get_filesystem_class(protocol)
    except ValueError:
        raise unknown(f"{where}: protocol", protocol, sorted(fsspec.available_protocols()), "fsspec's documentation") from None
    except ImportError as error:
        fix = f"pip install {PACKAGES[protocol]}" if protocol in PACKAGES else f"pip install what it names: {error}"
        raise EvalsuiteError(where, f"no package for {protocol}://", "the one that fsspec needs for it", fix) from None
    return protocol


def _shown(url: str) -> str:
    """A URL without user, password and query, where tokens are."""
    scheme, mark, rest = url.partition("://")
    if _is_path(url):
        return url
    return f"{scheme}://{rest.split('?')[0].rpartition('@')[2]}" if mark else url.rpartition("@")[2]


def _is_path(url: str) -> bool:
    return re.match(r"[^/]*:", url) is None


def _secrets(url: str) -> set[str]:
    """What a URL says that must not be shown, as it stands there and decoded."""
    _, mark, rest = url.partition("://")
    before, _, query = rest.partition("?")
    told = [before.rpartition("@")[0], *before.rpartition("@")[0].split(":"), query, *(value for _, value in parse_qsl(query))]
    return {form for part in told for form in (part, unquote(part)) if mark and len(form) > 2}


def _secrets_among(options: object, named: bool = False) -> set[str]:
    """Strings in a nest of options that have a secret's name, or lie below one."""
    if isinstance(options, dict):
        return set().union(*(_secrets_among(v, named or bool(_SECRET.search(str(k)))) for k, v in options.items()))
    return {options} if named and isinstance(options, str) and len(options) > 2 else set()
