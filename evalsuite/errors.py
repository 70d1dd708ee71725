"""Errors a user can mend: where, what was found, what was expected, and how to mend it.

Libraries raise these; only `cli` prints them and turns them into exit codes.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class EvalsuiteError(Exception):
    """Bad input or usage (exit code 2). Its text is one line: `where: got …, expected …; fix`."""

    exit_code = 2

    def __init__(self, where: object, got: str, expected: str, fix: str = "") -> None:
        self.where, self.got, self.expected, self.fix = str(where), got, expected, fix
        super().__init__(where, got, expected, fix)  # all four, so that it survives pickling between processes

    def __str__(self) -> str:
        text = f"{self.where}: got {self.got}, expected {self.expected}"
        line = " ".join((f"{text}; {self.fix}" if self.fix else text).split())
        # What a damaged file holds is quoted; it must not steer a terminal.
        return "".join(c if c.isprintable() else "\ufffd" for c in line)


class MachineLacks(EvalsuiteError):
    """The machine lacks something (exit code 3); `evalsuite doctor` says what."""

    exit_code = 3


class WorkerFailed(EvalsuiteError):
    """A worker process died or hung (native abort, out of memory, time limit): costs one cell, never the run."""


class Unwritable(EvalsuiteError):
    """A folder that cannot be written, or has no space left: ends the run, for the next cell would fare no better."""


def unknown(what: str, name: str, known: Iterable[str], see: str, more: str = "") -> EvalsuiteError:
    """The one line for a name that is none of those known: all of them, the nearest, where they are listed. more: what else it
    may be."""
    near = difflib.get_close_matches(name, list(known), n=1)
    hint = f"did you mean '{near[0]}'? " if near else ""
    return EvalsuiteError(f"{what} '{name}'", "no such name", f"one of {', '.join(known)}{more}", f"{hint}See {see}")
