"""System tests type what a user types: the program in a process of its own, with a store of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


@pytest.fixture(scope="session")
def cache(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def evalsuite(cache):
    """evalsuite("run", …, cwd=…) → Outcome."""

    def call(*words: object, cwd: Path | None = None, **environment: str) -> Outcome:
        env = os.environ | {"EVALSUITE_CACHE": str(cache), "COLUMNS": "200"} | environment
        done = subprocess.run(
            [sys.executable, "-m", "evalsuite.cli", *map(str, words)],
            cwd=cwd,
            env=env,
            capture_output=True,
            text=True,
            timeout=500,
            stdin=subprocess.DEVNULL,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return call
