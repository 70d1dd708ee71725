"""`evalsuite check` and `bless` as a user types them: a technique's own shader is changed between two checks."""

from __future__ import annotations

import json
import shutil
import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np
import pytest
from small_scene import scene_xml

from evalsuite.image import exr

#: McGuire's look-up with its constant moved by OFFSET levels.
SHADER = """
vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    float level = log2(env_face_size * sqrt(3.0)) - 0.5 * log2(exponent + 1.0) + OFFSET;
    return specular_reflectance * textureLod(env_cube, r, level).rgb;
}
"""
CELLS = ["small/diffuse-sh9/default/unoccluded", "small/mine/exponent=40/unoccluded"]


class Project:
    """A user's folder: a scene, a shader and a report; `call` types evalsuite there."""

    def __init__(self, folder: Path, evalsuite) -> None:
        self.folder, self.evalsuite = folder, evalsuite
        rng = np.random.default_rng(2)
        smooth = np.kron(rng.uniform(0.2, 2.0, (8, 16, 3)), np.ones((4, 4, 1)))
        exr.write(folder / "map.exr", smooth.astype(np.float32))
        emitter = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'
        (folder / "small.xml").write_text(scene_xml(emitter, material="subject"), encoding="utf-8")
        self.report("mine.glsl", "diffuse-sh9")
        self.shader(0.0)

    def report(self, *techniques: str) -> None:
        text = f'size = [40, 32]\n[[group]]\nscenes = ["small.xml"]\ntechniques = {list(techniques)}\n'
        text += 'targets = ["unoccluded"]\nparameters = { exponent = 40 }\n'
        (self.folder / "gate.toml").write_text(text, encoding="utf-8")

    def shader(self, offset: float) -> None:
        (self.folder / "mine.glsl").write_text(SHADER.replace("OFFSET", f"{offset:.3f}"), encoding="utf-8")

    def call(self, command: str, *words: object, **environment: str):
        outcome = self.evalsuite(command, "gate.toml", *words, cwd=self.folder, **environment)
        assert outcome.code != 2 or (outcome.err.count("\n") == 1 and outcome.err.startswith("error: ")), outcome.err
        return outcome

    def verdicts(self) -> dict[str, str]:
        data = json.loads((self.folder / "reports" / "build" / "gate" / "check.json").read_text(encoding="utf-8"))
        return {cell["id"]: cell["verdict"] for cell in data["cells"]}


@pytest.fixture(scope="module")
def blessed(tmp_path_factory, evalsuite):
    """A project that was run and blessed, the shader half a level off."""
    project = Project(tmp_path_factory.mktemp("gate é"), evalsuite)
    project.shader(0.5)
    nothing = project.call("check")
    assert nothing.code == 2 and "gate.baseline.json: got no such file" in nothing.err
    ran = project.call("run", "--target-error", "0.05", "--no-ledger")
    assert ran.code == 0, ran.err
    done = project.call("bless")
    assert done.code == 0 and "2 cells changed" in done.out, done.err
    return project


@pytest.fixture
def project(blessed, tmp_path, evalsuite):
    """A copy of it, to change."""
    shutil.copytree(blessed.folder, tmp_path / "copy")
    copy = Project.__new__(Project)
    copy.folder, copy.evalsuite = tmp_path / "copy", evalsuite
    return copy


def test_same_again_passes_and_so_do_other_seeds(project):
    for words in ((), ("--seed", "1"), ("--seed", "2", "--strict"), ("--target-error", "0.1")):
        done = project.call("check", *words)
        assert done.code == 0, done.out + done.err
        assert "passed: 2 cells, 2 unchanged" in done.out
    assert set(project.verdicts()) == set(CELLS), "as it was blessed: same cells, same size, no ledger"


def test_planted_fault_fails_and_is_told_everywhere(project):
    project.shader(1.5)
    actions = {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": str(project.folder / "step.md")}
    done = project.call("check", "--junit", "out/junit.xml", "--summary", "out/gate.md", "--seed", "5", **actions)
    assert done.code == 1 and project.verdicts() == {CELLS[0]: "unchanged", CELLS[1]: "further"}
    assert f"::error title=further%3A {CELLS[1]}::further from the truth" in done.err
    cases = xml.parse(project.folder / "out" / "junit.xml").getroot().findall("testsuite/testcase")
    assert {case.get("name"): [child.tag for child in case] for case in cases} == {CELLS[0]: [], CELLS[1]: ["failure"]}
    for file in ("step.md", "out/gate.md"):
        text = (project.folder / file).read_text(encoding="utf-8")
        assert "✗ further" in text and CELLS[1] in text and CELLS[0] not in text

    refused = project.call("bless")
    assert refused.code == 2 and "without a reason" in refused.err
    before = (project.folder / "gate.baseline.json").read_bytes()
    dry = project.call("bless", "*/mine/*", "--reason", "softer on purpose", "--dry-run")
    assert dry.code == 0 and "would be changed" in dry.out and (project.folder / "gate.baseline.json").read_bytes() == before
    assert project.call("bless", "*/mine/*", "--reason", "softer on purpose").code == 0
    assert "softer on purpose" in (project.folder / "gate.baseline.json").read_text(encoding="utf-8")
    assert project.call("check", "--no-run").code == 0
    assert project.call("bless", "--undo").code == 0
    assert (project.folder / "gate.baseline.json").read_bytes() == before
    assert project.call("check", "--no-run").code == 1


def test_closer_proposes_a_bless(project):
    project.shader(0.0)
    done = project.call("check", "--json")
    assert done.code == 0 and project.verdicts()[CELLS[1]] == "closer"
    assert json.loads(done.out)["bless"] == "evalsuite bless gate.toml"
    assert project.call("bless").code == 0 and "closer to the truth" in (project.folder / "gate.baseline.json").read_text()


def test_missing_extra_and_broken_cells_fail_and_the_others_run(project):
    (project.folder / "mine.glsl").write_text("vec3 shade(Surface s) { return radiance; }", encoding="utf-8")
    project.report("mine.glsl", "diffuse-topmip")
    done = project.call("check")
    extra = CELLS[0].replace("sh9", "topmip")
    assert done.code == 1
    assert project.verdicts() == {CELLS[0]: "missing", CELLS[1]: "failed", extra: "extra"}
    project.shader(0.5)
    project.report("mine.glsl", "diffuse-sh9")
    some = project.call("check", "-t", "diffuse-sh9")
    assert some.code == 0 and set(project.verdicts()) == {CELLS[0]}, "asked for fewer, none is missing"
