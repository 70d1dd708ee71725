"""The blessed state of a report: `<name>.baseline.json`, a few sorted lines a cell, and `<name>.baseline/`, a picture a cell.

The pictures are checked against the digests in the file. Without them (they may be left out of a repository) a changed picture is
judged by the intervals of its metrics alone."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.gate.record import Record
from evalsuite.store.cache import write_atomic
from evalsuite.store.json_file import read_json
from evalsuite.store.results import slug

SCHEMA = "evalsuite.baseline/1"
#: What the file says of a cell besides its metrics, in this order.
FACTS = (
    "status",
    "blessed",
    "reason",
    "host",
    "technique",
    "target",
    "parameters",
    "seed",
    "target_error",
    "mask_pixels",
    "image",
    "reference",
)


@dataclass(frozen=True)
class Baseline:
    """path: the file. cells: id → facts (`FACTS`) and metrics. hosts: name → where a cell was blessed. run: what made the
    results, choice of cells and settings."""

    path: Path
    cells: Mapping[str, Mapping] = field(default_factory=dict)
    hosts: Mapping[str, Mapping] = field(default_factory=dict)
    run: Mapping = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Where the pictures are."""
        return self.path.with_suffix("")

    def renderer(self, cell: Mapping) -> str | None:
        return self.hosts[cell["host"]].get("gl_renderer")

    def record_path(self, identity: str, digest: str) -> Path:
        return self.folder / f"{slug(identity)}-{digest[:12]}.exr"

    def record(self, identity: str) -> Record | None:
        """The pictures of a cell, None where they are not kept. Raises EvalsuiteError for damaged ones."""
        digest = self.cells[identity].get("image")
        path = self.record_path(identity, digest) if digest else None
        if path is None or not path.exists():
            return None
        found = Record.read(path)
        if found.digest != digest:
            raise EvalsuiteError(path, "another picture than was blessed", f"one of SHA-256 {digest[:12]}…", "bless it again")
        return found

    def text(self) -> str:
        """The file: sorted, a line a fact and a metric, so that a changed number is a changed line."""
        head = [f' "schema": {json.dumps(SCHEMA)}', f' "run": {_line(self.run)}']
        used = {cell["host"] for cell in self.cells.values()}
        hosts = [f"  {json.dumps(name)}: {_line(self.hosts[name])}" for name in sorted(used)]
        cells = []
        for identity, cell in sorted(self.cells.items()):
            lines = [f"   {json.dumps(name)}: {_line(cell[name])}" for name in FACTS if cell.get(name) is not None]
            metrics = [f"    {json.dumps(name)}: {_line(m)}" for name, m in sorted(cell["metrics"].items())]
            lines.append('   "metrics": {' + (f"\n{_joined(metrics)}\n   " if metrics else "") + "}")
            cells.append(f"  {json.dumps(identity, ensure_ascii=False)}: {{\n{_joined(lines)}\n  }}")
        for name, entries in (("hosts", hosts), ("cells", cells)):
            head.append(f' "{name}": {{' + (f"\n{_joined(entries)}\n " if entries else "") + "}")
        return f"{{\n{_joined(head)}\n}}\n"

    def write(self) -> None:
        """Write the file in one step. Raises EvalsuiteError where that cannot be done."""
        write_atomic(self.path, self.text())


def read(path: Path) -> Baseline:
    """Raises EvalsuiteError for a file that is absent, damaged or of another schema, naming the cell at fault."""
    try:
        data = read_json(path)
    except FileNotFoundError:
        raise EvalsuiteError(path, "no such file", "a blessed baseline", "type `evalsuite run`, then `evalsuite bless`") from None
    except (OSError, ValueError) as error:
        fix = "restore it from version control, or delete it and bless again"
        raise EvalsuiteError(path, f"a file that does not read ({error})", "a blessed baseline", fix) from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        got = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise EvalsuiteError(path, f"schema {got!r}", SCHEMA, "bless again with this version")
    run, hosts, cells = (data.get(name) for name in ("run", "hosts", "cells"))
    if not all(isinstance(part, dict) for part in (run, hosts, cells)) or not all(isinstance(h, dict) for h in hosts.values()):
        raise EvalsuiteError(path, "no whole file", "run, hosts and cells", "restore it from version control")
    strange = next((name for name, value in run.items() if value is not None and not RUN.get(name, _anything)(value)), None)
    if strange:
        raise EvalsuiteError(f"{path}, run", f"{strange} = {run[strange]!r}", "what a run can be asked for", "bless again")
    for identity, cell in cells.items():
        fault = _fault(cell, hosts)
        if fault:
            raise EvalsuiteError(f"{path}, {identity}", fault, "a blessed cell", "restore it from version control")
    return Baseline(path, cells, hosts, run)


def _anything(value: object) -> bool:
    return True


def _whole(lowest: int, highest: int = 1 << 31) -> Callable[[object], bool]:
    return lambda value: type(value) is int and lowest <= value <= highest


def _choice(value: object) -> bool:
    if not isinstance(value, dict) or not isinstance(value.get("parameters", {}), dict):
        return False
    lists = [value.get(name, []) for name in ("scenes", "techniques", "targets")]
    values = list(value.get("parameters", {}).values())
    whole = all(isinstance(one, list) for one in lists + values) and isinstance(value.get("environment", ""), str)
    return whole and all(isinstance(word, str) for one in lists for word in one) and all(map(_scalars, values))


def _scalars(values: list) -> bool:
    return bool(values) and all(isinstance(value, str | int | float) for value in values)


#: What of a run is read, and whether it can be asked for again.
RUN: Mapping[str, Callable[[object], bool]] = {
    "target_error": lambda value: isinstance(value, float) and 0 < value < 1,
    "cap": _whole(32),
    "worst_error": lambda value: isinstance(value, float) and 0 < value < 1,
    "size": lambda value: isinstance(value, list) and len(value) == 2 and all(map(_whole(1, 16384), value)),
    "seed": _whole(0),
    "choice": _choice,
}


def _fault(cell: object, hosts: Mapping) -> str | None:
    """What a cell lacks of what is read of it."""
    if not isinstance(cell, dict) or cell.get("status") not in ("scored", "skipped"):
        return "no status"
    if not isinstance(cell.get("host"), str) or cell["host"] not in hosts:
        return "no host"
    if cell["status"] == "scored" and not all(_hex(cell.get(name)) for name in ("image", "reference")):
        return "no digest"
    if not isinstance(cell.get("parameters") or {}, dict):
        return "no whole facts"
    metrics = cell.get("metrics")
    if not isinstance(metrics, dict) or not all(_metric(m) for m in metrics.values()):
        return "no whole metrics"
    if cell["status"] == "scored" and not {"mse", "rel_rmse"} <= set(metrics):
        return "no mse and rel_rmse"
    return None


def _hex(value: object) -> bool:
    return isinstance(value, str) and re.fullmatch("[0-9a-f]{64}", value) is not None


def _metric(value: object) -> bool:
    if not isinstance(value, dict) or not isinstance(value.get("ci95"), list) or len(value["ci95"]) != 2:
        return False
    return all(
        n is None or (isinstance(n, int | float) and not isinstance(n, bool)) for n in (value.get("value", ""), *value["ci95"])
    )


def rounded(metric: Mapping) -> dict:
    """A metric with nine significant digits, more than any interval is narrow."""
    return {"value": _digits(metric["value"]), "ci95": [_digits(end) for end in metric["ci95"]]}


def _digits(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.9g}")


def _line(value: object) -> str:
    return json.dumps(value, sort_keys=True, ensure_ascii=False, allow_nan=False)


def _joined(lines: list[str]) -> str:
    return ",\n".join(lines)
