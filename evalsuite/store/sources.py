"""Which source files decide what a technique draws, found without running them, so that a change draws its own cells anew
and no others."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from threading import Lock

from evalsuite.store.cache import SHADERS

PACKAGE = Path(__file__).resolve().parents[1]
_SHADER_FOLDERS = (PACKAGE / "gpu" / "glsl", PACKAGE / "gpu" / "glsl" / "library")
#: Followed no further: the table of all techniques imports each of them.
_REGISTRY = PACKAGE / "gpu" / "techniques" / "__init__.py"


def technique_files(shader: Path) -> list[Path]:
    """Files that decide a technique's pixels, sorted. shader: its GLSL file.

    Of a technique of the package: the module of the same stem, what it imports from evalsuite's gpu, math and lights
    (function-level imports too), and shaders that any of these names. Of one from elsewhere: all modules and shaders of its
    folder, or a lone shader's own definition beside it.
    """
    shader = shader.resolve()
    module = shader.with_suffix(".py")
    if not module.is_relative_to(PACKAGE):
        if not module.is_file():
            return [path for path in (shader, shader.with_suffix(".toml")) if path.is_file()]
        return sorted(path for path in shader.parent.rglob("*") if path.suffix in (".py", *SHADERS) and path.is_file())
    return module_files(module)


def module_files(module: Path) -> list[Path]:
    """A module of the package, what it imports from gpu, math and lights, and the shaders that any of these names, sorted."""
    found: set[Path] = set()
    pending = [module]
    while pending:
        path = pending.pop()
        if path not in found:
            found.add(path)
            pending += _named_in(path) if path.suffix == ".py" else []
    return sorted(found)


#: CPython 3.11's parser counts its depth for all threads together: two at once can end in a SystemError.
_PARSER = Lock()


@lru_cache(maxsize=512)
def _named_in(module: Path) -> tuple[Path, ...]:
    """Modules of gpu, math and lights that a module imports, and shaders: of its own stem, and those whose names it holds."""
    with _PARSER:
        tree = ast.parse(module.read_text(encoding="utf-8"))
    found = {module.with_suffix(suffix) for suffix in SHADERS}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found |= {path for name in [None, *(alias.name for alias in node.names)] for path in _module_files(node.module, name)}
        elif isinstance(node, ast.Import):
            found |= {path for alias in node.names for path in _module_files(alias.name, None)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.endswith(SHADERS):
            found |= {folder / node.value for folder in (module.parent, *_SHADER_FOLDERS)}
    return tuple(path for path in found if path.is_file() and path != _REGISTRY)


def _module_files(module: str, name: str | None) -> Iterator[Path]:
    top, *rest = module.split(".")
    if top != PACKAGE.name or not rest or rest[0] not in ("gpu", "math", "lights"):
        return
    path = PACKAGE.joinpath(*rest, *([name] if name else []))
    yield from (path.with_suffix(".py"), path / "__init__.py")
