"""What decides a scene, found without Mitsuba: its files, so that an unchanged scene is recognised in milliseconds, and the
parameters that it leaves open.

Every attribute in the XML that names an existing file beside it counts; a name too many only re-renders once too often.
A `<default name="room" value="FILE"/>` names the scene's real surroundings, another Mitsuba XML, whose files and parameters
count as well.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from evalsuite.errors import EvalsuiteError
from evalsuite.image.files import file_stamp

#: Scene parameter that names the room's file.
ROOM = "room"

Defines = Mapping[str, str]


@dataclass
class _Facts:
    """values: the parameters, as given, else their defaults. declared: the `<default>`s of the files. files, ids: found."""

    values: dict[str, str]
    declared: dict[str, str] = field(default_factory=dict)
    files: set[Path] = field(default_factory=set)
    ids: set[str] = field(default_factory=set)


def dependencies(path: Path, defines: Defines | None = None) -> list[Path]:
    """The XML file itself, files it includes, and every mesh, map and texture that they name (absolute, sorted).

    defines: values of scene parameters other than their defaults. Raises EvalsuiteError when a file cannot be read or is not
    XML (with the line)."""
    return sorted(_with_room(path, defines).files)


def parameters(path: Path, defines: Defines | None = None) -> dict[str, str]:
    """The scene's parameters, each with its default: `<default>`s of the file, of what it includes, and of the room that it
    names. Raises EvalsuiteError as `dependencies`."""
    return _with_room(path, defines).declared


def check_parameters(path: Path, defines: Defines) -> None:
    """Raise EvalsuiteError for a parameter that the scene does not have."""
    known = parameters(path, defines) if defines else {}
    for name in defines:
        if name not in known:
            expected = f"one of its parameters ({', '.join(known)})" if known else "none, as it has no parameters"
            raise EvalsuiteError(path, f"the parameter '{name}'", expected, 'name it in a <default name="…" value="…"/> there')


def room_path(path: Path, defines: Defines | None = None) -> Path | None:
    """The room that a scene names, or None. Raises EvalsuiteError when there is no such file."""
    facts = _facts(path, defines)
    name = facts.values.get(ROOM, "") if ROOM in facts.declared else ""
    if not name:
        return None
    room = Path(path).resolve().parent / name
    if not is_file(room):
        raise EvalsuiteError(
            path,
            f"no file '{name}' for its parameter {ROOM}",
            f"a Mitsuba XML, absolute or relative to {room.parent}",
            "check it",
        )
    return room


def names_id(path: Path, name: str) -> bool:
    """Whether an element of the scene, or of a file it includes, has this id. Raises EvalsuiteError as `dependencies`."""
    return name in _facts(path, None).ids


#: What was read of a scene, with the state of each file it names: a run asks hundreds of times.
_read: dict[tuple[Path, tuple], tuple[list[tuple[Path, int, int]], _Facts]] = {}


def _facts(path: Path, defines: Defines | None) -> _Facts:
    key = Path(path).resolve(), tuple(sorted((defines or {}).items()))
    stamps, facts = _read.get(key, ([], None))
    if facts is None or stamps != _stamps(facts.files):
        facts = _Facts(dict(defines or {}))
        _collect(key[0], key[0].parent, facts)
        _read[key] = _stamps(facts.files), facts
    return replace(facts, declared=dict(facts.declared), files=set(facts.files))


def _stamps(files: set[Path]) -> list[tuple]:
    try:
        return [(file, *file_stamp(file)) for file in sorted(files)]
    except OSError:  # gone meanwhile
        return []


def _with_room(path: Path, defines: Defines | None) -> _Facts:
    facts, room = _facts(path, defines), room_path(path, defines)
    if room is not None:
        # The room's own defaults hold in the room alone; what is given holds in both.
        more = _facts(room, defines)
        facts.files |= more.files
        facts.declared = more.declared | facts.declared
    return facts


def is_file(path: Path) -> bool:
    """Whether it is one; a name that no file can have (too long, with a null) names none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _collect(path: Path, root: Path, facts: _Facts) -> None:
    if path in facts.files:
        return
    facts.files.add(path)
    try:
        tree = ElementTree.fromstring(path.read_bytes())
    except OSError as error:
        raise EvalsuiteError(path, error.strerror or str(error), "a readable Mitsuba XML scene", "check the path") from error
    except ElementTree.ParseError as error:
        line, column = error.position
        raise EvalsuiteError(
            f"{path} (line {line}, col {column})",
            f"XML that does not parse ({error.msg.split(':')[0]})",
            "a Mitsuba XML scene",
            "mend the file there",
        ) from error
    except (LookupError, ValueError, RecursionError) as error:  # of encodings that there are not, or of several bytes
        raise EvalsuiteError(path, f"XML that does not parse ({error})", "a Mitsuba XML scene", "mend the file") from error
    for element in tree.iter("default"):
        name, value = element.get("name", ""), element.get("value", "")
        facts.declared.setdefault(name, value)
        facts.values.setdefault(name, value)
    for element in tree.iter():
        facts.ids.add(element.get("id", ""))
        for value in element.attrib.values():
            value = re.sub(r"\$\{?(\w+)\}?", lambda match: facts.values.get(match[1], match[0]), value)
            if not value or len(value) > 1024 or "\0" in value:
                continue
            for base in (root, path.parent):
                candidate = base / value
                if is_file(candidate):
                    if element.tag == "include":
                        _collect(candidate.resolve(), root, facts)
                    else:
                        facts.files.add(candidate.resolve())
                    break
