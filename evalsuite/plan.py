"""A report definition (`reports/*.toml`) and the command line's choices → the list of cells to make.

A cell is one scene × technique × parameters × target: one GPU picture, one Mitsuba picture, one comparison.
"""

from __future__ import annotations

import fnmatch
import itertools
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from evalsuite.errors import EvalsuiteError, unknown
from evalsuite.gpu import registry
from evalsuite.scene import builtin
from evalsuite.scene.dependencies import ROOM, names_id, room_path
from evalsuite.scene.dependencies import parameters as scene_parameters
from evalsuite.scene.model import SUBJECT

Value = float | int | str

#: Relative standard error of the reference: mean per-pixel standard error inside the object mask, over the mean
#: radiance there; and the cap on samples per pixel at which sampling stops in any case (which is then said).
QUALITY: Mapping[str, tuple[float, int]] = {
    "draft": (0.02, 1 << 12),
    "standard": (0.005, 1 << 15),
    "publication": (0.001, 1 << 19),
}


def usual_cap(target_error: float) -> int:
    """Cap [samples per pixel] that goes with a relative standard error which no --quality names: the next finer quality's."""
    return next((cap for limit, cap in QUALITY.values() if target_error >= limit), QUALITY["publication"][1])


#: The target that only scenes with a room have.
NEAR_FIELD = "near-field"

#: The targets that take the environment apart (`lights.model`), and so depend on how.
DISCS = ("discs-unshadowed", "discs-centre", "discs", "discs-shadowed")

#: The targets without any visibility.
UNSHADOWED = ("unoccluded", "discs-unshadowed", "lookup")

#: Targets in order of truth, as in `reference.integrators`.
TARGETS: Mapping[str, str] = {
    "unoccluded": "environment × BRDF with horizon, no visibility",
    "discs-unshadowed": "the environment taken apart into area lights (flat discs) and a remainder, no visibility",
    "discs-centre": "as `discs`, but each area light shaded from its centre, with the visible part of its disc",
    "discs": "the environment's area lights with visibility, the remainder without",
    "discs-shadowed": "area lights and remainder with visibility",
    "direct": "with visibility: light straight from the environment (and area lights)",
    "path": "with visibility and interreflection",
    NEAR_FIELD: "the same within the real room, for scenes that name one",
    "lookup": "no light: the map of a non-photorealistic material, looked up exactly",
}


@dataclass(frozen=True)
class Cell:
    """technique: its id, or the path of a user's own shader. parameters: those stated by the report or the user (defaults
    left out). forced: those among them that the user gave with -p, which bind a scene's materials even when it names no
    `subject`. defines: values of the scene's own parameters. headroom: whether to search the technique's free parameters."""

    scene: str
    path: Path
    environment: str | None
    environment_path: Path | None
    technique: str
    parameters: Mapping[str, Value] = field(default_factory=dict)
    target: str = "unoccluded"
    forced: frozenset[str] = frozenset()
    defines: Mapping[str, Value] = field(default_factory=dict)
    headroom: bool = False

    @property
    def stated(self) -> dict[str, Value]:
        """All that was stated beside scene, technique and target: a replaced environment, the technique's parameters, and
        the scene's."""
        return ({"env": self.environment} if self.environment else {}) | dict(self.parameters) | dict(self.defines)

    @property
    def id(self) -> str:
        """`<scene>/<technique>/<parameters>/<target>`; a replaced environment counts among the parameters."""
        text = ",".join(f"{name}={format_value(value)}" for name, value in self.stated.items()) or "default"
        technique = Path(self.technique).stem if registry.is_shader(self.technique) else self.technique
        return "/".join(part.replace("/", "∕") for part in (self.scene, technique, text, self.target))


@dataclass(frozen=True)
class Group:
    name: str
    scenes: tuple[str, ...]
    techniques: tuple[str, ...]
    environments: tuple[str | None, ...] = (None,)
    targets: tuple[str, ...] = ()  # none: each technique's own
    parameters: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    headroom: bool = False


@dataclass(frozen=True)
class Report:
    name: str
    title: str
    description: str
    groups: tuple[Group, ...]
    size: tuple[int, int] | None = None  # of the pictures; None: each scene's own


@dataclass(frozen=True)
class Choice:
    """What the command line says on top of a report; empty means: as in the report."""

    scenes: Sequence[str] = ()
    techniques: Sequence[str] = ()
    environment: str | None = None
    targets: Sequence[str] = ()
    parameters: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    headroom: bool = False


def choice_to_json(choice: Choice) -> dict[str, object]:
    """What of a choice is not as in the report, as plain JSON."""
    return {name: value for name, value in vars(choice).items() if value}


def choice_from_json(data: Mapping) -> Choice:
    """A choice that `choice_to_json` gave."""
    made = {name: tuple(data.get(name) or ()) for name in ("scenes", "techniques", "targets")}
    parameters = {name: tuple(values) for name, values in (data.get("parameters") or {}).items()}
    return Choice(**made, environment=data.get("environment"), parameters=parameters, headroom=bool(data.get("headroom")))


def format_value(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def parse_value(text: str) -> Value:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def parse_parameters(options: Sequence[str]) -> dict[str, tuple[Value, ...]]:
    """["exponent=10,100", "bias=2"] → {"exponent": (10, 100), "bias": (2,)}."""
    parsed: dict[str, tuple[Value, ...]] = {}
    for option in options:
        name, equals, text = option.partition("=")
        values = tuple(parse_value(part.strip()) for part in text.split(",") if part.strip())
        if not equals or not name.strip() or not values:
            raise EvalsuiteError(f"-p {option}", "no name=value", "name=value, or name=value1,value2,… to sweep")
        parsed[name.strip()] = values
    return parsed


def report_path(name: str) -> Path:
    """Path of a report by name or of a .toml file. Raises EvalsuiteError for an unknown one."""
    path = Path(name)
    if path.suffix == ".toml":
        if not path.is_file():
            raise EvalsuiteError(path, "no such file", "a report definition (.toml)", "check the path")
        if not path.stem.strip("."):
            raise EvalsuiteError(path, "no name before .toml", "a report definition NAME.toml", "its results go to a folder NAME")
        return path
    known = {p.stem: p for p in sorted(builtin.reports_directory().glob("*.toml"))}
    if name not in known:
        raise unknown("report", name, known, "`evalsuite list reports`")
    return known[name]


_GROUP_KEYS = {"name", "scenes", "techniques", "environments", "targets", "parameters", "headroom"}


def load_report(name: str) -> Report:
    """Read and check a report definition. Raises EvalsuiteError naming the file and the key at fault."""
    path = report_path(name)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise EvalsuiteError(path, str(error), "a TOML report definition", "mend the file there") from error
    strange = set(data) - {"title", "description", "size", "group"}
    if strange or not isinstance(data.get("group"), list):
        got = f"unknown key '{sorted(strange)[0]}'" if strange else "no [[group]]"
        raise EvalsuiteError(path, got, "title, description, size and [[group]] tables")
    size = data.get("size")
    whole = isinstance(size, list) and len(size) == 2 and all(type(n) is int and 1 <= n <= 16384 for n in size)
    if size is not None and not whole:
        raise EvalsuiteError(f"{path}, size", repr(size), "[width, height] in pixels, 1 to 16384 each")
    groups = []
    for number, table in enumerate(data["group"], 1):
        where = f"{path} [[group]] {number}"
        if not isinstance(table, dict):
            raise EvalsuiteError(where, repr(table)[:60], "a table")
        strange = set(table) - _GROUP_KEYS
        if strange:
            raise EvalsuiteError(where, f"unknown key '{sorted(strange)[0]}'", ", ".join(sorted(_GROUP_KEYS)))

        def names(key: str, default: tuple = (), table: dict = table, where: str = where) -> tuple:
            value = table.get(key, list(default))
            if not isinstance(value, list) or not all(isinstance(v, str) for v in value if v is not None):
                raise EvalsuiteError(f"{where}, {key}", repr(value), "a list of names")
            return tuple(value)

        if not isinstance(table.get("headroom", False), bool):
            raise EvalsuiteError(f"{where}, headroom", repr(table["headroom"]), "true or false")
        parameters = table.get("parameters", {})
        if not isinstance(parameters, dict):
            raise EvalsuiteError(f"{where}, parameters", repr(parameters), "a table of name = value or [values]")
        for key, values in parameters.items():
            swept = values if isinstance(values, list) else [values]
            if not swept or not all(isinstance(value, str | int | float) for value in swept):
                raise EvalsuiteError(f"{where}, parameters.{key}", repr(values)[:60], "a number or word, or a list of them")
        groups.append(
            Group(
                name=str(table.get("name", number)),
                scenes=names("scenes"),
                techniques=names("techniques"),
                environments=names("environments") or (None,),
                targets=names("targets"),
                parameters={k: tuple(v) if isinstance(v, list) else (v,) for k, v in parameters.items()},
                headroom=table.get("headroom", False),
            )
        )
    title, description = str(data.get("title", path.stem)), str(data.get("description", ""))
    return Report(path.stem, title, description, tuple(groups), tuple(size) if size else None)


def _matching(patterns: Sequence[str]) -> list[str]:
    chosen: list[str] = []
    for pattern in patterns:
        matches = fnmatch.filter(registry.names(), pattern) or [registry.find(pattern).name]
        chosen += [m for m in matches if m not in chosen]
    return chosen


def plan(report: Report, choice: Choice | None = None) -> list[Cell]:
    """All cells of a report under the user's choices, each once, in the report's order.

    Raises EvalsuiteError for unknown scenes, environments, techniques, targets, or a parameter that no chosen technique and
    no chosen scene has. Where both have one of that name, it is the technique's."""
    choice = choice or Choice()
    selected = _matching(choice.techniques) if choice.techniques else None
    in_report = [t for group in report.groups for t in _matching(group.techniques)]
    extra = [t for t in selected or [] if t not in in_report]

    cells: dict[str, Cell] = {}
    used: set[str] = set()
    known: set[str] = set()
    subject: dict[Path, bool] = {}
    labels: dict[str, Path] = {}
    open_in_scene: dict[tuple[Path, str], set[str]] = {}
    for group in report.groups:
        techniques = [t for t in _matching(group.techniques) if selected is None or t in selected] + extra
        parameters = dict(group.parameters) | dict(choice.parameters)
        environments = (choice.environment,) if choice.environment else (None,) if choice.scenes else group.environments
        for name, environment, technique in itertools.product(choice.scenes or group.scenes, environments, techniques):
            path = builtin.scene_path(name)
            if path not in subject:
                subject[path] = names_id(path, SUBJECT)
            own = {p.name: p.kind for p in registry.find(technique).parameters}
            known |= set(own)
            # A scene without a subject keeps its own materials: only the user's -p changes those. What the report sets in a
            # technique is for the report's own scenes, and no value of its is for a technique that it does not hold.
            bindable = {"material": subject[path], "technique": not choice.scenes}
            of_report = {k for k in own if bindable[own[k]] and technique not in extra}
            sweep = {k: v for k, v in parameters.items() if k in own and (k in choice.parameters or k in of_report)}
            room = str(parameters[ROOM][0]) if ROOM in parameters else ""
            if (path, room) not in open_in_scene:
                open_in_scene[path, room] = set(scene_parameters(path, {ROOM: room} if room else {}))
            of_scene = {k: v for k, v in parameters.items() if k in open_in_scene[path, room] - set(own)}
            known |= open_in_scene[path, room]
            used |= set(sweep) | set(of_scene)
            for target in choice.targets or group.targets or (registry.find(technique).target,):
                if target not in TARGETS:
                    raise unknown("target", target, TARGETS, "`evalsuite list targets`")
                if target in group.targets and not choice.targets and target == NEAR_FIELD and not room_path(path):
                    continue  # the report's own scenes have a room; the user's need not
                for values in itertools.product(*sweep.values(), *of_scene.values()):
                    own_values = dict(zip(sweep, values, strict=False))
                    registry.find(technique).parse(own_values)
                    cell = Cell(
                        scene=_label(path, labels),
                        path=path,
                        environment=_environment_label(environment),
                        environment_path=builtin.environment_path(environment) if environment else None,
                        technique=technique,
                        parameters=own_values,
                        target=target,
                        forced=frozenset(choice.parameters) & set(own),
                        defines=dict(zip(of_scene, values[len(sweep) :], strict=True)),
                        headroom=group.headroom or choice.headroom,
                    )
                    cells.setdefault(cell.id, cell)
    for name in choice.parameters:
        if cells and name not in used:
            raise unknown("parameter", name, sorted(known), "`evalsuite list techniques` and `evalsuite list scenes`")
    return list(cells.values())


def _label(path: Path, labels: dict[str, Path]) -> str:
    """The scene's name in ids: its file's, with the folder's where two scenes have the same."""
    for name in (path.stem, f"{path.parent.name}-{path.stem}", str(path)):
        if labels.setdefault(name, path) == path:
            return name
    raise AssertionError(path)


def _environment_label(environment: str | None) -> str | None:
    if environment is None or not re.search(r"[/\\]|\.(exr|hdr)$", environment, re.IGNORECASE):
        return environment
    return Path(environment).name
