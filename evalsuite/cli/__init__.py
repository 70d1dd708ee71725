"""The commands. The one place that prints, catches EvalsuiteError and exits."""

from __future__ import annotations

import os
import sys

import typer
from rich.markup import escape

from evalsuite.cli.app import app, err
from evalsuite.errors import EvalsuiteError

# Each registers its commands; `--help` lists them in this order.
# isort: off
from evalsuite.cli import run, pictures, pages, environments, about, cache  # noqa: F401

# isort: on

__all__ = ["app", "main"]


def main() -> None:
    """Entry point: exit codes as documented, one line on stderr instead of a traceback."""
    code: object = 0
    try:
        code = app(standalone_mode=False)
    except EvalsuiteError as error:
        err.print(f"error: {escape(str(error))}", style="red", highlight=False, soft_wrap=True)
        code = error.exit_code
    except typer.Exit as exit_:
        code = exit_.exit_code
    except (KeyboardInterrupt, typer.Abort):
        err.print("interrupted; the same command continues where it stopped", highlight=False)
        code = 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        err.print(
            f"error: {escape(str(error.filename or 'file system'))}: got {escape(error.strerror or str(error))}, "
            "expected a readable file or a writable folder; check the path and the disk",
            style="red",
            soft_wrap=True,
        )
        code = 2
    except Exception as error:
        if not hasattr(error, "format_message"):  # anything but a usage error of the command line
            raise
        err.print(f"error: {escape(error.format_message())}", style="red", highlight=False, soft_wrap=True)
        code = 2
    sys.exit(code if isinstance(code, int) else 0)
