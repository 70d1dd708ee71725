"""Every check, appended to `history.sqlite`: what a trend is made of."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from evalsuite.errors import EvalsuiteError

#: rel_rmse with its 95 % interval, picture_change over the mean of the truth; null where there is none.
TABLES = """
CREATE TABLE IF NOT EXISTS checks (
    number INTEGER PRIMARY KEY, created TEXT NOT NULL, report TEXT NOT NULL, "commit" TEXT, gl_renderer TEXT,
    passed INTEGER NOT NULL, exit_code INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS cells (
    number INTEGER NOT NULL REFERENCES checks, cell TEXT NOT NULL, verdict TEXT NOT NULL,
    rel_rmse REAL, low REAL, high REAL, picture_change REAL, seed INTEGER, PRIMARY KEY (number, cell));
"""


class Cell(NamedTuple):
    """A cell of one check: rel_rmse with its 95 % interval, and the seed of the reference's noise; None where there is none."""

    verdict: str
    rel_rmse: float | None
    low: float | None
    high: float | None
    seed: int | None


class Check(NamedTuple):
    """One check; cells by id. commit: of the user's own checkout."""

    number: int
    created: str
    commit: str | None
    gl_renderer: str | None
    passed: bool
    cells: dict[str, Cell]


def append(path: Path, check: Mapping, commit: str | None) -> int:
    """Add a check in one transaction; its number. commit: of the user's own checkout. Raises EvalsuiteError for a file that is no
    history or cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # A second check at once waits for its turn.
        with closing(sqlite3.connect(path, timeout=30)) as database, database:
            database.executescript(TABLES)
            if not _has_seeds(database):
                database.execute("ALTER TABLE cells ADD COLUMN seed INTEGER")
            facts = (check["created"], check["report"], commit, check["host"].get("gl_renderer"))
            number = database.execute(
                'INSERT INTO checks (created, report, "commit", gl_renderer, passed, exit_code) VALUES (?, ?, ?, ?, ?, ?)',
                (*facts, check["passed"], check["exit_code"]),
            ).lastrowid
            database.executemany(
                "INSERT INTO cells (number, cell, verdict, rel_rmse, low, high, picture_change, seed)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                [(number, r["id"], r["verdict"], *_error(r), r["picture_change"], r.get("seed")) for r in check["cells"]],
            )
            return number
    except (sqlite3.Error, OSError) as error:
        raise _unusable(path, error) from error


def read(path: Path, report: str, last: int) -> list[Check]:
    """The last checks of a report, oldest first; none where there is no file. Raises EvalsuiteError for what is no history."""
    if not path.exists():
        return []
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=30)) as database:
            rows = database.execute(
                'SELECT number, created, "commit", gl_renderer, passed FROM checks WHERE report = ? ORDER BY number DESC LIMIT ?',
                (report, last),
            ).fetchall()
            checks = {row[0]: Check(*row[:4], bool(row[4]), {}) for row in reversed(rows)}
            seed = "seed" if _has_seeds(database) else "NULL"
            query = f"SELECT number, cell, verdict, rel_rmse, low, high, {seed} FROM cells WHERE number >= ?"
            for number, cell, *facts in database.execute(query, (min(checks, default=0),)):
                if number in checks:
                    checks[number].cells[cell] = Cell(*facts)
            return list(checks.values())
    except sqlite3.Error as error:
        raise _unusable(path, error) from error


def _has_seeds(database: sqlite3.Connection) -> bool:
    """Histories of earlier versions have none."""
    return "seed" in [column[1] for column in database.execute("PRAGMA table_info(cells)")]


def _unusable(path: Path, error: Exception) -> EvalsuiteError:
    return EvalsuiteError(path, str(error), "a history of checks that can be written", "move it away to begin a new one")


def _error(row: Mapping) -> tuple[float | None, float | None, float | None]:
    found = (row["metrics"].get("rel_rmse") or {}).get("now")
    return (found["value"], *found["ci95"]) if found else (None, None, None)
