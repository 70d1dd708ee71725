"""`figures.lock.json`: what the numbers of the figures rest on, and whether they come out again.

Every number of a figure's ID.json names the results behind it; a result is the SHA-256 of each of its pictures. Made again, a
figure *reproduces* where all its numbers and results are the same, *within noise* where results differ and no number moved
farther than its interval and the old one together, and else *no longer reproduces*.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evalsuite.errors import EvalsuiteError
from evalsuite.store.cache import digest, file_digest, write_atomic
from evalsuite.store.json_file import read_json

SCHEMA = "evalsuite.figures/1"
NAME = "figures.lock.json"
SAME, NOISE, MOVED = "reproduces", "within noise", "no longer reproduces"
#: Relative difference of numbers without an interval that counts as none: they are sums in float64, in another order perhaps.
ROUNDING = 1e-6
#: Largest side of a picture [pixels], as for --size.
LARGEST = 16384


@dataclass(frozen=True)
class Check:
    """A figure made again. changes: each number that moved beyond its interval, or is gone or new, in words. results: ids of the
    results whose pictures are others."""

    id: str
    verdict: str
    changes: Sequence[str] = field(default_factory=tuple)
    results: Sequence[str] = field(default_factory=tuple)


def entry(numbers: Mapping, results: Mapping[str, Mapping[str, str]]) -> dict[str, Any]:
    """A figure's part of the lock. numbers: its ID.json. results: id → name of a picture → SHA-256; none for a figure that is
    computed, which then rests on all its numbers together."""
    rows = {}
    for path, value in _numbers(numbers):
        cell = next((name for name in results if path.startswith(f"cells/{name}/")), None)
        rows[path] = value | {"behind": [cell] if cell else sorted(results) or ["computed"]}
    behind = dict(results) or {"computed": {"numbers": digest([(path, row) for path, row in rows.items()])}}
    return {"title": numbers["title"], "stand_ins": numbers.get("stand_ins", {}), "numbers": rows, "results": behind}


def _numbers(value: Any, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every number of a figure's JSON with its place; {"value", "ci95"} is one. What says it is a time, `timing`, does not come
    out twice and is left out."""
    if isinstance(value, Mapping):
        if value.get("timing"):
            return
        if "value" in value and "ci95" in value:
            yield path, {"value": value["value"], "ci95": value["ci95"]}
            return
        for key, inner in value.items():
            yield from _numbers(inner, f"{path}/{key}" if path else str(key))
    elif isinstance(value, list | tuple):
        for index, inner in enumerate(value):
            yield from _numbers(inner, f"{path}/{index}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, {"value": value}


def results_of(cells: Sequence[Mapping], directory: Path) -> dict[str, dict[str, str]]:
    """SHA-256 of the picture, the truth and its standard error of each cell; its status where it has none."""
    names = ("image", "reference", "standard_error")
    return {
        cell["id"]: {name: file_digest(directory / cell["images"][name]) for name in names if name in (cell["images"] or {})}
        or {"status": cell["status"]}
        for cell in cells
    }


def write(directory: Path, asked: Mapping, entries: Mapping[str, Mapping]) -> Path:
    """Write the lock of a folder. Of an earlier one that was asked for alike, other figures stay; a damaged one goes."""
    place, kept = directory / NAME, {}
    with contextlib.suppress(EvalsuiteError):
        earlier = read(place)
        kept = earlier["figures"] if earlier["asked"] == asked else {}
    made = {"schema": SCHEMA, "asked": dict(asked), "figures": {**kept, **entries}}
    write_atomic(place, json.dumps(made, indent=1, ensure_ascii=False) + "\n")
    return place


def read(place: Path) -> dict:
    """A lock. Raises EvalsuiteError for a file that is none."""
    try:
        lock = read_json(place)
    except FileNotFoundError as error:
        raise EvalsuiteError(
            place, "no such file", "the lock of figures made before", "type `evalsuite figures` first"
        ) from error
    except (OSError, ValueError) as error:
        raise EvalsuiteError(place, f"no lock ({error})", SCHEMA, "make the figures again") from error
    if not isinstance(lock, dict) or lock.get("schema") != SCHEMA:
        found = lock.get("schema") if isinstance(lock, dict) else type(lock).__name__
        raise EvalsuiteError(place, f"schema {found!r}", SCHEMA, "make the figures again")
    for part, holds in (("asked", _is_asked), ("figures", _are_entries)):
        if not holds(lock.get(part)):
            raise EvalsuiteError(place, f"'{part}' not as written", SCHEMA, "make the figures again")
    return lock


def _is_asked(asked: Any) -> bool:
    if not isinstance(asked, dict):
        return False
    size = asked.get("size")
    sized = size is None or (
        isinstance(size, list) and len(size) == 2 and all(type(n) is int and 1 <= n <= LARGEST for n in size)
    )
    given = [asked.get(option) for option in ("env", "mesh")]
    files = all(isinstance(own, dict) and all(isinstance(one, dict) and _is_name(one.get("file")) for one in own.values())
                for own in given)  # fmt: skip
    error, cap = asked.get("target_error"), asked.get("cap")
    return sized and files and _is_number(error) and 0 < error < 1 and type(cap) is int and cap >= 1


def _are_entries(entries: Any) -> bool:
    def is_row(row: Any) -> bool:
        ends = row.get("ci95", [None, None]) if isinstance(row, dict) and "value" in row else None
        paired = isinstance(ends, list) and len(ends) == 2
        return paired and all(value is None or _is_number(value) for value in (row.get("value"), *ends))

    def is_entry(one: Any) -> bool:
        parts = [one.get("numbers"), one.get("results")] if isinstance(one, dict) else [None]
        return all(isinstance(part, dict) for part in parts) and all(is_row(row) for row in parts[0].values())

    return isinstance(entries, dict) and all(is_entry(one) for one in entries.values())


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and bool(value) and "\0" not in value


def check(name: str, locked: Mapping, made: Mapping) -> Check:
    """A figure's entry in the lock against the same made again."""
    before, after = locked["numbers"], made["numbers"]
    changes = [f"{path}: gone" for path in before.keys() - after.keys()]
    changes += [f"{path}: new" for path in after.keys() - before.keys()]
    for path in before.keys() & after.keys():
        if moved := _moved(before[path], after[path]):
            changes.append(f"{path}: {moved}")
    known = locked["results"]
    others = [result for result, pictures in made["results"].items() if known.get(result) != pictures]
    verdict = MOVED if changes else NOISE if others else SAME
    return Check(name, verdict, tuple(sorted(changes)), tuple(others))


def _moved(old: Mapping, new: Mapping) -> str | None:
    a, b = old["value"], new["value"]
    if a == b:
        return None
    if a is None or b is None:
        return f"{a} → {b}"
    reach = sum(max(abs(end - row["value"]) for end in row["ci95"] if end is not None)
                for row in (old, new) if any(end is not None for end in row.get("ci95") or ()))  # fmt: skip
    if abs(a - b) <= max(reach, ROUNDING * max(abs(a), abs(b))):
        return None
    return f"{a:.6g} → {b:.6g}"
