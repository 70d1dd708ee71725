"""Names → files: the scenes, environments and reports that ship, and the environment maps found on this machine.

Sees neither Mitsuba nor NumPy, so that listings and `--help` stay fast; `make_environment` loads its generator when called.
"""

from __future__ import annotations

import difflib
import importlib.util
import os
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from evalsuite.errors import EvalsuiteError

#: Built-in environments, in the order of the listing: file stem in scenes/envmaps/ and generator's name → description.
ENVIRONMENTS: dict[str, str] = {
    "furnace": "radiance 1 from everywhere: E = π",
    "cosine": "clamped cosine lobe about a tilted axis; closed-form irradiance",
    "sh2": "band-limited to degree 2, all nine SH coefficients non-zero, positive; closed-form irradiance",
    "coloured-cube": "inside of a cube, each face another saturated colour, crisp edges",
    "overcast": "CIE overcast sky above grey ground; closed-form irradiance of the sky",
    "sunsky": "clear sky with the sun at 40°, about 10⁵ × the sky, above grey ground",
    "office": "room evenly lit by windows and ceiling panels, path-traced from a model",
    "cathedral": "dark nave with candles, small bright lamps and stained glass, path-traced from a model",
    "chapel": "plastered church of one nave with eight windows and two lamps, path-traced from a model",
    "basilica": "vast vaulted hall with sixteen high windows, a lantern and lamps, path-traced from a model",
}

#: Families of environments that are made when first asked for: pattern of the name → description.
FAMILIES: dict[str, str] = {
    "band-ℓ": "noise of the one spherical-harmonic degree ℓ, 1 … 64 (wavelength 360°/ℓ), mean 1, contrast 0.2; made on demand",
}
LARGEST_BAND = 64

MAP_SUFFIXES = (".exr", ".hdr")

_BLENDER_MAPS = "datafiles/studiolights/world"
_BLENDER_HOMES = (
    "/usr/share/blender",
    "/usr/share/blender/*",
    "/usr/local/share/blender/*",
    "/opt/blender*/[0-9]*",
    "/snap/blender/current/[0-9]*",
    "/var/lib/flatpak/app/org.blender.Blender/current/active/files/blender/[0-9]*",
    "~/blender*/[0-9]*",
    "~/.local/share/flatpak/app/org.blender.Blender/current/active/files/blender/[0-9]*",
    "/Applications/Blender*.app/Contents/Resources/[0-9]*",
    "~/Applications/Blender*.app/Contents/Resources/[0-9]*",
    "C:/Program Files/Blender Foundation/Blender*/[0-9]*",
)


def scenes_directory() -> Path:
    """Folder of the built-in scenes: the checkout's scenes/, or the copy inside an installed wheel."""
    return _shipped("scenes")


def reports_directory() -> Path:
    """Folder of the report definitions: the checkout's reports/, or the copy inside an installed wheel."""
    return _shipped("reports")


def _shipped(folder: str) -> Path:
    package = Path(__file__).resolve().parents[1]
    # pyproject.toml tells a checkout from a site-packages folder that happens to hold something called `scenes`.
    checkout = (package.parent / "pyproject.toml").is_file()
    return package.parent / folder if checkout else package / "data" / folder


def list_scenes() -> list[dict[str, str]]:
    """The built-in scenes, as {name, path, title, description}; the last two from the file's first comment."""
    scenes = []
    for path in sorted(scenes_directory().glob("*.xml")):
        comment = re.search(r"<!--\s*(.*?):\s*(.*?)\s*-->", path.read_text(encoding="utf-8"), re.DOTALL)
        title, description = comment.groups() if comment else (path.stem, "")
        scenes.append({"name": path.stem, "path": str(path), "title": title, "description": description})
    return scenes


def scene_path(name_or_path: str | Path) -> Path:
    """The Mitsuba XML file of a built-in scene's name, or the given path. Raises EvalsuiteError if there is none."""
    names = {scene["name"]: Path(scene["path"]) for scene in list_scenes()}
    return _resolve(name_or_path, names, "scene", (".xml",), "`evalsuite list scenes`")


def list_environments() -> list[dict[str, str]]:
    """The environments known by name, as {name, path, source, description}; source is built-in, blender or env-path.

    A name that occurs twice (a map `office.exr` in $EVALSUITE_ENV_PATH) stands for the first in this order.
    """
    folder = scenes_directory() / "envmaps"
    found = [(name, folder / f"{name}.exr", "built-in", text) for name, text in ENVIRONMENTS.items()]
    found += [(f"blender:{path.stem}", path, "blender", "CC0 map that ships with Blender") for path in _blender_maps()]
    found += [(path.stem, path, "env-path", f"from {path.parent}") for path in _env_path_maps()]
    listing: dict[str, dict[str, str]] = {}
    for name, path, source, description in found:
        listing.setdefault(name, {"name": name, "path": str(path), "source": source, "description": description})
    return list(listing.values())


def environment_path(name_or_path: str | Path) -> Path:
    """The map of an environment's name (built in, `band-ℓ`, `blender:<name>`, or found in $EVALSUITE_ENV_PATH), or the given
    path. A map of a family is made in the user's cache when first asked for.

    Raises EvalsuiteError if there is none.
    """
    if (degree := band_degree(os.fspath(name_or_path))) is not None:
        return _made_on_demand(f"band-{degree}")
    names = {environment["name"]: Path(environment["path"]) for environment in list_environments()}
    return _resolve(name_or_path, names, "environment", MAP_SUFFIXES, "`evalsuite env list`")


def band_degree(name: str) -> int | None:
    """Degree ℓ of the environment `band-ℓ`; None for other names. Raises EvalsuiteError for a degree that there is not."""
    found = re.fullmatch(r"band-([^./\\\s]*)", name)
    if not found:
        return None
    if not re.fullmatch(r"[1-9]\d?", found[1]) or int(found[1]) > LARGEST_BAND:
        expected = f"a degree from 1 to {LARGEST_BAND}, as band-16"
        raise EvalsuiteError(f"environment '{name}'", f"'{found[1]}'", expected, "choose one")
    return int(found[1])


def _made_on_demand(name: str) -> Path:
    """The map of a family, in the user's cache, under the hash of the code that makes it; a damaged one is made anew."""
    from evalsuite.image.files import replacing
    from evalsuite.store.cache import cache_directory, digest, file_digest, source_digest, write_atomic

    code = source_digest("math/band_noise.py", "math/sphere.py", "math/zonal.py")
    key = digest([file_digest(scenes_directory() / "generate_environments.py"), code])
    path = cache_directory() / "environments" / key[:12] / f"{name}.exr"
    proof = path.with_suffix(".sha256")
    if not (path.is_file() and proof.is_file() and proof.read_text() == file_digest(path)):
        with replacing(path) as temporary:
            make_environment(name, temporary)
        write_atomic(proof, file_digest(path))
    return path


def make_environment(name: str, file: Path) -> None:
    """Build a built-in environment, or one of a family, anew and write it to `file` (EXR). Raises EvalsuiteError for an unknown
    name."""
    if name not in ENVIRONMENTS and band_degree(name) is None:
        raise _unknown(name, ENVIRONMENTS, "environment", "a built-in environment's name", "`evalsuite env list`")
    source = scenes_directory() / "generate_environments.py"
    spec = importlib.util.spec_from_file_location("evalsuite_generate_environments", source)
    assert spec and spec.loader
    generator = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = generator  # dataclasses look their module up
    spec.loader.exec_module(generator)
    generator.make(name, Path(file))


def _resolve(name_or_path: str | Path, names: dict[str, Path], kind: str, suffixes: tuple[str, ...], listing: str) -> Path:
    text = os.fspath(name_or_path)
    if text in names and names[text].is_file():
        return names[text]
    path, wanted = Path(os.path.expanduser(text)), f"{' or '.join(suffixes)} file"
    try:
        is_file, is_folder = path.is_file(), path.is_dir()
    except (OSError, ValueError):  # no name of a file: too long, or with a null
        is_file = is_folder = False
    if is_file:
        return path
    if is_folder:
        raise EvalsuiteError(text, "a folder", f"a path to a {wanted} or one of {', '.join(names)}")
    if text in names or path.suffix.lower() in suffixes or path.name != text:
        raise EvalsuiteError(names.get(text, path), "no such file", f"a readable {wanted}", _near(text, names))
    raise _unknown(text, names, kind, f"a path to a {wanted} or one of {', '.join(names)}", listing)


def _unknown(text: str, names: Iterable[str], kind: str, expected: str, listing: str) -> EvalsuiteError:
    return EvalsuiteError(kind, f"'{text}'", expected, _near(text, names) or f"see {listing}")


def _near(text: str, names: Iterable[str]) -> str:
    """`did you mean …?`, or nothing. Compares without folder, suffix, case and source (`Interior.exr` ~ blender:interior)."""
    plain = {name.split(":")[-1].lower(): name for name in reversed(list(names))}
    near = difflib.get_close_matches(Path(text).stem.split(":")[-1].lower(), plain, n=3, cutoff=0.6)
    return f"did you mean {' or '.join(repr(plain[name]) for name in near)}?" if near else ""


def _blender_maps() -> Iterator[Path]:
    """Maps of the installed Blenders; of two with one name the newest Blender's. $EVALSUITE_BLENDER_DATA names a Blender's
    data folder (the one that holds `datafiles`), or the folder of maps itself, and is then the only place searched."""
    maps: dict[str, Path] = {}
    if chosen := os.environ.get("EVALSUITE_BLENDER_DATA"):
        homes = [Path(chosen).expanduser()]
        folders = [homes[0] / _BLENDER_MAPS, homes[0] / "studiolights" / "world", homes[0]]
    else:
        homes = [home for pattern in _BLENDER_HOMES for home in _glob(Path(pattern).expanduser())]
        folders = [home / _BLENDER_MAPS for home in sorted(homes, key=_version, reverse=True)]
    for folder in folders:
        for path in _maps_in(folder):
            maps.setdefault(path.stem, path)
    yield from (maps[stem] for stem in sorted(maps))


def _env_path_maps() -> Iterator[Path]:
    for folder in os.environ.get("EVALSUITE_ENV_PATH", "").split(os.pathsep):
        if folder:
            yield from _maps_in(Path(folder).expanduser())


def _maps_in(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.suffix.lower() in MAP_SUFFIXES and path.is_file())
    except OSError:  # not there, not a folder, not ours to read
        return []


def _glob(pattern: Path) -> list[Path]:
    try:
        return sorted(Path(pattern.anchor).glob(str(pattern.relative_to(pattern.anchor)))) if pattern.anchor else []
    except OSError:
        return []


def _version(home: Path) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", home.name))
