"""Error ledgers through the program: they close, and a rung is 0 where its assumption holds."""

from __future__ import annotations

import json

import pytest
import schema
from small_scene import scene_xml, write_cube_room


@pytest.fixture(scope="module")
def cells(evalsuite, tmp_path_factory):
    found = {}

    def make(*words):
        if words not in found:
            out = tmp_path_factory.mktemp("ledger")
            done = evalsuite("run", "--size", "48x48", "--target-error", "0.01", "--out", out, *words)
            assert done.code == 0, done.err
            found[words] = json.loads((out / "results.json").read_text())
            schema.validate(found[words])
        return found[words]

    return make


def rung(cell, name):
    (one,) = [rung for rung in cell["ledger"] if rung["rung"] == name]
    return one


def holds_zero(one) -> bool:
    return one["ci95"][0] <= 0.0 <= one["ci95"][1]


def test_ledgers_close_and_a_convex_object_has_no_visibility(cells):
    results = cells("--scene", "sphere", "--env", "office", "-t", "diffuse-topmip", "-t", "glossy-phong-map", "-p", "exponent=20",
                    "--target", "path")  # fmt: skip
    assert len(results["cells"]) == 2
    for cell in results["cells"]:
        assert cell["ledger_closure"] < 1e-6
        assert sum(one["value"] for one in cell["ledger"]) == pytest.approx(cell["ledger_total"], rel=1e-9)
        assert cell["ledger_total"] == pytest.approx(cell["metrics"]["mse"]["value"], rel=1e-6)
        assert [one["from"] for one in cell["ledger"]][:3] == ["path", "direct", "unoccluded"]
        assert all(cell["ledger"][k]["to"] == cell["ledger"][k + 1]["from"] for k in range(len(cell["ledger"]) - 1))
        assert holds_zero(rung(cell, "visibility")) and holds_zero(rung(cell, "interreflection"))
        assert all(f"rung-{k}" in cell["images"] for k in range(len(cell["ledger"])))
    matte, glossy = results["cells"]
    assert rung(matte, "filter kernel")["fraction"] > 0.9, "six face means are no cosine lobe"
    assert abs(rung(matte, "filter kernel")["other_order"]["fraction"] - rung(matte, "filter kernel")["fraction"]) < 0.01
    assert rung(glossy, "lobe")["rel_rmse"]["value"] > 5 * rung(glossy, "environment representation")["rel_rmse"]["value"]
    table = {row["technique"]: row for row in results["causes"]}
    assert table["diffuse-topmip"]["causes"][0]["rung"] == "filter kernel"


def test_in_a_furnace_filters_cost_nothing(cells):
    results = cells(
        "--scene", "sphere", "--env", "furnace", "-t", "glossy-mcguire", "-t", "glossy-boxmip-lod", "-p", "exponent=20"
    )
    for cell in results["cells"]:
        assert cell["ledger_closure"] < 1e-6
        assert holds_zero(rung(cell, "filter kernel")) and holds_zero(rung(cell, "environment representation"))
    assert rung(results["cells"][0], "lobe")["fraction"] == pytest.approx(1.0, abs=0.01)


def test_a_narrow_lobe_is_whole(cells):
    """N = 5000 about r: the horizon cuts nothing of it, so what is left of the lobe is noise."""
    results = cells("--scene", "sphere", "--env", "cosine", "-t", "glossy-phong-map", "-p", "exponent=5000")
    (cell,) = results["cells"]
    assert holds_zero(rung(cell, "lobe"))


def test_walls_at_infinity_are_the_environment_and_near_ones_are_not(cells, tmp_path):
    """A sphere alone between six shining walls, 10⁴ and 4 of its radii away; the map holds them at infinity."""
    (tmp_path / "scene.xml").write_text(
        scene_xml().replace('<scene version="3.0.0">', '<scene version="3.0.0"><default name="room" value="far.xml"/>')
    )
    write_cube_room(tmp_path, "far.xml", 1e4)
    write_cube_room(tmp_path, "near.xml", 4.0)
    found = {}
    for name in ("far", "near"):
        results = cells("--scene", str(tmp_path / "scene.xml"), "--env", str(tmp_path / "map.exr"), "-t", "diffuse-topmip",
                        "--target", "near-field", "-p", f"room={name}.xml")  # fmt: skip
        (cell,) = results["cells"]
        assert cell["ledger_closure"] < 1e-6
        assert [one["rung"] for one in cell["ledger"]][:3] == ["distant environment", "interreflection", "visibility"]
        found[name] = rung(cell, "distant environment")
    far, near = found["far"], found["near"]
    assert holds_zero(far) and far["rel_rmse"]["value"] < 0.005
    assert not holds_zero(near) and near["rel_rmse"]["ci95"][0] > 0.05


def gold(alpha):
    values = f"""<float name="alpha" value="{alpha}"/><string name="distribution" value="ggx"/>
        <rgb name="eta" value="0.143, 0.375, 1.442"/><rgb name="k" value="3.98, 2.39, 1.6"/>"""
    return scene_xml(plugin="roughconductor", parameters=values)


def test_fresnel_may_stand_outside_a_narrow_lobe(cells, tmp_path):
    """N = 5000: F hardly varies over the lobe. N = 14: it does, at the rim above all."""
    for name, alpha, env in (("narrow", 0.02, "cosine"), ("wide", 0.35, "office")):
        (tmp_path / f"{name}.xml").write_text(gold(alpha))
        results = cells("--scene", str(tmp_path / f"{name}.xml"), "--env", env, "-t", "glossy-mcguire")
        (cell,) = results["cells"]
        assert [one["rung"] for one in cell["ledger"]][:2] == ["lobe", "Fresnel outside"] and cell["ledger_closure"] < 1e-6
        one = rung(cell, "Fresnel outside")
        assert (one["from"], one["to"]) == ("Fresnel inside", "exact lobe")
        assert holds_zero(one) == (name == "narrow")
        assert (one["rel_rmse"]["value"] < 1e-4) == (name == "narrow")
        assert (one["rel_rmse"]["ci95"][0] > 0.01) == (name == "wide")


def test_a_user_s_shader_is_one_rung(cells, tmp_path):
    (tmp_path / "my.glsl").write_text("vec3 shade(Surface s) { return 0.5 * textureLod(env_cube, s.normal, env_max_level).rgb; }")
    results = cells("--scene", "sphere", "--env", "office", "-t", str(tmp_path / "my.glsl"), "--target", "direct")
    (cell,) = [c for c in results["cells"] if c["status"] == "scored"]
    assert [one["rung"] for one in cell["ledger"]] == ["visibility", "technique"] and cell["ledger_closure"] < 1e-6


def test_npr_has_none_and_it_can_be_left_out(cells):
    results = cells("--scene", "sphere", "-t", "npr-cool-warm")
    assert results["cells"][0]["status"] == "scored" and results["cells"][0]["ledger"] == []
    quick = cells("--scene", "sphere", "--env", "office", "-t", "diffuse-topmip", "--no-ledger")
    assert quick["cells"][0]["status"] == "scored" and quick["cells"][0]["ledger"] == []
