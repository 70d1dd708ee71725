"""The program, its consoles, the options that several commands share, and how values are read and printed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from evalsuite import __version__
from evalsuite.errors import EvalsuiteError, unknown

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="How wrong is a real-time lighting approximation, where and why: GPU pictures beside Mitsuba 3 ground truth.",
)

out, err = Console(), Console(stderr=True)

Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Size = Annotated[str | None, typer.Option(metavar="WxH", help="Picture size [pixels]; default: the scene's own.")]
Env = Annotated[str | None, typer.Option("--env", help="Lat-long .exr/.hdr, or a name from `evalsuite env list`.")]
Param = Annotated[
    list[str] | None,
    typer.Option("--param", "-p", metavar="K=V", help="Parameter of the technique or of the scene; `run` sweeps K=V1,V2,…"),
]
Quality = Annotated[str | None, typer.Option(help="draft (2 %), standard (0.5 %) or publication (0.1 %).")]
TargetError = Annotated[float | None, typer.Option(help="Relative standard error of the reference, instead of --quality.")]
WorstError = Annotated[
    float | None,
    typer.Option(help="Relative standard error of the reference's worst pixel: each then takes as many samples as it needs."),
]
#: Largest seed, as a baseline can remember it.
LARGEST_SEED = 2**31 - 1
Seed = Annotated[int, typer.Option(min=0, max=LARGEST_SEED, help="Seed of every random number.")]
Jobs = Annotated[int | None, typer.Option(min=1, max=256, help="Processes that share the cores; default: as suits one run.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers share the work, as tcp://HOST:8786.")
]
NoCache = Annotated[bool, typer.Option("--no-cache", help="Render everything anew (and store it).")]
RepairEnv = Annotated[bool, typer.Option("--repair-env", help="Replace NaN and Inf texels instead of refusing the map.")]


def size_of(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdigit() and 1 <= int(p) <= 16384 for p in parts):
        raise EvalsuiteError(f"--size {text}", "no size", "WxH in pixels, 1 to 16384 each, as 256x256")
    return int(parts[0]), int(parts[1])


def direction_of(option: str, text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.replace(",", " ").split())
    except ValueError:
        x = y = z = 0.0
    if not 0.0 < x * x + y * y + z * z < float("inf"):
        raise EvalsuiteError(f"{option} {text}", "no direction", "three numbers, not all 0, as '0 0 1'")
    return x, y, z


def error_of(quality: str | None, target_error: float | None) -> tuple[float, int]:
    """(relative standard error, cap on samples per pixel)."""
    from evalsuite.plan import QUALITY, usual_cap

    if target_error is not None:
        if not 0 < target_error < 1:
            raise EvalsuiteError(
                f"--target-error {target_error}", "no usable value", "a relative standard error in (0, 1), as 0.005"
            )
        return target_error, usual_cap(target_error)
    quality = quality or "draft"
    if quality not in QUALITY:
        raise unknown("--quality", quality, QUALITY, "`evalsuite run --help`")
    return QUALITY[quality]


def worst_error_of(worst_error: float | None) -> float | None:
    if worst_error is not None and not 0 < worst_error < 1:
        raise EvalsuiteError(f"--worst-error {worst_error}", "no usable value", "a relative standard error in (0, 1), as 0.05")
    return worst_error


def print_json(value: Any) -> None:
    print(json.dumps(value, indent=1, ensure_ascii=False))


def number(value: float | None) -> str:
    """JSON has no infinity and no undefined number; both are None there."""
    return "–" if value is None else f"{value:.6g}"


def print_table(rows: list[dict], columns: list[str], title: str | None = None) -> None:
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="bold")
    for column in columns:
        table.add_column(column.replace("_", " "), overflow="fold")
    for row in rows:
        table.add_row(*(escape(str(row.get(column, ""))) for column in columns))
    out.print(table)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(f"evalsuite {__version__}")
        raise typer.Exit


def require_exr(path: Path) -> None:
    if path.suffix.lower() != ".exr":
        raise EvalsuiteError(
            path, f"the extension '{path.suffix}'", ".exr (linear float picture)", "name the output something.exr"
        )
    if not path.parent.is_dir():
        raise EvalsuiteError(path.parent, "no such folder", "an existing folder for the picture", "make it first")
