"""evalsuite as a user starts it: the command line in a process of its own, with a store of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.figure import NotMeasured


def evalsuite(words: Sequence[str], store: Path) -> None:
    """Run `evalsuite words…`. Raises NotMeasured with its last line where it fails."""
    command = [sys.executable, "-m", "evalsuite.cli", *words]
    environment = os.environ | {"EVALSUITE_CACHE": str(store)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or ["nothing said"]
        raise NotMeasured(f"`evalsuite {' '.join(words)}` ended with exit code {done.returncode}: {said[-1]}")
