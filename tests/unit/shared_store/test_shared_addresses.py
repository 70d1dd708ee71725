"""What a shared store may be called, and what is never shown of it."""

from __future__ import annotations

import sys

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.store import shared
from evalsuite.store.cache import Store
from evalsuite.store.place import Place
from evalsuite.store.shared import Shared
from tests.unit.shared_store.entries import fill

pytest.importorskip("fsspec")


@pytest.mark.parametrize(
    "url, word",
    [
        ("nosuch://bucket/x", "protocol 'nosuch'"),
        ("s3://", "no bucket or folder"),
        ("file:///", "no bucket or folder"),
        ("s3:/bucket/x", "no URL"),
        ("://bucket", "no URL"),
        ("s 3://bucket", "no URL"),
        ("simplecache::s3://bucket", "no URL"),
        ("/tmp/a\nb", "no URL"),
        ("gs://bucket/x", "pip install gcsfs"),
    ],
)
def test_wrong_addresses(tmp_path, monkeypatch, url, word):
    monkeypatch.setitem(sys.modules, "gcsfs", None)  # whether it is installed or not
    with pytest.raises(EvalsuiteError) as error:
        Store(tmp_path, shared=url)
    assert word in str(error.value) and "EVALSUITE_SHARED" in str(error.value) and error.value.exit_code == 2
    monkeypatch.setenv("EVALSUITE_SHARED", url)
    (check,) = shared.checks()
    assert not check["ok"] and word in check["text"]


def test_without_fsspec(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(EvalsuiteError, match=r"pip install 'evalsuite\[cluster\]'"):
        Store(tmp_path, shared=str(tmp_path / "common"))
    assert Store(tmp_path).get("image", "ab") is None, "needed by none without a shared store"


def test_doctor_says_what_is_there(tmp_path, monkeypatch):
    monkeypatch.delenv("EVALSUITE_SHARED", raising=False)
    assert shared.checks() == []
    monkeypatch.setenv("EVALSUITE_SHARED", str(tmp_path / "common"))
    Store(tmp_path / "A").put("image", "ab", {}, fill)
    (check,) = shared.checks()
    assert check["ok"] and "1 entries" in check["text"]


@pytest.mark.parametrize("url", ["ftp://anna:hunter2%21@host/x", "http://host/x?token=hunter2%21", "ftp:/anna:hunter2!@host/x"])
def test_credentials_are_never_shown(tmp_path, monkeypatch, url):
    said: list[str] = []

    def fails(*_):
        raise OSError(f"cannot open {url}: hunter2! for anna")

    monkeypatch.setattr(Place, "size", fails)
    monkeypatch.setattr(Place, "put", fails)
    monkeypatch.setattr(Place, "sizes", fails)
    try:
        store = Store(tmp_path, shared=url, warn=said.append)
    except EvalsuiteError as error:
        said.append(str(error))
    else:
        store.put("image", "ab", {}, fill)
        said.append(str(store.shared.facts()))
        assert "cannot open" in said[0]
    assert said and not any("hunter2" in text or "token=" in text for text in said)


def test_secrets_of_the_file_system_are_never_shown(s3, tmp_path):
    shared_ = Shared("s3://bucket/x")
    import s3fs

    shared_.place.__dict__["_at"] = s3fs.S3FileSystem(secret="hidden-one", client_kwargs={"aws_session_token": "hidden-two"}), ""
    assert shared_.place.discreet("hidden-one and hidden-two, us-east-1") == "… and …, us-east-1"
