"""`evalsuite serve`, asked by real requests: the folder's files, to this machine, and nothing else."""

from __future__ import annotations

import http.client
import socket
import threading

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.report import serving

SECRET = "not for the web"


@pytest.fixture(scope="module")
def ask(tmp_path_factory):
    """Send a path as it is (no client tidies it) and get (status, headers, body)."""
    outside = tmp_path_factory.mktemp("outside")
    report = outside / "report é"
    (report / "cells" / "a=1 b").mkdir(parents=True)
    (report / "index.html").write_text("<title>page</title>", encoding="utf-8")
    (report / "cells" / "a=1 b" / "image.webp").write_bytes(b"picture")
    (report / "cells" / "é.html").write_text("cell", encoding="utf-8")
    (report / ".hidden").write_text(SECRET)
    (outside / "secret.html").write_text(SECRET)
    (report / "link.html").symlink_to(outside / "secret.html")
    (report / "linked").symlink_to(outside)
    (report / "circle").symlink_to(report / "circle")
    (report / "own.html").symlink_to(report / "index.html")
    server = serving.server(report, 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()

    def request(path, method="GET", **headers):
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
        connection.putrequest(method, path, skip_host="Host" in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        response = connection.getresponse()
        return response.status, response.headers, response.read().decode("utf-8", "replace")

    request.server = server
    yield request
    server.shutdown()
    server.server_close()


def test_files_of_the_report(ask):
    for path in ("/", "/index.html", "/?cell=a#b", "/own.html", "//index.html"):
        status, headers, body = ask(path)
        assert (status, body, headers["Content-Type"]) == (200, "<title>page</title>", "text/html; charset=utf-8"), path
    assert ask("/cells/a%3D1%20b/image.webp")[2] == "picture" and ask("/cells/%C3%A9.html")[2] == "cell"
    status, headers, body = ask("/index.html", "HEAD")
    assert status == 200 and headers["Content-Length"] == "19" and body == ""
    assert headers["X-Content-Type-Options"] == "nosniff" and "'self'" in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    "path",
    ["/../secret.html", "/%2e%2e/secret.html", "/..%2fsecret.html", "/%2E%2E%2Fsecret.html", "/cells/../../secret.html",
     "/cells/%2e%2e/%2e%2e/secret.html", "/%252e%252e/secret.html", "/..%5csecret.html", "/..\\secret.html", "//../secret.html",
     "/./../secret.html", "/%c0%ae%c0%ae/secret.html", "/..%00/secret.html", "/index.html%00.png", "/link.html",
     "/linked/secret.html", "/linked/report%20%C3%A9/../secret.html", "/circle", "/.hidden", "/%2ehidden", "/etc/passwd",
     "//etc/passwd",
     "/c:/secret.html", "/file:///etc/passwd", "/cells", "/cells/", "/cells/a=1%20b/", "/none.html", "/" + "a" * 5000, "/%ff"],
)  # fmt: skip
def test_nothing_else(ask, path):
    status, _, body = ask(path)
    assert status in (403, 404) and SECRET not in body and "secret" not in body and "root:" not in body


def test_only_reading_and_only_from_here(ask):
    assert ask("/index.html", "POST")[0] == ask("/index.html", "PUT")[0] == ask("/index.html", "DELETE")[0] == 501
    assert ask("/", Host="evil.example")[0] == 403
    assert ask("/", Host=f"localhost:{ask.server.server_port}")[0] == 200
    assert ask.server.server_address[0] == "127.0.0.1"
    assert ask("http://evil.example/../secret.html", Host="localhost")[0] == 404
    with socket.create_connection(("127.0.0.1", ask.server.server_port), timeout=10) as raw:
        raw.sendall(b"GET ../secret.html HTTP/1.0\r\n\r\n")
        assert b"404" in raw.recv(4000).split(b"\r\n")[0]


def test_a_folder_without_a_page_and_a_port_in_use(ask, tmp_path):
    with pytest.raises(EvalsuiteError, match="without index"):
        serving.server(tmp_path, 0)
    (tmp_path / "index.html").write_text("x")
    for port in (ask.server.server_port, 70000):
        with pytest.raises(EvalsuiteError, match=f"--port {port}"):
            serving.server(tmp_path, port)
