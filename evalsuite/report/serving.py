"""A report's folder over HTTP, to this machine only: its files, and nothing else."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit

from evalsuite.errors import EvalsuiteError

ADDRESS = "127.0.0.1"
#: A page of another site that points a name of its own at this machine is sent away (DNS rebinding).
HOSTS = {ADDRESS, "localhost"}
TYPES = {
    ".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8",
    ".json": "application/json", ".txt": "text/plain; charset=utf-8", ".md": "text/markdown; charset=utf-8", ".csv": "text/csv",
    ".png": "image/png", ".webp": "image/webp", ".svg": "image/svg+xml", ".exr": "image/x-exr",
}  # fmt: skip
HEADERS = {
    "Cache-Control": "no-cache",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; frame-ancestors 'none'",
}


def server(folder: Path, port: int) -> ThreadingHTTPServer:
    """A server of `folder` on 127.0.0.1, to be told `serve_forever`. port: 0 for any free one (`server_port` says which).

    Raises EvalsuiteError if the folder has no page or the port cannot be had."""
    root = Path(folder).resolve()
    if not (root / "index.html").is_file():
        raise EvalsuiteError(folder, "a folder without index.html", "the page of an earlier run", "type `evalsuite run` first")
    try:
        return ThreadingHTTPServer((ADDRESS, port), partial(_Handler, root))
    except (OSError, OverflowError) as error:
        raise EvalsuiteError(
            f"--port {port}", f"no such port to be had ({error})", "a free port, 1024 to 65535", "or 0 for any"
        ) from error


def inside(root: Path, path: str) -> Path | None:
    """The file that a request's path names; None unless it is a plain file that lies within `root` (resolved), with all links
    followed. A folder is no file, but the root is its index.html. Hidden files are none."""
    parts = [part for part in unquote(path, errors="strict").split("/") if part]
    if any(part.startswith(".") or set(part) & set("\\:\0") for part in parts):
        return None
    found = root.joinpath(*(parts or ["index.html"])).resolve(strict=True)
    return found if found.is_file() and found.is_relative_to(root) else None


class _Handler(BaseHTTPRequestHandler):
    server_version, sys_version = "evalsuite", ""
    protocol_version = "HTTP/1.1"
    timeout = 30

    def __init__(self, root: Path, *rest: object) -> None:
        self.root = root
        super().__init__(*rest)

    def do_GET(self) -> None:
        self._answer(shutil.copyfileobj)

    def do_HEAD(self) -> None:
        self._answer(lambda source, target: None)

    def _answer(self, send: Callable) -> None:
        if self.headers.get("Host", ADDRESS).rsplit(":", 1)[0].lower() not in HOSTS:
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        try:
            found = inside(self.root, urlsplit(self.path).path)
            source = found.open("rb") if found else None
        except (OSError, ValueError, RuntimeError):  # not there, not readable, not text, or links in a circle
            source = None
        if source is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        with source:
            self.send_response(HTTPStatus.OK)
            for name, value in HEADERS.items():
                self.send_header(name, value)
            self.send_header("Content-Type", TYPES.get(found.suffix.lower(), "application/octet-stream"))
            self.send_header("Content-Length", str(found.stat().st_size))
            self.end_headers()
            send(source, self.wfile)

    def log_message(self, *_: object) -> None:
        """Says nothing: a page asks for hundreds of files."""
