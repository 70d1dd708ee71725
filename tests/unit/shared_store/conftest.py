"""Shared stores of each sort, and two machines' stores about one."""

from __future__ import annotations

import logging
import uuid

import pytest

from evalsuite.store.cache import Store


@pytest.fixture(scope="session")
def s3_server():
    """Where an S3 server listens, in a thread. One for all tests, as fsspec keeps its clients."""
    pytest.importorskip("s3fs")
    server = pytest.importorskip("moto.server").ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server.start()
    yield "http://{}:{}".format(*server.get_host_and_port())
    server.stop()


@pytest.fixture
def s3(s3_server, monkeypatch):
    """An S3 server whose only user's keys are in the environment."""
    keys = {"AWS_ACCESS_KEY_ID": "somebody", "AWS_SECRET_ACCESS_KEY": "secret-of-somebody", "AWS_DEFAULT_REGION": "us-east-1"}
    for name, value in (keys | {"AWS_ENDPOINT_URL_S3": s3_server}).items():
        monkeypatch.setenv(name, value)


@pytest.fixture(params=["path", "file", "memory", "s3"])
def url(request, tmp_path) -> str:
    """A shared store of each sort, empty."""
    if request.param == "s3":
        request.getfixturevalue("s3")
        import s3fs

        bucket = f"bucket-{uuid.uuid4().hex[:8]}"
        s3fs.S3FileSystem().mkdir(bucket)
        return f"s3://{bucket}/evalsuite"
    other = {"path": str(tmp_path / "common"), "file": (tmp_path / "common").as_uri(), "memory": f"memory://{uuid.uuid4().hex}"}
    return other[request.param]


@pytest.fixture
def two(tmp_path):
    """Makes two machines' stores with a shared one between them, and what they say."""

    def make(url, **options) -> tuple[Store, Store, list[str]]:
        said: list[str] = []
        return *(Store(tmp_path / name, shared=str(url), warn=said.append, **options) for name in "AB"), said

    return make
