"""Accepting results as the baseline, cell by cell; the state before is kept, and `undo` brings it back.

What is unchanged stays as it was blessed, with its old provenance: so small changes within a tolerance cannot add up unseen."""

from __future__ import annotations

import difflib
import fnmatch
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from evalsuite.compare.run_folder import Run
from evalsuite.errors import EvalsuiteError
from evalsuite.gate import baseline as baselines
from evalsuite.gate.baseline import Baseline, rounded
from evalsuite.gate.record import Record, reference_digest
from evalsuite.store.cache import write_atomic

#: Parts of `host` that say where a picture was made; no path of the machine.
HOST = ("gl_renderer", "mitsuba", "variant", "drjit", "cpu", "versions", "git")
#: Verdicts that are not accepted without a reason.
WORSE = {"further", "other truth", "other measure"}
PREVIOUS = "previous.json"


def choose(rows: Sequence[Mapping], patterns: Sequence[str], path: Path) -> list[Mapping]:
    """The rows of a check to bless: those that ids or globs name, else all that can be. Raises EvalsuiteError for a pattern that
    names none, and for a named cell that has no score."""
    if not patterns:
        return [row for row in rows if row["verdict"] not in ("failed", "missing", "unchanged")]
    chosen: dict[str, Mapping] = {}
    ids = [row["id"] for row in rows]
    for pattern in patterns:
        found = [row for row in rows if row["id"] == pattern or fnmatch.fnmatchcase(row["id"], pattern)]
        if not found:
            near = difflib.get_close_matches(pattern, ids, n=1, cutoff=0.3)
            raise EvalsuiteError(f"cell '{pattern}'", "no such cell", f"an id or a glob of ids in {path}",
                                 f"did you mean '{near[0]}'?" if near else "see `evalsuite check`")  # fmt: skip
        chosen |= {row["id"]: row for row in found}
    failed = next((row for row in chosen.values() if row["verdict"] == "failed"), None)
    if failed:
        raise EvalsuiteError(failed["id"], failed["reason"], "a cell with a score", "mend it first")
    return [row for row in chosen.values() if row["verdict"] != "unchanged"]


def require_reason(rows: Sequence[Mapping], reason: str | None) -> None:
    """Raises EvalsuiteError where something worse would be accepted without a word."""
    worse = next((row for row in rows if row["verdict"] in WORSE), None)
    if worse and not (reason or "").strip():
        raise EvalsuiteError(worse["id"], f"'{worse['verdict']}' without a reason", "--reason TEXT", "say why it is right")


def blessed(
    run: Run, old: Baseline, rows: Sequence[Mapping], reason: str | None, date: str
) -> tuple[Baseline, dict[str, Record]]:
    """The baseline with these rows accepted (a missing cell leaves it), and the records of those that are scored."""
    host = {name: value for name, value in (run.results.get("host") or {}).items() if name in HOST and value is not None}
    name = hashlib.sha256(json.dumps(host, sort_keys=True).encode()).hexdigest()[:8]
    cells, records, fresh = dict(old.cells), {}, run.cells
    for row in rows:
        identity = row["id"]
        if row["verdict"] == "missing":
            del cells[identity]
            continue
        cell = fresh[identity]
        cells[identity] = {
            "status": cell["status"],
            "blessed": date,
            "reason": reason or {"extra": "first", "closer": "closer to the truth"}.get(row["verdict"], row["verdict"]),
            "host": name,
            "technique": cell.get("technique"),
            "target": cell.get("target"),
            "parameters": cell.get("all_parameters"),
            "seed": cell.get("seed"),
            "target_error": cell.get("target_error"),
            "mask_pixels": cell.get("mask_pixels"),
            "metrics": {},
        }
        if cell["status"] == "scored":
            image, mask, mean, sigma = (run.picture(cell, part) for part in ("image", "mask", "reference", "standard_error"))
            noise = run.picture(cell, "image_standard_error", optional=True)
            record = records[identity] = Record.of(image, mask[..., 0] > 0.5, noise, mean, sigma)
            cells[identity] |= {"image": record.digest, "reference": reference_digest(mean, sigma)}
            cells[identity]["metrics"] = {n: rounded(m) for n, m in cell["metrics"].items() if not n.endswith("_full")}
    known = old.hosts | {name: host}
    # What made the results holds for a baseline that is new or wholly theirs.
    whole = set(cells) <= set(fresh)
    return replace(old, cells=cells, hosts=known, run=run.results.get("run") or {} if whole else old.run), records


def store(new: Baseline, records: Mapping[str, Record], old: Baseline | None) -> None:
    """Write pictures, then the state before, then the file: killed in between, the old baseline holds. Pictures that neither
    state names are removed. Raises EvalsuiteError where it cannot be written."""
    new.folder.mkdir(parents=True, exist_ok=True)
    for identity, record in records.items():
        path = new.record_path(identity, record.digest)
        if not path.exists():
            record.write(path)
    write_atomic(new.folder / PREVIOUS, old.text() if old else "null\n")
    new.write()
    _sweep(new, old)


def undo(path: Path, dry_run: bool = False) -> tuple[Baseline | None, Baseline]:
    """Bring back the state before the last bless (or before the last undo); that state (None: there was none) and the one it
    replaces. Raises EvalsuiteError where nothing is kept."""
    now, place = baselines.read(path) if path.exists() else None, path.with_suffix("") / PREVIOUS
    if not place.exists():
        raise EvalsuiteError(place, "no such file", "the state before the last bless", "there is nothing to undo")
    empty = place.read_bytes().strip() == b"null"
    before = None if empty else replace(baselines.read(place), path=path)
    if dry_run:
        return before, now or Baseline(path)
    if before is None:
        path.unlink(missing_ok=True)
    else:
        before.write()
    write_atomic(place, now.text() if now else "null\n")
    return before, now or Baseline(path)


def _sweep(*states: Baseline | None) -> None:
    known = [state for state in states if state]
    named = {s.record_path(i, c["image"]).name for s in known for i, c in s.cells.items() if c.get("image")}
    for file in known[0].folder.glob("*-[0-9a-f]*.exr"):
        if file.name not in named:
            file.unlink()
