"""Techniques by name: the built-in table, those of installed packages (entry points), and a user's own shader files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from evalsuite.errors import EvalsuiteError, unknown
from evalsuite.gpu.techniques import TECHNIQUES, user_shader
from evalsuite.gpu.techniques.base import Technique

GROUP = "evalsuite.techniques"


@cache
def _installed() -> Mapping[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def names() -> list[str]:
    """Ids of the built-in techniques and of those that installed packages add."""
    return [*TECHNIQUES, *(name for name in _installed() if name not in TECHNIQUES)]


def is_shader(name: str) -> bool:
    """Whether a name means a user's own shader file."""
    return name.endswith(".glsl")


def find(name: str) -> Technique:
    """The technique of an id, or of the path of a user's own .glsl file. Raises EvalsuiteError for an unknown or broken one."""
    if name in TECHNIQUES:
        return TECHNIQUES[name]
    if is_shader(name):
        return _user(Path(name))
    if name in _installed():
        return _from_package(name)
    raise unknown("technique", name, names(), "`evalsuite list techniques`", ", or the path of a .glsl file")


def _user(path: Path) -> Technique:
    if path.stem in names():
        raise EvalsuiteError(path, f"a technique called '{path.stem}'", "a name of its own", "rename the file")
    return user_shader.load(path)


@cache
def _from_package(name: str) -> Technique:
    """What an entry point names: a Technique, or a class or function that makes one."""
    point = _installed()[name]
    where = f"entry point {name} = {point.value}"
    try:
        made = point.load()
        made = made if isinstance(made, Technique) else made()
    except Exception as error:  # another author's code
        got = f"{type(error).__name__}: {error}"
        raise EvalsuiteError(where, got, "a Technique, or what makes one", "mend that package") from error
    if not isinstance(made, Technique) or made.id != name:
        got = f"a Technique called '{made.id}'" if isinstance(made, Technique) else f"a {type(made).__name__}"
        raise EvalsuiteError(where, got, f"a Technique with the id '{name}'", "mend that package")
    return made
