"""Environment maps: env …, decompose."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from evalsuite.cli.app import (
    Json,
    RepairEnv,
    app,
    direction_of,
    err,
    number,
    print_json,
    print_table,
    require_exr,
)

env_app = typer.Typer(no_args_is_help=True, help="Environment maps: list, inspect, make.")
app.add_typer(env_app, name="env")


@env_app.command("list")
def env_list(as_json: Json = False) -> None:
    """Environments known by name: built in, of an installed Blender, in $EVALSUITE_ENV_PATH."""
    from evalsuite.scene import builtin

    rows = [{k: str(v) for k, v in row.items()} for row in builtin.list_environments()]
    rows += [{"name": k, "path": "", "source": "built-in", "description": v} for k, v in builtin.FAMILIES.items()]
    print_json(rows) if as_json else print_table(rows, ["name", "source", "description"])


@env_app.command("info")
def env_info(file: Annotated[str, typer.Argument(help="Lat-long .exr/.hdr, or a name.")], as_json: Json = False) -> None:
    """Resolution, range, mean, irradiance, and what had to be cleaned."""
    from evalsuite.commands_environments import environment_facts

    facts = environment_facts(file)
    print_json(facts) if as_json else print_table([{"": k, "value": v} for k, v in facts.items()], ["", "value"])


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
    from evalsuite.commands_environments import convert_environment

    require_exr(output)
    with err.status(f"converting {escape(file)}"):
        facts = convert_environment(file, output, to, origin, size, direction_of("--view", view), repair_env)
    for note in facts["notes"]:
        err.print(f"warning: {escape(file)}: {escape(note)}", style="yellow", highlight=False, soft_wrap=True)
    if as_json:
        print_json(facts)
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
    from evalsuite.commands_environments import make_environment

    require_exr(output)
    with err.status(f"making {escape(name)}"):
        make_environment(name, output)
    print(output)


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
        print_json(facts)
        return
    rows = [
        {
            "light": row["light"] if row["kept"] else f"({row.get('ended_by', '')})",
            "radius [deg]": f"{row['angular_radius_deg']:.2f}",
            "response": f"{row['response']:.4g}",
            "irradiance (RGB)": " ".join(f"{x:.4g}" for x in row.get("irradiance", ())),
            "share": f"{row['share']:.2%}",
            "so far": f"{row['share_so_far']:.2%}",
            "of the sum before": number(row.get("ratio_to_sum_before")),
        }
        for row in facts["search"]
    ]
    print_table(rows, ["light", "radius [deg]", "response", "irradiance (RGB)", "share", "so far", "of the sum before"])
    residual = max(abs(x) for x in facts["energy_residual"])
    count = f"{facts['lights']} light{'' if facts['lights'] == 1 else 's'}"
    print(f"{count} with {facts['share']:.1%} of the luminance; energy kept to {residual:.0e}")
    print(output)
