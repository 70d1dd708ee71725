"""`run --budget`: about so long, fresh samples where they decide most, and what is written of it."""

from __future__ import annotations

import json
import time

import pytest
from schema import validate
from small_scene import write_ball_under_a_lamp

#: Two pictures that differ by little, and one far from both.
WORDS = ("run", "--scene", "ball.xml", "-t", "diffuse-sh9", "-t", "diffuse-topmip", "-p", "sh_face_size=full,8",
         "--target", "unoccluded", "--size", "48x48")  # fmt: skip


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("budget")
    write_ball_under_a_lamp(folder)
    return folder


def test_it_takes_about_so_long_and_says_what_was_spent(evalsuite, scene):
    began = time.monotonic()
    done = evalsuite(*WORDS, "--budget", "40s", "--target-error", "0.0005", "--out", "out", "--json", cwd=scene,
                     EVALSUITE_CACHE=str(scene / "cache"))  # fmt: skip
    took = time.monotonic() - began
    assert done.code == 0, done.err
    results = json.loads(done.out)
    validate(results)
    assert took < 40 * 1.15 + 8, "and the program's own start"
    spent = results["budget"]
    assert spent["asked_s"] == results["run"]["budget_s"] == 40 and 5 < spent["taken_s"] <= took
    assert spent["pilot_error"] == 0.1 and spent["undecided_after"] <= spent["undecided_before"]
    (entry,) = spent["spent"]
    (order,) = results["comparisons"]
    assert entry["group"] == order["group"] and order["confidence"] == 0.975
    # Fresh samples: another seed, of a size that was settled before, and the command that makes them again.
    for cell in results["cells"]:
        assert cell["seed"] == 1 and cell["target_error"] == entry["error"] < 0.1
        assert cell["cost"]["reference_spp"] == entry["spp"] > 128
        assert any(note.startswith("budget: fresh samples") for note in cell["notes"])
        assert f"--target-error {entry['error']:g}" in cell["reproduce"] and "--seed 1" in cell["reproduce"]
    page = (scene / "out" / "index.html").read_text(encoding="utf-8")
    assert "of 40 s, 1 fresh reference; undecided pairs:" in page
    words = results["cells"][0]["reproduce"].split()[1:]
    again = evalsuite(*words, "--out", "again", "--json", cwd=scene, EVALSUITE_CACHE=str(scene / "cache"))
    assert json.loads(again.out)["cells"][0]["metrics"] == results["cells"][0]["metrics"]


def test_too_little_for_the_first_look_is_said_and_that_is_delivered(evalsuite, scene):
    done = evalsuite(*WORDS, "--budget", "1s", "--out", "little", "--json", cwd=scene)
    assert done.code == 0 and "nothing is left to spend" in done.err
    results = json.loads(done.out)
    validate(results)
    assert results["budget"]["spent"] == [] and all(cell["status"] == "scored" for cell in results["cells"])


@pytest.mark.parametrize(("words", "what"), [(("--budget", "soon"), "--budget soon"),
                                             (("--budget", "0m"), "--budget 0m"),
                                             (("--budget", "5m", "--until-decided"), "--until-decided")])  # fmt: skip
def test_what_makes_no_sense_is_refused(evalsuite, scene, words, what):
    done = evalsuite(*WORDS, *words, "--out", "bad", cwd=scene)
    assert done.code == 2 and what in done.err and "Traceback" not in done.err and not (scene / "bad").exists()


def test_foretold_at_a_finer_error_than_any_run_had(evalsuite, scene):
    """Of one reference alone the samples lie within the range that is told, not nearer."""
    own = {"cwd": scene, "EVALSUITE_CACHE": str(scene / "fine")}
    words = (*WORDS, "-t", "diffuse-*", "--no-ledger")
    assert evalsuite(*words, "--out", "coarse", "--json", **own).code == 0
    finer = (*words, "--target-error", "0.003", "--size", "56x40")
    foretold = json.loads(evalsuite(*finer, "--dry-run", "--json", **own).out)["forecast"]
    done = json.loads(evalsuite(*finer, "--out", "finer", "--json", **own).out)
    spp = {cell["reference_id"]: cell["cost"]["reference_spp"] for cell in done["cells"]}
    value, low, high = foretold["samples"]
    true = 56 * 40 * sum(spp.values())
    assert min(spp.values()) >= 8 * 64, "a rung up"
    assert low < true < high < 10 * value
