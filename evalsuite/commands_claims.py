"""`evalsuite claims`, without its printing."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from evalsuite.report import claims as table
from evalsuite.report import claims_page
from evalsuite.store import results as store_results
from evalsuite.store.cache import write_atomic


def check(ids: Sequence[str], directory: Path, maps: Mapping[str, Path], step: Callable[[str], None]) -> list[dict]:
    """Measure claims, write claims.json and the page claims.html into `directory`; what claims.json has of each. step: told what
    is measured next. Raises EvalsuiteError."""
    chosen = table.choose(ids)
    store_results.prepare(directory)
    found = []
    for claim in chosen:
        step(claim.says)
        found.append(table.check(claim, maps))
    write_atomic(
        directory / "claims.json",
        json.dumps({"schema": "evalsuite.claims/1", "claims": found}, indent=1, ensure_ascii=False) + "\n",
    )
    claims_page.write(found, directory)
    return found
