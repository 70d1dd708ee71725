"""Which files decide a scene, found without Mitsuba, so that an unchanged scene is recognised in milliseconds.

Every attribute in the XML that names an existing file beside it counts; a name too many only re-renders once too often.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from evalsuite.errors import EvalsuiteError


def dependencies(path: Path) -> list[Path]:
    """The XML file itself, files it includes, and every mesh, map and texture that they name (absolute, sorted).

    Raises EvalsuiteError when the file cannot be read or is not XML (with the line)."""
    found: set[Path] = set()
    _collect(Path(path).resolve(), Path(path).resolve().parent, {}, found, set())
    return sorted(found)


def names_id(path: Path, name: str) -> bool:
    """Whether an element of the scene, or of a file it includes, has this id. Raises EvalsuiteError as `dependencies`."""
    ids: set[str] = set()
    _collect(Path(path).resolve(), Path(path).resolve().parent, {}, set(), ids)
    return name in ids


def _collect(path: Path, root: Path, defaults: dict[str, str], found: set[Path], ids: set[str]) -> None:
    if path in found:
        return
    found.add(path)
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
    for element in tree.iter():
        if element.tag == "default":
            defaults.setdefault(element.get("name", ""), element.get("value", ""))
    for element in tree.iter():
        ids.add(element.get("id", ""))
        for value in element.attrib.values():
            value = re.sub(r"\$\{?(\w+)\}?", lambda match: defaults.get(match[1], match[0]), value)
            if not value or len(value) > 1024 or "\0" in value:
                continue
            for base in (root, path.parent):
                candidate = base / value
                try:
                    is_file = candidate.is_file()
                except OSError:
                    is_file = False
                if is_file:
                    if element.tag == "include":
                        _collect(candidate.resolve(), root, defaults, found, ids)
                    else:
                        found.add(candidate.resolve())
                    break
