"""What two runs of the same inputs must have in common to the last bit: results and pictures, times aside."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

#: Durations, the moment of the run, whether the store had it already; and the checkout, which one may edit beside a test.
TIMES = {"created", "wall_s", "reference_s", "gpu_ms", "gpu_ms_ci95", "shadow_ms", "acquire_ms", "prepare_ms", "cached", "git"}


def steady(value: Any) -> Any:
    """Plain data without its times."""
    if isinstance(value, dict):
        return {key: steady(item) for key, item in value.items() if key not in TIMES}
    return [steady(item) for item in value] if isinstance(value, list) else value


def facts(folder: Path) -> dict[str, Any]:
    """results.json as flat {path in it: value}, and the digest of every picture, of a run's folder."""
    found = dict(_flat("results", steady(json.loads((folder / "results.json").read_text()))))
    for path in sorted((folder / "images").rglob("*.exr")):
        found[str(path.relative_to(folder))] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def different(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Names of the facts that differ, with both values."""
    names = sorted(one.keys() | other.keys())
    return [f"{name}: {one.get(name)} | {other.get(name)}" for name in names if one.get(name) != other.get(name)]


def _flat(name: str, value: Any):
    if isinstance(value, dict | list) and value:
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _flat(f"{name}.{key}", item)
    else:
        yield name, json.dumps(value)
