"""`python -m benchmarks [NAME …] [--quick]`: run, print the table, keep the figures; exit code 1 where a limit is missed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from benchmarks import NAMES, record
from benchmarks.table import table
from evalsuite.errors import EvalsuiteError, unknown

#: Beside the reports, which git ignores.
KEPT = Path("reports", "build", "benchmarks.json")


def main(arguments: Sequence[str] | None = None) -> int:
    """The exit code: 0, 1 where a limit is missed, 2 for bad input."""
    parser = argparse.ArgumentParser("script/bench", description="How fast evalsuite is, beside the limits it must keep.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: all of {', '.join(NAMES)}")
    parser.add_argument("--quick", action="store_true", help="smaller and fewer: minutes instead of an hour; limits may not hold")
    parser.add_argument("--json", type=Path, default=KEPT, metavar="FILE", help=f"where figures are kept; default {KEPT}")
    asked, console = parser.parse_args(arguments), Console()
    try:
        for name in asked.names:
            if name not in NAMES:
                raise unknown("benchmark", name, NAMES, "`script/bench --help`")
        made = {}
        for name in asked.names or NAMES:
            console.print(f"{name} …", highlight=False)
            made[name] = record.measured(name, asked.quick)
            record.keep(asked.json, {name: made[name]})
    except EvalsuiteError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    console.print(table(made))
    console.print(str(asked.json), highlight=False, soft_wrap=True)
    return int(any(figure["verdict"].endswith("missed") for each in made.values() for figure in each["figures"]))


if __name__ == "__main__":
    sys.exit(main())
