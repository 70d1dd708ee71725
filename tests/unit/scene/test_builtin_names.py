"""Names of scenes and environments resolve to files, and unknown ones to a helpful line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.scene import builtin

BLENDER = ("city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset")


@pytest.fixture(autouse=True)
def bare_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("EVALSUITE_ENV_PATH", raising=False)
    monkeypatch.setenv("EVALSUITE_BLENDER_DATA", os.devnull)


def test_every_scene_is_listed_and_resolves() -> None:
    scenes = {scene["name"]: scene for scene in builtin.list_scenes()}
    shadows = {"three-boxes", "column", "dancer"}
    assert set(scenes) == {"sphere", "sphere72", "torus", "teapot", "organic", "still-life", "crate", "near-field"} | shadows
    for name, scene in scenes.items():
        assert builtin.scene_path(name) == Path(scene["path"])
        assert builtin.scene_path(scene["path"]) == Path(scene["path"])
        assert scene["title"] and scene["description"]


def test_every_builtin_environment_resolves() -> None:
    listed = {env["name"]: env for env in builtin.list_environments()}
    assert list(listed) == list(builtin.ENVIRONMENTS)
    for name, env in listed.items():
        assert env["source"] == "built-in"
        assert builtin.environment_path(name).is_file()


def test_near_names_are_suggested() -> None:
    with pytest.raises(EvalsuiteError) as error:
        builtin.scene_path("teapt")
    assert "did you mean 'teapot'?" in str(error.value) and "still-life" in str(error.value)
    with pytest.raises(EvalsuiteError, match=r"did you mean 'cathedral'\?"):
        builtin.environment_path("Catedral")
    with pytest.raises(EvalsuiteError, match=r"'zzz'.*see `evalsuite env list`"):
        builtin.environment_path("zzz")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("missing", ["gone/scene.xml", "scene.xml", "./gone"])
def test_missing_file_is_named(missing: str) -> None:
    with pytest.raises(EvalsuiteError, match="no such file"):
        builtin.scene_path(missing)


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EvalsuiteError, match="a folder"):
        builtin.environment_path(tmp_path)


def test_users_own_files_with_spaces_and_accents(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "ma scène"
    folder.mkdir()
    for name in ("boîte.xml", "ciel d'été.exr"):
        (folder / name).touch()
    monkeypatch.chdir(folder)
    assert builtin.scene_path(str(folder / "boîte.xml")) == folder / "boîte.xml"
    assert builtin.scene_path("boîte.xml").is_file()
    assert builtin.environment_path("ciel d'été.exr").is_file()


@pytest.mark.parametrize("below", ["datafiles/studiolights/world", "studiolights/world", "."])
def test_blender_maps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, below: str) -> None:
    folder = tmp_path / below
    folder.mkdir(parents=True, exist_ok=True)
    for name in BLENDER:
        (folder / f"{name}.exr").touch()
    (folder / "license.txt").touch()
    monkeypatch.setenv("EVALSUITE_BLENDER_DATA", str(tmp_path))
    found = [env["name"] for env in builtin.list_environments() if env["source"] == "blender"]
    assert found == [f"blender:{name}" for name in BLENDER]
    assert builtin.environment_path("blender:interior") == folder / "interior.exr"
    with pytest.raises(EvalsuiteError, match="did you mean 'blender:interior'"):
        builtin.environment_path("interior")


def test_newest_installed_blender_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for version in ("3.4", "4.10", "4.2"):
        folder = tmp_path / version / "datafiles/studiolights/world"
        folder.mkdir(parents=True)
        (folder / "forest.exr").touch()
    monkeypatch.delenv("EVALSUITE_BLENDER_DATA")
    monkeypatch.setattr(builtin, "_BLENDER_HOMES", (f"{tmp_path}/*",))
    assert "4.10" in str(builtin.environment_path("blender:forest"))


def test_env_path_folders_in_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder, names in {"a": ["mine.hdr", "office.exr", "notes.txt"], "b": ["mine.exr", "other.EXR"]}.items():
        (tmp_path / folder).mkdir()
        for name in names:
            (tmp_path / folder / name).touch()
    monkeypatch.setenv("EVALSUITE_ENV_PATH", os.pathsep.join(str(tmp_path / f) for f in ("a", "absent", "", "b")))
    found = {env["name"]: env["path"] for env in builtin.list_environments() if env["source"] == "env-path"}
    assert found == {"mine": str(tmp_path / "a/mine.hdr"), "other": str(tmp_path / "b/other.EXR")}
    assert builtin.environment_path("office").parent.name == "envmaps"  # a built-in name stays what it is


def test_installed_wheel_holds_them_in_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site-packages/evalsuite/scene"
    (tmp_path / "site-packages/scenes").mkdir(parents=True)  # another package's
    monkeypatch.setattr(builtin, "__file__", str(package / "builtin.py"))
    assert builtin.scenes_directory() == package.parent / "data/scenes"
    assert builtin.reports_directory() == package.parent / "data/reports"


def test_imports_nothing_heavy() -> None:
    code = "import sys, evalsuite.scene.builtin; print([m for m in ('numpy', 'mitsuba', 'drjit', 'OpenEXR') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"


def test_unknown_environment_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(EvalsuiteError, match="did you mean 'furnace'"):
        builtin.make_environment("furnance", tmp_path / "x.exr")
