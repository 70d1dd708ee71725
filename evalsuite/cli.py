"""The commands. The one place that prints, catches EvalsuiteError and exits."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from evalsuite import __version__
from evalsuite.errors import EvalsuiteError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="How wrong is a real-time lighting approximation, where and why: GPU pictures beside Mitsuba 3 ground truth.",
)
env_app = typer.Typer(no_args_is_help=True, help="Environment maps: list, inspect, make.")
list_app = typer.Typer(no_args_is_help=True, help="What there is: scenes, techniques, targets, reports, figures.")
cache_app = typer.Typer(no_args_is_help=True, help="The store of rendered pictures.")
app.add_typer(env_app, name="env")
app.add_typer(list_app, name="list")
app.add_typer(cache_app, name="cache")

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
Seed = Annotated[int, typer.Option(help="Seed of every random number.")]
NoCache = Annotated[bool, typer.Option("--no-cache", help="Render everything anew (and store it).")]
RepairEnv = Annotated[bool, typer.Option("--repair-env", help="Replace NaN and Inf texels instead of refusing the map.")]


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


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdigit() and 1 <= int(p) <= 16384 for p in parts):
        raise EvalsuiteError(f"--size {text}", "no size", "WxH in pixels, 1 to 16384 each, as 256x256")
    return int(parts[0]), int(parts[1])


def _direction(option: str, text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.replace(",", " ").split())
    except ValueError:
        x = y = z = 0.0
    if not 0.0 < x * x + y * y + z * z < float("inf"):
        raise EvalsuiteError(f"{option} {text}", "no direction", "three numbers, not all 0, as '0 0 1'")
    return x, y, z


def _error(quality: str | None, target_error: float | None) -> tuple[float, int]:
    """(relative standard error, cap on samples per pixel)."""
    from evalsuite.plan import QUALITY, unknown, usual_cap

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


def _print_json(value: Any) -> None:
    print(json.dumps(value, indent=1, ensure_ascii=False))


def _number(value: float | None) -> str:
    """JSON has no infinity and no undefined number; both are None there."""
    return "–" if value is None else f"{value:.6g}"


def _print_table(rows: list[dict], columns: list[str], title: str | None = None) -> None:
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


@app.command()
def run(
    report: Annotated[str, typer.Argument(help="Report name or .toml file.")] = "accuracy",
    scene: Annotated[
        list[str] | None, typer.Option(help="Scene name or Mitsuba XML file, instead of the report's. Repeatable.")
    ] = None,
    technique: Annotated[
        list[str] | None, typer.Option("--technique", "-t", help="Technique id or glob, or your own .glsl file. Repeatable.")
    ] = None,
    param: Param = None,
    env: Env = None,
    target: Annotated[list[str] | None, typer.Option(help="A name from `evalsuite list targets`. Repeatable.")] = None,
    quality: Quality = None,
    target_error: TargetError = None,
    size: Size = None,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Output folder; default reports/build/REPORT.")] = None,
    seed: Seed = 0,
    jobs: Annotated[int | None, typer.Option(help="Comparison processes; default: one a core.")] = None,
    no_cache: NoCache = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list the cells.")] = False,
    missing_only: Annotated[
        bool, typer.Option("--missing-only", help="Keep the cells that the output folder has scored.")
    ] = False,
    repair_env: RepairEnv = False,
    until_decided: Annotated[
        bool, typer.Option("--until-decided", help="Sample on where noise could change the order of techniques, up to the cap.")
    ] = False,
    cap: Annotated[
        int | None, typer.Option(metavar="SPP", help="Samples per pixel at which a reference stops; default: the quality's.")
    ] = None,
    no_ledger: Annotated[bool, typer.Option("--no-ledger", help="Do not split errors by cause: quicker.")] = False,
    headroom: Annotated[bool, typer.Option("--headroom", help="Also search the best value of each free parameter.")] = False,
    as_json: Json = False,
) -> None:
    """Render and compare all cells of a report; write results.json, pictures and the page."""
    from evalsuite import plan as planning
    from evalsuite.commands import run_report

    definition = planning.load_report(report)
    choice = planning.Choice(scene or (), technique or (), env, target or (), planning.parse_parameters(param or []), headroom)
    cells = planning.plan(definition, choice)
    error, usual = _error(quality, target_error)
    if cap is not None and cap < 32:
        raise EvalsuiteError(f"--cap {cap}", "too few", "32 samples per pixel or more: the fewest that know their own scatter")
    directory = out_dir or Path("reports", "build", definition.name)
    if dry_run:
        rows = [{"cell": cell.id} for cell in cells]
        _print_json([row["cell"] for row in rows]) if as_json else _print_table(rows, ["cell"], f"{len(cells)} cells")
        return
    from evalsuite.pipeline import Settings

    settings = Settings(error, cap or usual, _size(size) or definition.size, seed, repair_env, ledger=not no_ledger)
    results = run_report(
        definition,
        cells,
        settings,
        directory,
        jobs=jobs,
        read_cache=not no_cache,
        missing_only=missing_only,
        until_decided=until_decided,
        choice=choice,
        console=err,
    )
    if as_json:
        _print_json(results)
    else:
        from evalsuite.report.table import results_table

        out.print(results_table(results))
        print((directory / "index.html").resolve())
    if results["cells"] and not any(cell["status"] == "scored" for cell in results["cells"]):
        worst = next((c for c in results["cells"] if c["status"] != "skipped"), results["cells"][0])
        raise EvalsuiteError(
            worst["id"], worst["message"], "at least one cell that can be scored", "see the page for each cell's reason"
        )


@app.command()
def check(
    report: Annotated[str, typer.Argument(help="Report name or .toml file.")] = "accuracy",
    baseline: Annotated[Path | None, typer.Option(help="Default: reports/REPORT.baseline.json, or beside the .toml.")] = None,
    junit: Annotated[Path | None, typer.Option(metavar="FILE.xml", help="Also write JUnit XML, a test case a cell.")] = None,
    summary: Annotated[Path | None, typer.Option(metavar="FILE.md", help="Also write the ten worst as Markdown.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 4 where noise leaves a cell open.")] = False,
    no_run: Annotated[bool, typer.Option("--no-run", help="Judge the results that the output folder has.")] = False,
    scene: Annotated[list[str] | None, typer.Option(help="As for `run`; default: as blessed. Repeatable.")] = None,
    technique: Annotated[
        list[str] | None, typer.Option("--technique", "-t", help="As for `run`; default: as blessed. Repeatable.")
    ] = None,
    param: Param = None,
    env: Env = None,
    target: Annotated[list[str] | None, typer.Option(help="As for `run`; default: as blessed. Repeatable.")] = None,
    quality: Quality = None,
    target_error: TargetError = None,
    size: Size = None,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Output folder; default reports/build/REPORT.")] = None,
    seed: Annotated[int | None, typer.Option(help="Another seed than the baseline's.")] = None,
    jobs: Annotated[int | None, typer.Option(help="Comparison processes; default: one a core.")] = None,
    no_cache: NoCache = False,
    repair_env: RepairEnv = False,
    no_ledger: Annotated[bool, typer.Option("--no-ledger", help="Do not split errors by cause: quicker.")] = False,
    as_json: Json = False,
) -> None:
    """Hold a report against its blessed baseline; exit code 1 where a cell is further from the truth, missing or failed."""
    from evalsuite import commands_gate as gate
    from evalsuite import plan as planning
    from evalsuite.gate import outlets

    error = _error(quality, target_error) if quality or target_error is not None else None
    choice = planning.Choice(scene or (), technique or (), env, target or (), planning.parse_parameters(param or []))
    found = gate.check(
        report,
        baseline or gate.baseline_path(report),
        gate.Asked(choice, error, _size(size), seed, repair_env, no_ledger),
        out_dir or gate.default_directory(report),
        gate.Outlets(junit, summary),
        strict=strict,
        render=not no_run,
        jobs=jobs,
        read_cache=not no_cache,
        console=err,
    )
    if os.environ.get("GITHUB_ACTIONS") == "true":
        for line in outlets.annotations(found):
            print(line, file=sys.stderr)  # the runner reads both streams
    if as_json:
        _print_json(found)
    else:
        rows = [{"verdict": r["verdict"], "cell": r["id"], "why": r["reason"]} for r in outlets.worst(found)]
        if rows:
            _print_table(rows, ["verdict", "cell", "why"])
        print(outlets.headline(found))
        if any(r["verdict"] == "closer" or not r["passed"] for r in found["cells"]):
            print(f"to accept: {found['bless']} CELL … [--reason TEXT]")
    raise typer.Exit(found["exit_code"])


@app.command()
def bless(
    report: Annotated[str, typer.Argument(help="Report name or .toml file.")] = "accuracy",
    cells: Annotated[list[str] | None, typer.Argument(metavar="[CELL]…", help="Ids or globs; default: all scored.")] = None,
    baseline: Annotated[Path | None, typer.Option(help="Default: reports/REPORT.baseline.json, or beside the .toml.")] = None,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Folder of the results; default reports/build/REPORT.")] = None,
    reason: Annotated[str | None, typer.Option(help="Why; needed for what is further from the truth.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would change.")] = False,
    undo: Annotated[bool, typer.Option("--undo", help="Bring back the baseline before the last bless.")] = False,
    as_json: Json = False,
) -> None:
    """Accept the last run's results as the baseline, cell by cell."""
    from evalsuite import commands_gate as gate

    file = baseline or gate.baseline_path(report)
    if undo and cells:
        raise EvalsuiteError("--undo", f"the cell '{cells[0]}'", "no cells: the whole last bless is undone")
    if undo:
        rows = gate.undo(file, dry_run=dry_run)
        _print_json(rows) if as_json else _print_table(rows, ["id", "was", "is"])
    else:
        rows = gate.bless(file, out_dir or gate.default_directory(report), cells or [], reason=reason, dry_run=dry_run)
        shown = [{"was": row["verdict"], "cell": row["id"], "why": row["reason"]} for row in rows]
        _print_json(rows) if as_json else _print_table(shown, ["was", "cell", "why"])
    if not as_json:
        done = "would be changed" if dry_run else "changed"
        print(f"{len(rows)} {'cell' if len(rows) == 1 else 'cells'} {done}\n{file}")


@app.command()
def render(
    scene: Annotated[str, typer.Argument(help="Scene name or Mitsuba XML file.")],
    technique: Annotated[str, typer.Option("--technique", "-t", help="Technique id, or your own .glsl file.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="EXR file to write.")],
    param: Param = None,
    env: Env = None,
    size: Size = None,
    seed: Seed = 0,
    repair_env: RepairEnv = False,
) -> None:
    """Draw one GPU picture (linear EXR)."""
    from evalsuite import api
    from evalsuite.gpu import registry
    from evalsuite.image import exr
    from evalsuite.plan import parse_parameters
    from evalsuite.scene import builtin
    from evalsuite.scene.dependencies import parameters as scene_parameters

    _require_exr(output)
    parameters = {name: values[0] for name, values in parse_parameters(param or []).items()}
    # The technique's own names win; the rest is the scene's, or unknown.
    own = registry.find(technique).defaults()
    known = scene_parameters(builtin.scene_path(scene))
    defines = {name: parameters.pop(name) for name in list(parameters) if name not in own and name in known}
    handle = _load(api, scene, env, size, repair_env, defines)
    with err.status(f"drawing {escape(scene)} with {escape(technique)}"):
        picture = api.render(handle, technique, seed=seed, **parameters)
    exr.write(output, picture)
    print(output)


@app.command()
def reference(
    scene: Annotated[str, typer.Argument(help="Scene name or Mitsuba XML file.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="EXR file to write: the mean, and a part `standard_error`.")],
    target: Annotated[str, typer.Option(help="A name from `evalsuite list targets`.")] = "direct",
    param: Param = None,
    env: Env = None,
    size: Size = None,
    quality: Quality = None,
    target_error: TargetError = None,
    seed: Seed = 0,
    repair_env: RepairEnv = False,
) -> None:
    """Render one Mitsuba picture with its standard error as a second EXR part. The targets discs* take -p for their
    decomposition too (stop=0.05)."""
    from evalsuite import api
    from evalsuite.image import exr
    from evalsuite.plan import parse_parameters

    _require_exr(output)
    error, cap = _error(quality, target_error)
    given = {name: values[0] for name, values in parse_parameters(param or []).items()}
    settings = api.of_decomposition(scene, target, given)
    handle = _load(api, scene, env, size, repair_env, {k: v for k, v in given.items() if k not in settings})
    with err.status(f"rendering {escape(scene)}, {escape(target)}"):
        result = api.reference(handle, target, target_error=error, max_spp=cap, seed=seed, **settings)
    exr.write(
        output,
        {"reference": result.mean, "standard_error": result.standard_error},
        header={"evalsuite_spp": result.spp, "evalsuite_target": target},
    )
    if result.capped:
        err.print(
            f"warning: sampling stopped at the cap of {result.spp} spp: relative standard error {result.reached_error:.2%}, "
            f"asked for was {error:.2%}",
            style="yellow",
            highlight=False,
        )
    print(f"{output}  {result.spp} spp, relative standard error {result.reached_error:.2%}")


def _load(api: Any, scene: str, env: str | None, size: str | None, repair: bool, defines: dict[str, Any]) -> Any:
    import warnings

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        handle = api.load_scene(scene, envmap=env, size=_size(size), repair_env=repair, **defines)
    for warning in caught:
        err.print(f"warning: {escape(str(warning.message))}", style="yellow", highlight=False, soft_wrap=True)
    return handle


def _require_exr(path: Path) -> None:
    if path.suffix.lower() != ".exr":
        raise EvalsuiteError(
            path, f"the extension '{path.suffix}'", ".exr (linear float picture)", "name the output something.exr"
        )
    if not path.parent.is_dir():
        raise EvalsuiteError(path.parent, "no such folder", "an existing folder for the picture", "make it first")


@app.command()
def compare(
    image: Annotated[Path, typer.Argument(help="EXR, HDR or PNG picture; or the folder of run A.")],
    reference: Annotated[Path, typer.Argument(help="EXR, HDR or PNG picture of the same size; or the folder of run B.")],
    standard_error: Annotated[Path | None, typer.Option(help="EXR with the reference's standard error.")] = None,
    mask: Annotated[Path | None, typer.Option(help="Picture; pixels over ½ count.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for error maps and metrics.json; of runs, a page.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Metrics and error maps of any two pictures, from any renderer; or of two runs, which cells came closer to the truth."""
    from evalsuite.commands_runs import are_runs

    if are_runs(image, reference):
        _compare_runs(image, reference, standard_error or mask, output, as_json)
        return
    from evalsuite.commands import compare_files

    result = compare_files(image, reference, standard_error, mask, output)
    if as_json:
        _print_json(result)
        return
    rows = [
        {"metric": name, "value": _number(m["value"]), "95 % interval": " … ".join(map(_number, m["ci95"]))}
        for name, m in result["metrics"].items()
        if not name.endswith("_full")
    ]
    _print_table(rows, ["metric", "value", "95 % interval"])
    for note in result["notes"]:
        print(note)
    if output:
        print(output)


def _compare_runs(a: Path, b: Path, stray: Path | None, output: Path | None, as_json: bool) -> None:
    from evalsuite.commands_runs import compare_folders
    from evalsuite.report import runs

    if stray is not None:
        raise EvalsuiteError(stray, "a picture beside two runs", "two pictures, or two runs alone", "runs bring their own")
    with err.status(f"comparing {escape(str(a))} and {escape(str(b))}"):
        comparison = compare_folders(a, b, output)
    if as_json:
        _print_json(comparison)
        return
    out.print(runs.table(comparison))
    print(runs.summary(comparison))
    if output:
        print((output / "index.html").resolve())


@app.command()
def figures(
    ids: Annotated[
        list[str] | None, typer.Argument(metavar="[ID]…", help="Ids from `evalsuite list figures`; default: all.")
    ] = None,
    out_dir: Annotated[Path, typer.Option("--out", help="Folder for ID.png, ID.pdf and ID.json.")] = Path(
        "reports/build/figures"
    ),
    as_json: Json = False,
) -> None:
    """Draw the papers' figures, with the measured numbers beside."""
    from evalsuite.commands import make_figures

    with err.status("drawing"):
        made = make_figures(ids or [], out_dir)
    if as_json:
        _print_json([numbers for _, numbers in made])
        return
    for paths, _ in made:
        print(*paths, sep="\n")


@app.command("decompose")
def decompose_env(
    env: Annotated[str, typer.Argument(help="Lat-long .exr/.hdr, or a name from `evalsuite env list`.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for lights.json, the two maps and the pictures.")],
    sizes: Annotated[int, typer.Option(help="Filters in the bank.")] = 20,
    smallest_deg: Annotated[float, typer.Option(help="Angular extent of the smallest filter [degrees].")] = 4.5,
    largest_deg: Annotated[float, typer.Option(help="Angular extent of the largest filter [degrees].")] = 45.0,
    spacing: Annotated[str, typer.Option(help="Of the sizes in between: geometric or linear.")] = "geometric",
    inner: Annotated[float, typer.Option(help="Radius of a filter's centre over that of its surround.")] = 0.75,
    surround: Annotated[float, typer.Option(help="Weight of the surround; the centre has 1.")] = -10.0,
    candidates: Annotated[float, typer.Option(help="Part of the texels, the brightest, to centre filters on.")] = 0.1,
    stop: Annotated[float, typer.Option(help="A light below this part of the sum of those before it ends the search.")] = 0.02,
    least_response: Annotated[float, typer.Option(help="A best response not above it ends the search too.")] = 0.0,
    max_lights: Annotated[int, typer.Option(help="Cap on the number of lights.")] = 64,
    repair_env: RepairEnv = False,
    as_json: Json = False,
) -> None:
    """Take an environment map apart into disc-shaped area lights and a remainder."""
    from evalsuite.commands_lights import decompose_environment
    from evalsuite.lights.model import DecompositionSettings

    settings = DecompositionSettings(
        sizes, smallest_deg, largest_deg, spacing, inner, surround, candidates, stop, least_response, max_lights
    )
    with err.status(f"decomposing {escape(env)}"):
        facts = decompose_environment(env, output, settings, repair_env)
    for note in facts["notes"]:
        err.print(f"warning: {escape(note)}", style="yellow", highlight=False, soft_wrap=True)
    if as_json:
        _print_json(facts)
        return
    rows = [
        {
            "light": row["light"] if row["kept"] else f"({row.get('ended_by', '')})",
            "radius [deg]": f"{row['angular_radius_deg']:.2f}",
            "response": f"{row['response']:.4g}",
            "irradiance (RGB)": " ".join(f"{x:.4g}" for x in row.get("irradiance", ())),
            "share": f"{row['share']:.2%}",
            "so far": f"{row['share_so_far']:.2%}",
            "of the sum before": _number(row.get("ratio_to_sum_before")),
        }
        for row in facts["search"]
    ]
    _print_table(rows, ["light", "radius [deg]", "response", "irradiance (RGB)", "share", "so far", "of the sum before"])
    residual = max(abs(x) for x in facts["energy_residual"])
    count = f"{facts['lights']} light{'' if facts['lights'] == 1 else 's'}"
    print(f"{count} with {facts['share']:.1%} of the luminance; energy kept to {residual:.0e}")
    print(output)


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


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what this machine has (OpenGL, Mitsuba, LLVM), what it lacks and how to get it; exit code 3 when it lacks something."""
    from evalsuite.commands import examine

    result = examine()
    if as_json:
        _print_json(result)
    else:
        for line in result["checks"]:
            mark = "[green]ok[/green]     " if line["ok"] else "[red]missing[/red]"
            out.print(f"{mark} {escape(line['name'])}: {escape(line['text'])}", highlight=False, soft_wrap=True)
            if not line["ok"] and line["fix"]:
                out.print(f"        {escape(line['fix'])}", highlight=False, soft_wrap=True)
    if not all(line["ok"] for line in result["checks"]):
        raise typer.Exit(3)


@list_app.command("scenes")
def list_scenes(as_json: Json = False) -> None:
    """Built-in scenes, with the parameters that -p sets."""
    from evalsuite.scene import builtin
    from evalsuite.scene.dependencies import parameters

    rows = [{k: str(v) for k, v in row.items()} for row in builtin.list_scenes()]
    for row in rows:
        row["parameters"] = ", ".join(f"{name}={value}" for name, value in parameters(Path(row["path"])).items())
    _print_json(rows) if as_json else _print_table(rows, ["name", "description", "parameters"])


@list_app.command("techniques")
def list_techniques(as_json: Json = False) -> None:
    """Every technique with its paper, equation, parameters, assumptions and target."""
    from evalsuite.gpu import registry

    rows = [registry.find(name).to_json() for name in registry.names()]
    if as_json:
        _print_json(rows)
        return
    for row in rows:
        out.print(f"[bold]{row['id']}[/bold]  {escape(row['title'])}", highlight=False)
        facts = {
            "paper": row["paper"],
            "equations": row["equations"],
            "target": row["target"],
            "stands for": ", ".join(row["stands_for"]),
            "parameters": "; ".join(f"{p['name']} = {p['default']} ({p['meaning']})" for p in row["parameters"]),
            "assumes": " · ".join(row["assumptions"]),
        }
        for name, text in facts.items():
            out.print(f"  {name + ':':<12}{escape(str(text))}", highlight=False, soft_wrap=True)


@list_app.command("targets")
def list_targets(as_json: Json = False) -> None:
    """What Mitsuba renders as truth, in order."""
    from evalsuite.plan import TARGETS

    rows = [{"name": name, "description": text} for name, text in TARGETS.items()]
    _print_json(rows) if as_json else _print_table(rows, ["name", "description"])


@list_app.command("figures")
def list_figures(as_json: Json = False) -> None:
    """The papers' figures that `evalsuite figures` draws."""
    from evalsuite.report.figures import FIGURES

    rows = [{"id": f.id, "paper": f.paper, "title": f.title} for f in FIGURES.values()]
    _print_json(rows) if as_json else _print_table(rows, ["id", "title", "paper"])


@list_app.command("reports")
def list_reports(as_json: Json = False) -> None:
    """Report definitions."""
    from evalsuite import plan
    from evalsuite.scene import builtin

    definitions = [plan.load_report(str(path)) for path in sorted(builtin.reports_directory().glob("*.toml"))]
    rows = [{"name": d.name, "title": d.title, "cells": len(plan.plan(d))} for d in definitions]
    _print_json(rows) if as_json else _print_table(rows, ["name", "title", "cells"])


@env_app.command("list")
def env_list(as_json: Json = False) -> None:
    """Environments known by name: built in, of an installed Blender, in $EVALSUITE_ENV_PATH."""
    from evalsuite.scene import builtin

    rows = [{k: str(v) for k, v in row.items()} for row in builtin.list_environments()]
    rows += [{"name": k, "path": "", "source": "built-in", "description": v} for k, v in builtin.FAMILIES.items()]
    _print_json(rows) if as_json else _print_table(rows, ["name", "source", "description"])


@env_app.command("info")
def env_info(file: Annotated[str, typer.Argument(help="Lat-long .exr/.hdr, or a name.")], as_json: Json = False) -> None:
    """Resolution, range, mean, irradiance, and what had to be cleaned."""
    from evalsuite.commands import environment_facts

    facts = environment_facts(file)
    _print_json(facts) if as_json else _print_table([{"": k, "value": v} for k, v in facts.items()], ["", "value"])


@env_app.command("convert")
def env_convert(
    file: Annotated[str, typer.Argument(help="Environment map (.exr, .hdr), or a name.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="EXR file to write; its header says which layout it has.")],
    to: Annotated[str, typer.Option(help="latlong, cube, paraboloid or sphere.")],
    origin: Annotated[
        str | None, typer.Option("--from", help="The same of FILE, where its header and shape do not tell.")
    ] = None,
    size: Annotated[
        int | None, typer.Option(help="Width of the lat-long, of a cube face, of one paraboloid map, of the sphere map [texels].")
    ] = None,
    view: Annotated[str, typer.Option(metavar="'X Y Z'", help="Direction to the viewer of a sphere map.")] = "0 0 1",
    repair_env: RepairEnv = False,
    as_json: Json = False,
) -> None:
    """Convert between lat-long, cube, dual paraboloid and sphere map; prints what that did to the energy."""
    from evalsuite.commands import convert_environment

    _require_exr(output)
    with err.status(f"converting {escape(file)}"):
        facts = convert_environment(file, output, to, origin, size, _direction("--view", view), repair_env)
    for note in facts["notes"]:
        err.print(f"warning: {escape(file)}: {escape(note)}", style="yellow", highlight=False, soft_wrap=True)
    if as_json:
        _print_json(facts)
        return
    residual = max(facts["energy_residual"], key=abs)
    print(f"{facts['output']}  {facts['to']}, {facts['width']} × {facts['height']} texels, from {facts['from']}, "
          f"{facts['from_width']} × {facts['from_height']}")  # fmt: skip
    print("mean radiance " + " ".join(f"{x:.6g}" for x in facts["mean_radiance_after"]) + f", energy changed by {residual:+.1e}")


@env_app.command("make")
def env_make(
    name: Annotated[str, typer.Argument(help="Built-in environment.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="EXR file to write.")],
) -> None:
    """Make a built-in environment anew from its generator."""
    from evalsuite.commands import make_environment

    _require_exr(output)
    with err.status(f"making {escape(name)}"):
        make_environment(name, output)
    print(output)


@cache_app.command("info")
def cache_info(as_json: Json = False) -> None:
    """Where the store is and how much it holds."""
    from evalsuite.commands import cache_facts

    facts = cache_facts()
    if as_json:
        _print_json(facts)
        return
    print(facts["path"])
    _print_table(facts["kinds"], ["kind", "entries", "megabytes"])


if __name__ == "__main__":
    main()
