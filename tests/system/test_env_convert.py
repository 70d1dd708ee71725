"""`evalsuite env convert` as a user types it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evalsuite.image import exr

CHAIN = ("cube", "paraboloid", "sphere", "latlong")


def test_round_the_four_representations(evalsuite, tmp_path):
    file, mean = "sh2", None
    for to in CHAIN:
        out = tmp_path / f"{to}.exr"
        done = evalsuite("env", "convert", file, "-o", out, "--to", to, "--view", "0.2 0.1 1", "--json")
        assert done.code == 0, done.err
        facts = json.loads(done.out)
        assert facts["to"] == to and out.exists()
        assert max(map(abs, facts["energy_residual"])) < 1e-4
        if mean is not None:
            np.testing.assert_allclose(facts["mean_radiance_before"], mean, rtol=1e-6)
        file, mean = out, facts["mean_radiance_after"]
    first, last = exr.read("scenes/envmaps/sh2.exr"), exr.read(out)
    assert last.shape == first.shape
    # Four resamplings; the sphere map's rim, 1 % of the sphere, is what it cannot hold.
    error = np.abs(last / first - 1).max(-1)
    assert np.median(error) < 2e-3 and np.percentile(error, 97) < 0.02
    info = json.loads(evalsuite("env", "info", out, "--json").out)
    np.testing.assert_allclose(info["mean_radiance"], mean, rtol=1e-5)


def test_it_says_what_it_did(evalsuite, tmp_path):
    done = evalsuite("env", "convert", "office", "-o", tmp_path / "c.exr", "--to", "cube", "--size", "32")
    assert done.code == 0 and not done.err.strip()
    assert "cube, 192 × 32 texels, from latlong, 512 × 256" in done.out and "energy changed by" in done.out
    assert exr.read_header(tmp_path / "c.exr")["evalsuite_layout"] == "cube"


def test_a_map_without_a_header(evalsuite, tmp_path):
    exr.write(tmp_path / "ball.exr", np.ones((32, 32, 3), np.float32))
    done = evalsuite("env", "convert", tmp_path / "ball.exr", "-o", tmp_path / "x.exr", "--to", "latlong")
    assert done.code == 2 and "--from" in done.err and "ball.exr" in done.err
    done = evalsuite("env", "convert", tmp_path / "ball.exr", "-o", tmp_path / "x.exr", "--to", "latlong", "--from", "sphere")
    assert done.code == 0, done.err
    np.testing.assert_allclose(exr.read(tmp_path / "x.exr"), 1, rtol=1e-6)


def test_negative_texels_are_told(evalsuite, tmp_path):
    texels = np.ones((8, 16, 3), np.float32)
    texels[2, 3] = -1
    exr.write(tmp_path / "negative.exr", texels)
    done = evalsuite("env", "convert", tmp_path / "negative.exr", "-o", tmp_path / "x.exr", "--to", "cube")
    assert done.code == 0 and "1 texel with negative radiance" in done.err


@pytest.fixture(scope="module")
def folder(tmp_path_factory, evalsuite):
    folder = tmp_path_factory.mktemp("maps")
    texels = np.ones((8, 16, 3), np.float32)
    texels[1, 1, 1] = np.nan
    exr.write(folder / "nan.exr", texels)
    (folder / "junk.exr").write_bytes(b"\x00\xff" * 500)
    assert evalsuite("env", "convert", "furnace", "-o", folder / "cube.exr", "--to", "cube", "--size", "8").code == 0
    return folder


@pytest.mark.parametrize(("words", "named"), [
    (("missing.exr", "--to", "cube"), ("missing.exr", "no such file")),
    (("junk.exr", "--to", "cube"), ("junk.exr", "damaged")),
    (("nan.exr", "--to", "cube"), ("nan.exr", "--repair-env")),
    (("furnace", "--to", "cub"), ("--to", "did you mean 'cube'")),
    (("furnace", "--to", "cube", "--from", "ball"), ("--from", "latlong, cube, paraboloid, sphere")),
    (("furnace", "--to", "sphere", "--from", "cube"), ("six square faces",)),
    (("furnace", "--to", "cube", "--size", "99999"), ("--size", "4096")),
    (("furnace", "--to", "latlong", "--size", "63"), ("--size", "even")),
    (("furnace", "--to", "sphere", "--view", "0 0 0"), ("--view", "three numbers")),
    (("furnace", "--to", "cube", "-o", "x.png"), ("x.png", ".exr")),
    (("furnace",), ("--to",)),
])  # fmt: skip
def test_bad_input_is_one_clear_line(evalsuite, folder, words, named):
    output = () if "-o" in words else ("-o", "out.exr")
    done = evalsuite("env", "convert", *words, *output, cwd=folder)
    lines = [line for line in done.err.splitlines() if line.strip()]
    assert done.code == 2 and len(lines) == 1 and lines[0].startswith("error: "), (done.code, done.err)
    for name in named:
        assert name in lines[0]
    assert not (folder / "out.exr").exists()


def test_nan_can_be_repaired(evalsuite, folder):
    done = evalsuite("env", "convert", "nan.exr", "-o", "mended.exr", "--to", "cube", "--repair-env", cwd=folder)
    assert done.code == 0 and "NaN" in done.err and np.isfinite(exr.read(folder / "mended.exr")).all()


def test_another_representation_is_no_environment(evalsuite, folder):
    """It would light the scene from the wrong directions without a word."""
    done = evalsuite("env", "info", "cube.exr", cwd=folder)
    assert done.code == 2 and "a cube map" in done.err and "--to latlong" in done.err
