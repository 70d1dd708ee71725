"""Runs a benchmark and keeps what it found, with the machine and the moment, in one JSON file."""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from benchmarks import machine
from benchmarks.figure import NotMeasured
from evalsuite.errors import EvalsuiteError
from evalsuite.store.cache import write_atomic


def measured(name: str, quick: bool) -> dict:
    """{title, quick, created, machine, figures: [Figure as JSON], not_measured: why, or None}."""
    module, found, why = import_module(f"benchmarks.{name}"), [], None
    facts = machine.facts()
    try:
        found = [figure.to_json() for figure in module.measure(quick)]
    except NotMeasured as error:
        why = str(error)
    created = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"title": module.TITLE, "quick": quick, "created": created, "machine": facts, "figures": found, "not_measured": why}


def keep(path: Path, made: Mapping[str, Mapping]) -> None:
    """Put records into the file; those of other benchmarks stay. Raises EvalsuiteError for a file that holds something else."""
    before = {}
    if path.exists():
        try:
            before = json.loads(path.read_text())
        except (OSError, ValueError) as error:
            raise EvalsuiteError(path, "no JSON", "a file that script/bench wrote", "move it away") from error
        if not isinstance(before, dict):
            raise EvalsuiteError(path, "no records by name", "a file that script/bench wrote", "move it away")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, json.dumps(before | dict(made), indent=1, ensure_ascii=False) + "\n")
