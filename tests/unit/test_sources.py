"""Which files decide a technique's pixels."""

from __future__ import annotations

from pathlib import Path

import pytest

from evalsuite.gpu.plan import COMPANIONS
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.store.sources import PACKAGE, module_files, technique_files

FOLDER = PACKAGE / "gpu" / "techniques"


@pytest.mark.parametrize("technique", TECHNIQUES.values(), ids=lambda t: t.id)
def test_a_technique_depends_on_its_own_files_and_on_what_it_imports(technique):
    files = set(technique_files(technique.shader))
    assert {technique.shader, technique.shader.with_suffix(".py"), FOLDER / "base.py"} <= files
    assert {PACKAGE / "gpu" / "glsl" / "library" / name for name in technique.library} <= files
    assert FOLDER / "__init__.py" not in files


def test_a_shader_decides_few_techniques():
    """Those that draw with it, and no others: a change draws its own cells anew."""
    files = {t.id: set(technique_files(t.shader)) for t in TECHNIQUES.values()}
    users = {shader.name: {name for name, own in files.items() if shader in own} for shader in FOLDER.glob("*.glsl")}
    assert users["mirror_cube.glsl"] == {"mirror-cube"} and users["brute_force.glsl"] == {"brute-force"}
    assert all(1 <= len(ids) <= len(TECHNIQUES) // 2 for ids in users.values()), users
    assert set(COMPANIONS.values()) <= set(TECHNIQUES)


def test_what_all_drawing_shares_holds_no_technique_s_own_shaders():
    """A compute shader that prefilters for some techniques must not draw all others anew."""
    shared = set(module_files(PACKAGE / "gpu" / "draw.py"))
    assert {PACKAGE / "gpu" / name for name in ("draw.py", "passes.py", "programs.py", "plan.py", "environment.py")} <= shared
    assert {PACKAGE / "gpu" / "glsl" / name for name in ("main.frag", "surface.vert", "material.glsl", "resample.comp")} <= shared
    some = {path for t in TECHNIQUES.values() for path in technique_files(t.shader) if path.suffix == ".comp"} - shared
    assert len(some) > 5
    for shader in some:
        assert sum(shader in technique_files(t.shader) for t in TECHNIQUES.values()) < len(TECHNIQUES) / 2, shader


def test_a_lone_shader_of_the_users(tmp_path: Path):
    shader = tmp_path / "mine.glsl"
    shader.write_text("vec3 shade(Surface s) { return vec3(1.0); }")
    (tmp_path / "other.glsl").write_text("")
    assert technique_files(shader) == [shader]
    shader.with_suffix(".toml").write_text("")
    assert technique_files(shader) == [shader, shader.with_suffix(".toml")]


def test_a_users_module_takes_its_folder_along(tmp_path: Path):
    for name in ("mine.py", "mine.glsl", "helper.py", "pass.comp", "notes.txt"):
        (tmp_path / name).write_text("")
    assert [path.name for path in technique_files(tmp_path / "mine.glsl")] == ["helper.py", "mine.glsl", "mine.py", "pass.comp"]
