"""Pictures: render, reference, compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from evalsuite.cli.app import (
    Env,
    Json,
    Param,
    Quality,
    RepairEnv,
    Seed,
    Size,
    TargetError,
    WorstError,
    app,
    err,
    error_of,
    number,
    out,
    print_json,
    print_table,
    require_exr,
    size_of,
    worst_error_of,
)
from evalsuite.errors import EvalsuiteError


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

    require_exr(output)
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
    worst_error: WorstError = None,
    seed: Seed = 0,
    repair_env: RepairEnv = False,
) -> None:
    """Render one Mitsuba picture with its standard error as a second EXR part, and with --worst-error each pixel's samples as a
    third. The targets discs* take -p for their decomposition too (stop=0.05)."""
    from evalsuite import api
    from evalsuite.image import exr
    from evalsuite.plan import parse_parameters

    require_exr(output)
    error, cap = error_of(quality, target_error)
    worst = worst_error_of(worst_error)
    given = {name: values[0] for name, values in parse_parameters(param or []).items()}
    settings = api.of_decomposition(scene, target, given)
    handle = _load(api, scene, env, size, repair_env, {k: v for k, v in given.items() if k not in settings})
    with err.status(f"rendering {escape(scene)}, {escape(target)}"):
        result = api.reference(handle, target, target_error=error, max_spp=cap, worst_error=worst, seed=seed, **settings)
    exr.write(
        output,
        {"reference": result.mean, "standard_error": result.standard_error} | ({"samples": result.samples} if worst else {}),
        header={"evalsuite_spp": result.spp, "evalsuite_target": target},
    )
    if result.capped:
        err.print(
            f"warning: sampling stopped at the cap of {result.spp} spp: relative standard error {result.reached_error:.2%}, "
            f"asked for was {error:.2%}",
            style="yellow",
            highlight=False,
        )
    of_worst = f", of the worst pixel {result.reached_worst_error:.2%} (asked for {worst:.2%})" if worst else ""
    print(f"{output}  {result.spp} spp, relative standard error {result.reached_error:.2%}{of_worst}")


def _load(api: Any, scene: str, env: str | None, size: str | None, repair: bool, defines: dict[str, Any]) -> Any:
    import warnings

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        handle = api.load_scene(scene, envmap=env, size=size_of(size), repair_env=repair, **defines)
    for warning in caught:
        err.print(f"warning: {escape(str(warning.message))}", style="yellow", highlight=False, soft_wrap=True)
    return handle


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
        print_json(result)
        return
    rows = [
        {"metric": name, "value": number(m["value"]), "95 % interval": " … ".join(map(number, m["ci95"]))}
        for name, m in result["metrics"].items()
        if not name.endswith("_full")
    ]
    print_table(rows, ["metric", "value", "95 % interval"])
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
        print_json(comparison)
        return
    out.print(runs.table(comparison))
    print(runs.summary(comparison))
    if output:
        print((output / "index.html").resolve())
