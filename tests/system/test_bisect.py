"""The line of docs/gate.md for `git bisect run`, in a repository whose commits change a shader."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from small_scene import scene_xml

from evalsuite.image import exr

SHADER = """// {comment}
vec3 shade(Surface s) {{
    vec3 r = reflect(-s.to_view, s.normal);
    float level = log2(env_face_size * sqrt(3.0)) - 0.5 * log2(exponent + 1.0) + {offset};
    return {gain} * specular_reflectance * textureLod(env_cube, r, level).rgb;
}}
"""
#: Commits in order. The fourth, where the search begins, does not compile; the sixth is the culprit.
COMMITS = {
    "as blessed": {},
    "a comment": {"comment": "McGuire's look-up"},
    "another comment": {"comment": "McGuire's look-up, as published"},
    "half a line": {"gain": "radiance_of("},
    "mended": {"comment": "mended"},
    "a level too smooth": {"comment": "smooth", "offset": "1.0"},
    "tidied": {"comment": "tidied", "offset": "1.0"},
    "and more": {"comment": "more", "offset": "1.0"},
}


@pytest.fixture
def repository(tmp_path, evalsuite, monkeypatch):
    """(folder, commits by message), blessed at the first of them; `evalsuite` is on the path as a user has it."""
    for variable in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(variable)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    folder = tmp_path / "shaders"
    folder.mkdir()
    program = tmp_path / "bin" / "evalsuite"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m evalsuite.cli "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    smooth = np.kron(np.random.default_rng(2).uniform(0.2, 2.0, (8, 16, 3)), np.ones((4, 4, 1)))
    exr.write(folder / "map.exr", smooth.astype(np.float32))
    emitter = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'
    (folder / "small.xml").write_text(scene_xml(emitter, material="subject"), encoding="utf-8")
    (folder / "gate.toml").write_text(
        'size = [32, 24]\n[[group]]\nscenes = ["small.xml"]\ntechniques = ["mine.glsl"]\ntargets = ["unoccluded"]\n'
        "parameters = { exponent = 40 }\n",
        encoding="utf-8",
    )
    (folder / ".gitignore").write_text("reports/\n", encoding="utf-8")
    git(folder, "init", "-q")
    commits = {}
    for message, changed in COMMITS.items():
        text = SHADER.format(**{"comment": "mine", "offset": "0.0", "gain": "1.0"} | changed)
        (folder / "mine.glsl").write_text(text, encoding="utf-8")
        if not commits:
            for words in (("run", "gate.toml", "--target-error", "0.05", "--no-ledger"), ("bless", "gate.toml")):
                done = evalsuite(*words, cwd=folder)
                assert done.code == 0, done.err
        git(folder, "add", "-A")
        git(folder, "-c", "user.name=me", "-c", "user.email=me@example.org", "commit", "-q", "-m", message)
        commits[message] = git(folder, "rev-parse", "HEAD").strip()
    return folder, commits


def git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True, text=True).stdout


def documented() -> list[str]:
    """The lines of docs/gate.md from the copy of the baseline to the search."""
    text = (Path(__file__).resolve().parents[2] / "docs" / "gate.md").read_text(encoding="utf-8")
    [block] = [block for block in re.findall(r"```sh\n(.*?)```", text, re.S) if "git bisect run" in block]
    return block.splitlines()


@pytest.mark.skipif(shutil.which("git") is None, reason="no git on this machine")
def test_the_documented_lines_find_the_commit(repository, tmp_path, cache, monkeypatch):
    folder, commits = repository
    monkeypatch.setenv("EVALSUITE_CACHE", str(cache))
    lines = [line.replace("/tmp/", f"{tmp_path}/") for line in documented()]
    script = "\n".join(lines).replace("BAD GOOD", f"{commits['and more']} {commits['as blessed']}")
    done = subprocess.run(["sh", "-ec", script], cwd=folder, capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{commits['a level too smooth']} is the first bad commit" in done.stdout, done.stdout + done.stderr
    found = json.loads((tmp_path / "gate" / "trends.json").read_text(encoding="utf-8"))
    tried = {check["commit"] for check in found["checks"]}
    assert len(tried) >= 3 and all(any(full.startswith(short) for full in commits.values()) for short in tried)
    assert any(commits["half a line"].startswith(short) for short in tried), "a commit that does not compile was skipped"
