"""What the papers have and we cannot ship, what stands in for it, and the cells of a figure or claim with one or the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.plan import Cell, load_report, plan
from evalsuite.report.figures.maps import Map


@dataclass(frozen=True)
class Role:
    """called: what the paper has, in words. stand_in: the built-in of the same kind."""

    called: str
    stand_in: str


#: Maps that the papers use, by the name that `--env NAME=FILE` takes.
MAPS: Mapping[str, Role] = {
    "uffizi": Role("the Uffizi gallery", "office"),
    "grace": Role("Grace Cathedral", "cathedral"),
    "galileo": Role("Galileo's tomb", "chapel"),
    "kitchen": Role("the kitchen", "office"),
    "st-peters": Role("St Peter's", "basilica"),
    "cafe": Role("the café", "office"),
    "office-scene": Role("Heidrich's office scene", "office"),
    "second-scene": Role("the second scene of 001 Fig 14", "cathedral"),
    "lamps": Role("the map of 003 Fig 1", "cathedral"),
    "even": Role("the map of 003 Fig 3", "office"),
}
#: Objects; stand-ins are scenes.
MESHES: Mapping[str, Role] = {
    "bunny": Role("the bunny", "organic"),
    "bust": Role("the bust", "teapot"),
    "car": Role("the car", "torus"),
    "teapot": Role("the papers' teapot", "teapot"),
}


def given(option: str, texts: Sequence[str], roles: Mapping[str, Role]) -> dict[str, Path]:
    """["uffizi=FILE"] → {"uffizi": FILE}. Raises EvalsuiteError for an unknown role or a missing file."""
    found = {}
    for text in texts:
        name, equals, path = text.partition("=")
        if not equals or name not in roles:
            raise EvalsuiteError(
                f"{option} {text}", "no such role" if equals else "no NAME=FILE", f"NAME=FILE with NAME one of {', '.join(roles)}"
            )
        if not Path(path).is_file():
            raise EvalsuiteError(f"{option} {text}", "no such file", "a file that can be read", "check the path")
        for other, file in found.items():
            if file.name == Path(path).name and not file.samefile(path):  # cells are named by the file's name
                raise EvalsuiteError(f"{option} {text}", f"a file called as that of {other}", "another name", "rename one")
        found[name] = Path(path)
    return found


def named(roles: Sequence[str], own: Mapping[str, Path]) -> list[Map]:
    """The maps of these roles: the papers' own as far as given, role → file, else what stands in for them."""
    return [Map(role, MAPS[role].called, str(own.get(role, MAPS[role].stand_in)), role not in own) for role in roles]


def cells_of(
    definition: Path, maps: Mapping[str, Path], scenes: Mapping[str, Path] | None = None
) -> tuple[list[Cell], dict[str, str]]:
    """The cells that a report's TOML file asks for, roles among its scenes and environments replaced, and what stands in for what
    in them: {"the Uffizi gallery": "office"}. maps: the papers' own, role → file, as far as given; scenes: the same of scenes
    with their meshes. Raises EvalsuiteError."""
    report = load_report(str(definition))
    stand_ins: dict[str, str] = {}

    def put(name: str | None, roles: Mapping[str, Role], own: Mapping[str, Path]) -> str | None:
        if name not in roles:
            return name
        if name in own:
            return str(own[name])
        stand_ins[roles[name].called] = roles[name].stand_in
        return roles[name].stand_in

    groups = tuple(
        replace(
            group,
            scenes=tuple(put(name, MESHES, scenes or {}) for name in group.scenes),
            environments=tuple(put(name, MAPS, maps) for name in group.environments),
        )
        for group in report.groups
    )
    return plan(replace(report, groups=groups)), stand_ins
