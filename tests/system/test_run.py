"""The main job, end to end: a scene and a map in, results.json, pictures and the page out."""

from __future__ import annotations

import json
import shutil
import time

import numpy as np
import pytest
import schema
from small_scene import scene_xml

from evalsuite.image import exr

METRICS = "mse rmse relmse rel_rmse mae smape bias rel_bias psnr ssim flip flip_hdr delta_e2000 max_abs p99_abs".split()


@pytest.fixture(scope="module")
def first(evalsuite, tmp_path_factory):
    """A cold run of four cells in a folder with spaces and letters beyond ASCII, from another working folder."""
    folder = tmp_path_factory.mktemp("Ünï côdé 空") / "my scènes"
    (folder / "maps").mkdir(parents=True)
    rng = np.random.default_rng(1)
    exr.write(folder / "maps" / "lobby é.exr", rng.uniform(0.2, 2.0, (16, 32, 3)).astype(np.float32))
    emitter = '<emitter type="envmap"><string name="filename" value="maps/lobby é.exr"/></emitter>'
    (folder / "my scene.xml").write_text(scene_xml(emitter), encoding="utf-8")
    words = (
        "run",
        "--scene",
        folder / "my scene.xml",
        "-t",
        "diffuse-sh9",
        "-t",
        "diffuse-top*",
        "--target",
        "unoccluded",
        "--target",
        "direct",
        "--target-error",
        "0.02",
        "--out",
        folder / "out put",
    )
    outcome = evalsuite(*words, cwd=folder.parent)
    return folder, words, outcome


def test_a_users_own_scene_ends_with_a_page(first):
    folder, _, outcome = first
    assert outcome.code == 0, outcome.err
    assert str(folder / "out put" / "index.html") in outcome.out
    results = json.loads((folder / "out put" / "results.json").read_text(encoding="utf-8"))
    for kind in ("csv", "md", "tex"):
        assert "diffuse-topmip" in (folder / "out put" / f"results.{kind}").read_text(encoding="utf-8")
    schema.validate(results)
    assert [(c["technique"], c["target"], c["status"]) for c in results["cells"]] == [
        (t, target, "scored") for t in ("diffuse-sh9", "diffuse-topmip") for target in ("unoccluded", "direct")
    ]
    for cell in results["cells"]:
        assert cell["id"] == f"my scene/{cell['technique']}/default/{cell['target']}"
        assert set(METRICS) | {f"{m}_full" for m in METRICS} <= set(cell["metrics"])
        assert cell["certificate"]["passed"] and cell["mask_pixels"] > 200
        assert cell["reached_error"] <= 0.02
        for name, metric in cell["metrics"].items():
            low, high = metric["ci95"]
            # JSON has no infinity: the psnr of pictures that noise cannot tell apart has no upper end.
            assert high is not None or name.startswith("psnr")
            assert low <= metric["value"] and (high is None or metric["value"] <= high), name
        for name, path in cell["images"].items():
            assert exr.read(folder / "out put" / path).shape == ((16, 32, 3) if name == "environment" else (40, 48, 3)), name


def test_error_is_image_minus_reference(first):
    folder, _, _ = first
    cell = json.loads((folder / "out put" / "results.json").read_text(encoding="utf-8"))["cells"][1]
    names = ("image", "reference", "error", "mask", "standard_error")
    image, reference, error, mask, sigma = (exr.read(folder / "out put" / cell["images"][name]) for name in names)
    assert error.shape == (40, 48, 3) and not error[mask < 0.5].any()
    image, reference, error, sigma = (picture[mask[..., 0] > 0.5] for picture in (image, reference, error, sigma))
    # As they are kept: both pictures to their bits, the error to 3 % of itself and a quarter of its noise.
    half = 2.0 ** -(exr.significant_bits(folder / "out put" / cell["images"]["image"]) + 1)
    allowed = half * (image + reference) + 0.04 * np.abs(error) + 0.26 * sigma
    assert half < 0.002 and (np.abs(error - (image - reference)) <= allowed).all() and allowed.mean() < 0.5 * np.abs(error).mean()
    assert cell["technique"] == "diffuse-sh9" and np.abs(error).max() > 1e-4


def test_unchanged_second_run_is_quick_and_the_same(evalsuite, first):
    folder, words, _ = first
    before = json.loads((folder / "out put" / "results.json").read_text(encoding="utf-8"))
    start = time.perf_counter()
    outcome = evalsuite(*words, cwd=folder)
    assert outcome.code == 0, outcome.err
    assert time.perf_counter() - start < 5.0  # the promise of the README, for a whole report
    after = json.loads((folder / "out put" / "results.json").read_text(encoding="utf-8"))
    for a, b in zip(before["cells"], after["cells"], strict=True):
        assert b["cost"]["cached"] is True and a["cost"]["cached"] is False
        assert {k: v for k, v in a.items() if k != "cost"} == {k: v for k, v in b.items() if k != "cost"}


def test_relative_path_and_moved_folder_find_the_same_pictures(evalsuite, first, tmp_path):
    folder, _, _ = first
    shutil.copytree(folder, tmp_path / "elsewhere")
    outcome = evalsuite(
        "run",
        "--scene",
        "elsewhere/my scene.xml",
        "-t",
        "diffuse-sh9",
        "--target",
        "direct",
        "--out",
        "o",
        "--json",
        "--target-error",
        "0.02",
        cwd=tmp_path,
    )
    assert outcome.code == 0, outcome.err
    (cell,) = json.loads(outcome.out)["cells"]
    assert cell["status"] == "scored" and cell["cost"]["cached"] is True


def test_fresh_store_gives_bit_identical_results(evalsuite, first, tmp_path):
    folder, words, _ = first
    outcome = evalsuite(*words[:-1], tmp_path / "again", EVALSUITE_CACHE=str(tmp_path / "cache"))
    assert outcome.code == 0, outcome.err
    a = json.loads((folder / "out put" / "results.json").read_text(encoding="utf-8"))
    b = json.loads((tmp_path / "again" / "results.json").read_text(encoding="utf-8"))
    for x, y in zip(a["cells"], b["cells"], strict=True):
        assert x["metrics"] == y["metrics"]
        for name in x["images"]:
            one, other = (exr.read(d / c["images"][name]) for d, c in ((folder / "out put", x), (tmp_path / "again", y)))
            assert np.array_equal(one, other), name
    compared = evalsuite("compare", folder / "out put", tmp_path / "again")
    assert compared.code == 0 and "Of 4 cells in both runs: 4 unchanged." in compared.out


def test_parameter_binds_the_material_in_both_renderers(evalsuite, tmp_path):
    """-p exponent=… on a scene without a `subject`: every material the technique stands for, in both renderers alike."""
    (tmp_path / "s.xml").write_text(scene_xml(plugin="roughconductor", parameters='<float name="alpha" value="0.3"/>'))
    outcome = evalsuite(
        "run",
        "--scene",
        "s.xml",
        "-t",
        "glossy-mcguire",
        "-p",
        "exponent=20,200",
        "--target",
        "unoccluded",
        "--out",
        "o",
        "--json",
        cwd=tmp_path,
    )
    assert outcome.code == 0, outcome.err
    cells = json.loads(outcome.out)["cells"]
    assert [c["parameters"]["exponent"] for c in cells] == [20, 200]
    assert all(c["mapping"][0]["plugin"] == "blinnphong" for c in cells)
    # In a furnace the technique returns k_G·L = 1 whatever the exponent; the published BRDF's albedo depends on it.
    assert all(abs(c["mean_image"] - 1) < 1e-4 for c in cells)
    assert abs(cells[0]["mean_reference"] - cells[1]["mean_reference"]) > 0.02
    plain = evalsuite(
        "run", "--scene", "s.xml", "-t", "glossy-mcguire", "--target", "unoccluded", "--out", "p", "--json", cwd=tmp_path
    )
    assert json.loads(plain.out)["cells"][0]["mapping"][0]["plugin"] == "roughconductor"


def test_technique_that_cannot_stand_for_a_material_says_so(evalsuite, tmp_path):
    (tmp_path / "s.xml").write_text(scene_xml())
    outcome = evalsuite(
        "run",
        "--scene",
        "s.xml",
        "-t",
        "diffuse-sh9",
        "-t",
        "mirror-cube",
        "--target",
        "unoccluded",
        "--out",
        "o",
        "--json",
        cwd=tmp_path,
    )
    assert outcome.code == 0, outcome.err
    status = {c["technique"]: (c["status"], c["message"]) for c in json.loads(outcome.out)["cells"]}
    assert status["diffuse-sh9"][0] == "scored"
    assert status["mirror-cube"][0] == "skipped" and "diffuse" in status["mirror-cube"][1]


def test_dry_run_lists_and_renders_nothing(evalsuite, tmp_path):
    outcome = evalsuite("run", "--dry-run", "--json", cwd=tmp_path)
    assert outcome.code == 0
    assert len(json.loads(outcome.out)["cells"]) > 20 and list(tmp_path.iterdir()) == []


def test_dry_run_foretells_from_earlier_runs(evalsuite, tmp_path):
    """Without any, nothing; then what is left to make, in samples as the references are like, and nothing of what is there."""
    (tmp_path / "s.xml").write_text(scene_xml())
    words = ("run", "--scene", "s.xml", "-t", "diffuse-*", "--target", "unoccluded", "--no-ledger", "--out", "out")
    own = {"cwd": tmp_path, "EVALSUITE_CACHE": str(tmp_path / "cache")}
    first = json.loads(evalsuite(*words, "--dry-run", "--json", **own).out)
    assert first["forecast"] is None and not (tmp_path / "cache").exists()
    assert "not foretold" in evalsuite(*words, "--dry-run", **own).out
    done = evalsuite(*words, "--json", **own)
    assert done.code == 0, done.err
    cells = json.loads(done.out)["cells"]
    spp = {cell["reference_id"]: cell["cost"]["reference_spp"] for cell in cells}

    again = json.loads(evalsuite(*words, "--dry-run", "--json", **own).out)["forecast"]
    assert (again["cells"], again["made"], again["references"], again["samples"][0]) == (len(cells), 0, 0, 0)
    assert "in the store" in evalsuite(*words, "--dry-run", **own).out
    larger = json.loads(evalsuite(*words, "--size", "64x64", "--dry-run", "--json", **own).out)["forecast"]
    assert larger["made"] == len(cells) and larger["references"] == len(spp)
    value, low, high = larger["samples"]
    assert low < 64 * 64 * sum(spp.values()) < high and low < value < high
    value, low, high = larger["seconds"]
    # One run tells little of the next: the range is as wide as a factor of three.
    assert 1 < value and 0 < low < value < high and larger["bytes"][0] > 1e5
    assert json.loads(evalsuite(*words, "--no-cache", "--dry-run", "--json", **own).out)["forecast"]["made"] == len(cells)


def test_render_reference_compare(evalsuite, tmp_path):
    """The three single steps, chained by files."""
    (tmp_path / "s.xml").write_text(scene_xml())
    assert evalsuite("render", "s.xml", "-t", "diffuse-sh9", "-o", "a.exr", cwd=tmp_path).code == 0
    assert evalsuite("reference", "s.xml", "--target", "unoccluded", "-o", "b.exr", cwd=tmp_path).code == 0
    assert set(exr.read_parts(tmp_path / "b.exr")) == {"reference", "standard_error"}
    outcome = evalsuite("compare", "a.exr", "b.exr", "--json", "-o", "maps", cwd=tmp_path)
    assert outcome.code == 0, outcome.err
    metrics = json.loads(outcome.out)["metrics"]
    assert set(METRICS) <= set(metrics) and 0 < metrics["rel_rmse"]["value"] < 0.1
    assert exr.read(tmp_path / "maps" / "error.exr").shape == (40, 48, 3)


def test_reference_of_what_the_gpu_side_cannot_draw(evalsuite, tmp_path):
    """A dielectric lit by an area light alone is Mitsuba's business, and the error line of `run` sends the user there."""
    place = '<point name="center" x="0" y="3" z="0"/>'
    lamp = f'<shape type="sphere">{place}<emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>'
    (tmp_path / "s.xml").write_text(scene_xml(emitter="", plugin="dielectric", parameters="", extra=lamp))
    outcome = evalsuite("reference", "s.xml", "--target", "path", "--target-error", "0.2", "-o", "r.exr", cwd=tmp_path)
    assert outcome.code == 0, outcome.err
    assert exr.read(tmp_path / "r.exr").mean() > 1e-3
    refused = evalsuite("run", "--scene", "s.xml", "-t", "diffuse-sh9", "--out", "o", cwd=tmp_path)
    assert refused.code == 2 and "evalsuite reference" in refused.err


def test_an_object_out_of_view_costs_its_own_cell_only(evalsuite, tmp_path):
    (tmp_path / "seen.xml").write_text(scene_xml())
    (tmp_path / "unseen.xml").write_text(scene_xml().replace('target="0, 0, 0"', 'target="3, 2, 7"'))
    words = ("-t", "diffuse-sh9", "--target", "unoccluded", "--json")
    outcome = evalsuite("run", "--scene", "unseen.xml", "--scene", "seen.xml", *words, "--out", "o", cwd=tmp_path)
    assert outcome.code == 0, outcome.err
    status = {c["scene"]: (c["status"], c["message"]) for c in json.loads(outcome.out)["cells"]}
    assert status["seen"][0] == "scored" and status["unseen"][0] == "failed" and "in view" in status["unseen"][1]
    alone = evalsuite("run", "--scene", "unseen.xml", *words, "--out", "p", cwd=tmp_path)
    assert alone.code == 2


def test_missing_only_keeps_what_the_same_command_made(evalsuite, tmp_path):
    (tmp_path / "s.xml").write_text(scene_xml())
    words = ("run", "--scene", "s.xml", "--target", "unoccluded", "--out", "o", "--json", "--missing-only")

    def cells(*more):
        outcome = evalsuite(*words, *more, cwd=tmp_path)
        assert outcome.code == 0, outcome.err
        return {c["technique"]: c for c in json.loads(outcome.out)["cells"]}

    first = cells("-t", "diffuse-sh9")
    second = cells("-t", "diffuse-sh9", "-t", "diffuse-topmip")
    assert set(second) == {"diffuse-sh9", "diffuse-topmip"}
    # Its cost too: nothing was made again. Only whether it is decided depends on who stands beside it.
    beside = {"decided": second["diffuse-sh9"]["decided"]}
    assert second["diffuse-sh9"] == first["diffuse-sh9"] | beside
    finer = cells("-t", "diffuse-sh9", "--target-error", "0.01")
    assert finer["diffuse-sh9"]["target_error"] == 0.01 and finer["diffuse-sh9"]["reached_error"] <= 0.01


def test_a_scene_s_own_material_decides_what_is_prefiltered(evalsuite, tmp_path):
    """No default of a technique stands in for what the scene's own BSDF says."""
    exponent = '<float name="exponent" value="90"/>'
    (tmp_path / "own.xml").write_text(scene_xml(plugin="phong", parameters=exponent))
    (tmp_path / "bare.xml").write_text(scene_xml(plugin="phong", parameters=""))
    words = (
        "run",
        "--env",
        "cosine",
        "--target",
        "unoccluded",
        "--json",
        "-t",
        "glossy-phong-map",
        "-t",
        "glossy-hierarchical",
        "--scene",
    )
    own = json.loads(evalsuite(*words, "own.xml", "--out", "o", cwd=tmp_path).out)["cells"]
    given = json.loads(evalsuite(*words, "bare.xml", "-p", "exponent=90", "--out", "p", cwd=tmp_path).out)["cells"]
    assert [c["technique"] for c in own] == ["glossy-phong-map", "glossy-hierarchical"]
    for a, b in zip(own, given, strict=True):
        assert a["all_parameters"]["exponent"] == b["all_parameters"]["exponent"] == 90
        pictures = [exr.read(tmp_path / folder / c["images"]["image"]) for folder, c in (("o", a), ("p", b))]
        assert np.array_equal(*pictures)
