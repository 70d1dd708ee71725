"""Orders that noise could change: marked, and sampled until they are decided or the cap is reached."""

from __future__ import annotations

import json

import pytest
from small_scene import write_ball_under_a_lamp


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("decided")
    write_ball_under_a_lamp(folder)
    return folder


def results(evalsuite, scene, out, *words):
    done = evalsuite("run", "--scene", scene / "ball.xml", "--target", "unoccluded", "--out", scene / out, *words, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out), done


#: Two pictures that differ by little: nine harmonics of the whole map, and of its 8² level.
CLOSE = ("-t", "diffuse-sh9", "-p", "sh_face_size=full,8", "--target-error", "0.2", "--size", "32x32")


def test_a_close_pair_is_decided_after_more_samples(evalsuite, scene):
    before, _ = results(evalsuite, scene, "before", *CLOSE)
    (order,) = before["comparisons"]
    (pair,) = order["pairs"]
    assert not pair["decided"] and [cell["decided"] for cell in before["cells"]] == [False, False]
    page = (scene / "before" / "index.html").read_text(encoding="utf-8")
    assert page.count(">≈</abbr>") == 2
    after, _ = results(evalsuite, scene, "after", *CLOSE, "--until-decided", "--cap", "65536")
    (order,) = after["comparisons"]
    (pair,) = order["pairs"]
    assert pair["decided"] and [cell["decided"] for cell in after["cells"]] == [True, True]
    assert order["confidence"] == 0.975 and pair["difference"]["ci95"][0] > 0
    assert order["order"] == [pair["better"], pair["worse"]]
    for cell, first in zip(after["cells"], before["cells"], strict=True):
        assert cell["cost"]["reference_spp"] > first["cost"]["reference_spp"] and cell["seed"] == first["seed"] + 1
        assert any("fresh samples" in note for note in cell["notes"])
    # The command that a cell states makes the same cell again.
    words = after["cells"][0]["reproduce"].split()[2:]
    assert "--cap" in words and "--seed" in words
    again, _ = results(evalsuite, scene, "again", *(w for w in words if not w.endswith((".xml", "--scene"))))
    assert again["cells"][0]["metrics"] == after["cells"][0]["metrics"]


def test_others_are_left_alone(evalsuite, scene):
    words = (*CLOSE, "-t", "diffuse-topmip", "--size", "32x32")
    before, _ = results(evalsuite, scene, "wide", "-t", "diffuse-topmip", "-t", "diffuse-sh9", *words[4:])
    assert all(cell["decided"] for cell in before["cells"])
    after, _ = results(evalsuite, scene, "wide2", "-t", "diffuse-topmip", "-t", "diffuse-sh9", *words[4:], "--until-decided")
    assert [c["metrics"] for c in after["cells"]] == [c["metrics"] for c in before["cells"]]


def test_equal_pictures_need_no_samples_and_alike_ones_end_at_the_cap(evalsuite, scene):
    equal = ("-t", "diffuse-sh9", "-p", "sh_face_size=full,16", "-p", "face_size=16", "--target-error", "0.2", "--size", "32x32")
    found, _ = results(evalsuite, scene, "equal", *equal, "--until-decided")
    (pair,) = found["comparisons"][0]["pairs"]
    assert not pair["decided"] and pair["difference"] == {"value": 0.0, "ci95": [0.0, 0.0]}
    assert [cell["cost"]["reference_spp"] for cell in found["cells"]] == [128, 128]
    capped, _ = results(evalsuite, scene, "capped", *CLOSE, "--until-decided", "--cap", "256")
    assert [cell["decided"] for cell in capped["cells"]] == [False, False]
    assert all(cell["cost"]["reference_spp"] <= 256 for cell in capped["cells"])
    assert all(any("inconclusive at 256 spp" in note for note in cell["notes"]) for cell in capped["cells"])


def test_bad_cap(evalsuite, scene):
    done = evalsuite("run", "--scene", scene / "ball.xml", "--cap", "3", "--out", scene / "bad")
    assert done.code == 2 and "--cap 3" in done.err and "Traceback" not in done.err
