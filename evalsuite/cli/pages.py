"""What was made: figures, claims, open, serve, export."""

from __future__ import annotations

import contextlib
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from evalsuite.cli.app import (
    Jobs,
    Json,
    NoCache,
    Quality,
    Size,
    TargetError,
    app,
    err,
    error_of,
    print_json,
    print_table,
    size_of,
)
from evalsuite.errors import EvalsuiteError


@app.command()
def figures(
    ids: Annotated[
        list[str] | None, typer.Argument(metavar="[ID]…", help="Ids from `evalsuite list figures`; default: all.")
    ] = None,
    env: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=FILE", help="A paper's own map, as uffizi=FILE, instead of a stand-in. Repeatable."),
    ] = None,
    mesh: Annotated[
        list[str] | None, typer.Option(metavar="NAME=FILE", help="A paper's own mesh, as bunny=FILE, y up. Repeatable.")
    ] = None,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Make the figures of the folder's lock again, else of the shipped one; say what moved.",
        ),
    ] = False,
    quality: Quality = None,
    target_error: TargetError = None,
    size: Size = None,
    out_dir: Annotated[
        Path, typer.Option("--out", help="Folder for index.html, ID.png, .pdf, .html, .json and latex/ID.")
    ] = Path("reports/build/figures"),
    jobs: Jobs = None,
    no_cache: NoCache = False,
    as_json: Json = False,
) -> None:
    """Draw the papers' figures beside Mitsuba's truth, with the measured numbers."""
    from evalsuite import commands_figures as commands
    from evalsuite import stand_ins
    from evalsuite.pipeline import Settings

    if verify:
        _verify(commands.verify(ids or [], commands.lock_of(out_dir), jobs=jobs, read_cache=not no_cache, console=err), as_json)
        return
    error, cap = error_of(quality, target_error)
    maps, meshes = stand_ins.given("--env", env or (), stand_ins.MAPS), stand_ins.given("--mesh", mesh or (), stand_ins.MESHES)
    settings = Settings(error, cap, size_of(size), 0, False, ledger=False)
    made = commands.make(ids or [], out_dir, maps, meshes, settings, jobs=jobs, read_cache=not no_cache, console=err)
    if as_json:
        print_json([numbers for _, numbers in made])
        return
    for paths, _ in made:
        print(*paths, sep="\n")
    print((out_dir / "index.html").resolve())


def _verify(checks: list[dict], as_json: bool) -> None:
    """Print what came of each figure made again. Exits with 1 where one no longer reproduces."""
    from evalsuite.report.figures import lock

    if as_json:
        print_json(checks)
    else:
        words = {
            one["id"]: "; ".join(one["changes"] or [f"other pictures: {len(one['results'])}"] * bool(one["results"]))
            for one in checks
        }
        print_table([{"figure": one["id"], "": one["verdict"], "what moved": words[one["id"]]} for one in checks],
                    ["figure", "", "what moved"])  # fmt: skip
    if any(one["verdict"] == lock.MOVED for one in checks):
        raise typer.Exit(1)


@app.command()
def claims(
    ids: Annotated[
        list[str] | None, typer.Argument(metavar="[ID]…", help="Ids from `evalsuite list claims`; default: all.")
    ] = None,
    env: Annotated[
        list[str] | None, typer.Option(metavar="NAME=FILE", help="A paper's own map, as grace=FILE. Repeatable.")
    ] = None,
    quality: Quality = None,
    target_error: TargetError = None,
    size: Size = "128x128",
    out_dir: Annotated[Path, typer.Option("--out", help="Folder for claims.html, claims.json and the cells behind them.")] = Path(
        "reports/build/claims"
    ),
    jobs: Jobs = None,
    no_cache: NoCache = False,
    as_json: Json = False,
) -> None:
    """Check the papers' statements: what each says, what is measured, whether it holds."""
    from evalsuite import commands_claims as commands
    from evalsuite import stand_ins
    from evalsuite.pipeline import Settings

    error, cap = error_of(quality, target_error)
    maps = stand_ins.given("--env", env or (), stand_ins.MAPS)
    settings = Settings(error, cap, size_of(size), 0, False, ledger=False)
    status = err.status("measuring")

    def step(text: str) -> None:  # not before the run, which has a display of its own
        status.update(text)
        status.start()

    try:
        found = commands.check(ids or [], out_dir, maps, settings, step, jobs=jobs, read_cache=not no_cache, console=err)
    finally:
        status.stop()
    if as_json:
        print_json(found)
    else:
        print_table([{"verdict": one["verdict"], "claim": one["says"], "measured": one["measured"]} for one in found],
                    ["verdict", "claim", "measured"])  # fmt: skip
        print((out_dir / "claims.html").resolve())


def _folder(report: str) -> Path:
    """The folder of a report's page, by the report's name or as a folder."""
    directory = Path(report) if Path(report).is_dir() else Path("reports", "build", report)
    if not (directory / "index.html").is_file():
        raise EvalsuiteError(
            directory / "index.html", "no such file", "the page of an earlier run", f"type `evalsuite run {report}` first"
        )
    return directory


@app.command("open")
def open_page(report: Annotated[str, typer.Argument(help="Report name or output folder.")] = "accuracy") -> None:
    """Open a report's page in the browser."""
    page = _folder(report) / "index.html"
    webbrowser.open(page.resolve().as_uri())
    print(page)


@app.command()
def serve(
    report: Annotated[str, typer.Argument(help="Report name or output folder.")] = "accuracy",
    port: Annotated[int, typer.Option(help="Port on 127.0.0.1; 0 takes any free one.")] = 8000,
) -> None:
    """Serve a report's page to this machine's browsers, until Ctrl+C."""
    from evalsuite.report import serving

    with serving.server(_folder(report), port) as server:
        print(f"http://{serving.ADDRESS}:{server.server_port}/", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()


@app.command()
def export(
    report: Annotated[str, typer.Argument(help="Report name or output folder.")],
    cells: Annotated[
        list[str] | None, typer.Argument(help="Ids of cells, globs too; all without one.", metavar="[CELL]...")
    ] = None,
    single_file: Annotated[Path, typer.Option("--single-file", help="The HTML file to write.")] = ...,
) -> None:
    """Write chosen cells of a finished report as one HTML file that holds all it shows."""
    from evalsuite.report import single

    done = single.write(_folder(report), cells or [], single_file)
    print(f"{single_file}: {len(done)} cell{'s' * (len(done) != 1)}, {single_file.stat().st_size / 1e6:.1f} MB")
