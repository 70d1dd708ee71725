"""A changed shader draws its own cells again and no others. The change is made to a copy of the checkout's code."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from small_scene import scene_xml

REPO = Path(__file__).resolve().parents[2]
TECHNIQUES = ("diffuse-topmip", "glossy-mcguire", "npr-sketch", "npr-hatching")
REPORT = f"""
[[group]]
scenes = ["{{scene}}"]
techniques = {list(TECHNIQUES)}
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the code and a scene; run() → cells by technique, and how many entries of each kind the store holds."""
    root = tmp_path_factory.mktemp("copy")
    for folder in ("evalsuite", "scenes", "reports"):
        shutil.copytree(REPO / folder, root / folder, ignore=shutil.ignore_patterns("__pycache__", "build"))
    shutil.copy(REPO / "pyproject.toml", root)
    (root / "small.xml").write_text(scene_xml(material="subject"), encoding="utf-8")
    (root / "small.toml").write_text(REPORT.format(scene=root / "small.xml"), encoding="utf-8")
    return root


@pytest.fixture(scope="module")
def run(copy, evalsuite, tmp_path_factory):
    store = tmp_path_factory.mktemp("store")

    def call():
        done = evalsuite("run", copy / "small.toml", "--target-error", "0.05", "--out", copy / "out", "--json",
                         cwd=copy, PYTHONPATH=str(copy), EVALSUITE_CACHE=str(store))  # fmt: skip
        assert done.code == 0, done.err
        cells = {cell["technique"]: cell for cell in json.loads(done.out)["cells"]}
        assert set(cells) == set(TECHNIQUES) and {cell["status"] for cell in cells.values()} == {"scored"}
        made = {kind.name: len(list(kind.glob("*/*/meta.json"))) for kind in store.iterdir() if kind.is_dir()}
        return cells, made

    return call


def changed(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, path
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_only_what_a_change_touches_is_made_again(copy, run):
    first, made = run()
    assert not any(cell["cost"]["cached"] for cell in first.values())
    assert made["image"] == 4 and made["certificate"] == 1
    again, same = run()
    assert all(cell["cost"]["cached"] for cell in again.values()) and same == made

    # A technique's own shader: its picture, its comparison and its ledger, nothing of the others', no reference, no formula.
    shader = copy / "evalsuite" / "gpu" / "techniques" / "glossy_mcguire.glsl"
    changed(shader, "return fresnel * specular_reflectance", "return 0.5 * fresnel * specular_reflectance")
    halved, more = run()
    assert [t for t in TECHNIQUES if not halved[t]["cost"]["cached"]] == ["glossy-mcguire"]
    assert more == made | {name: made[name] + 1 for name in ("image", "comparison", "chain", "findings")}
    ratio = halved["glossy-mcguire"]["mean_image"] / first["glossy-mcguire"]["mean_image"]
    assert ratio == pytest.approx(0.5, rel=1e-4)
    for other in set(TECHNIQUES) - {"glossy-mcguire"}:
        assert halved[other]["metrics"] == first[other]["metrics"]

    # GLSL that some techniques share: theirs.
    changed(copy / "evalsuite" / "gpu" / "glsl" / "library" / "npr.glsl", "texture(npr_map, 0.5 + 0.5 * p).rgb",
            "0.5 * texture(npr_map, 0.5 + 0.5 * p).rgb")  # fmt: skip
    shared, most = run()
    assert [t for t in TECHNIQUES if not shared[t]["cost"]["cached"]] == ["npr-sketch", "npr-hatching"]
    both = {"image": more["image"] + 2, "comparison": more["comparison"] + 2}
    assert most == more | both | {"findings": more["findings"] + 1}
