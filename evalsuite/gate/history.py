"""Every check, appended to `history.sqlite` in the output folder: what a trend is made of."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

from evalsuite.errors import EvalsuiteError

#: rel_rmse with its 95 % interval, picture_change over the mean of the truth; null where there is none.
TABLES = """
CREATE TABLE IF NOT EXISTS checks (
    number INTEGER PRIMARY KEY, created TEXT NOT NULL, report TEXT NOT NULL, "commit" TEXT, gl_renderer TEXT,
    passed INTEGER NOT NULL, exit_code INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS cells (
    number INTEGER NOT NULL REFERENCES checks, cell TEXT NOT NULL, verdict TEXT NOT NULL,
    rel_rmse REAL, low REAL, high REAL, picture_change REAL, PRIMARY KEY (number, cell));
"""


def append(path: Path, check: Mapping, commit: str | None) -> int:
    """Add a check in one transaction; its number. commit: of the user's own checkout. Raises EvalsuiteError for a file that is no
    history or cannot be written."""
    try:
        # A second check at once waits for its turn.
        with closing(sqlite3.connect(path, timeout=30)) as database, database:
            database.executescript(TABLES)
            facts = (check["created"], check["report"], commit, check["host"].get("gl_renderer"))
            number = database.execute(
                'INSERT INTO checks (created, report, "commit", gl_renderer, passed, exit_code) VALUES (?, ?, ?, ?, ?, ?)',
                (*facts, check["passed"], check["exit_code"]),
            ).lastrowid
            database.executemany(
                "INSERT INTO cells VALUES (?, ?, ?, ?, ?, ?, ?)",
                [(number, row["id"], row["verdict"], *_error(row), row["picture_change"]) for row in check["cells"]],
            )
            return number
    except (sqlite3.Error, UnicodeDecodeError) as error:  # the second quotes a damaged file
        raise EvalsuiteError(
            path, str(error), "a history of checks that can be written", "move it away to begin a new one"
        ) from error


def _error(row: Mapping) -> tuple[float | None, float | None, float | None]:
    found = (row["metrics"].get("rel_rmse") or {}).get("now")
    return (found["value"], *found["ci95"]) if found else (None, None, None)
