"""Passes: same bits however they are split, honest standard errors, and when to stop."""

import subprocess
import sys
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import OpenEXR
import pytest
from scipy.stats import kstat

from evalsuite import references
from evalsuite.errors import EvalsuiteError, WorkerFailed
from evalsuite.reference import passes, render, worker
from evalsuite.scene.model import SceneSource
from tests.unit.reference.in_process import Here


@pytest.fixture
def source(tmp_path):
    texels = np.random.default_rng(3).random((9, 16, 3), dtype=np.float32) ** 4
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": texels}) as file:
        file.write(str(tmp_path / "map.exr"))
    (tmp_path / "scene.xml").write_text("""<scene version="3.0.0">
      <sensor type="perspective"><float name="fov" value="30"/>
        <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/></film></sensor>
      <shape type="sphere"><bsdf type="phong" id="subject"><float name="exponent" value="10"/></bsdf></shape>
      <emitter type="envmap"><string name="filename" value="map.exr"/></emitter></scene>""")
    return SceneSource(tmp_path / "scene.xml")


def same(a, b):
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("even", "odd", "squares")) and a.passes == b.passes


def test_resumed_is_identical(source):
    whole = render.advance(source, "direct", None, 4, seed=5)
    assert same(render.advance(source, "direct", render.advance(source, "direct", None, 2, seed=5), 2), whole)
    assert same(render.advance(source, "direct", render.advance(source, "direct", None, 1, seed=5), 3), whole)
    assert not np.array_equal(render.advance(source, "direct", None, 4, seed=6).mean, whole.mean)
    assert whole.spp == 4 * whole.pass_spp and whole.seconds > 0
    first, second = whole.halves
    np.testing.assert_allclose((first.astype(float) + second) / 2, whole.mean, rtol=1e-6)
    assert not np.array_equal(first, second)


@pytest.mark.parametrize("threads", [1, 2])
def test_bits_do_not_depend_on_process_or_threads(source, threads):
    code = (
        "import sys, hashlib\nfrom pathlib import Path\nfrom evalsuite.reference import render\n"
        "from evalsuite.scene.model import SceneSource\n"
        "state = render.advance(SceneSource(Path(sys.argv[1])), 'path', None, 3)\n"
        "print(hashlib.sha256(state.mean.tobytes() + state.standard_error.tobytes()).hexdigest())"
    )
    import hashlib
    import os

    environment = os.environ | {"EVALSUITE_THREADS": str(threads)}
    command = [sys.executable, "-c", code, str(source.path)]
    theirs = subprocess.run(command, capture_output=True, text=True, env=environment, check=True).stdout.strip()
    state = render.advance(source, "path", None, 3)
    assert theirs == hashlib.sha256(state.mean.tobytes() + state.standard_error.tobytes()).hexdigest()


def test_standard_error_is_the_scatter_over_seeds(source):
    mask = worker.gbuffer(source).coverage == 1
    states = [render.advance(source, "unoccluded", None, 8, seed) for seed in range(24)]
    scatter = np.var([s.mean for s in states], axis=0, ddof=1)[mask].astype(float)
    stated = np.mean([s.standard_error.astype(float) ** 2 for s in states], axis=0)[mask]
    assert mask.sum() > 100 and scatter.min() > 0
    # Mean over pixels of a variance from 24 seeds: 1/√(pixels·23/2) of it, widened by pixels of unequal variance.
    assert scatter.mean() / stated.mean() == pytest.approx(1.0, abs=0.08)
    # Against the seeds' common mean: unit variance.
    common = np.mean([s.mean.astype(float) for s in states], axis=0)
    z = np.array([(s.mean - common) / np.maximum(s.standard_error, 1e-12) for s in states])[:, mask]
    # Student's t with 7 degrees of freedom has variance 7/5; the common mean takes 1/24 of it.
    assert z.var() == pytest.approx(7 / 5 * 23 / 24, rel=0.1)
    # The two halves are as far apart as the standard error says.
    difference = np.array([(s.halves[0] - s.halves[1]) for s in states])[:, mask].astype(float)
    assert (difference**2).mean() == pytest.approx(4 * stated.mean(), rel=0.1)


def test_standard_error_shrinks_as_passes_grow(source):
    few = render.advance(source, "unoccluded", None, 16)
    many = render.advance(source, "unoccluded", few, 48)
    assert passes.relative_error(few) / passes.relative_error(many) == pytest.approx(2.0, rel=0.15)


def test_one_pass_has_no_error_and_no_halves(source):
    state = render.advance(source, "direct", None, 1)
    assert np.isinf(state.standard_error).all()
    with pytest.raises(EvalsuiteError, match="two"):
        _ = state.halves


def test_skew_is_the_third_k_statistic_of_the_mean():
    drawn = np.random.default_rng(0).gamma(2.0, size=(8, 4, 4, 3))
    sums = (drawn[::2].sum(0), drawn[1::2].sum(0), np.square(drawn).sum(0), (drawn**3).sum(0))
    state = passes.RenderState(*sums, 64, 8, 0)
    np.testing.assert_allclose(state.skew.astype(float) ** 3, kstat(drawn, 3, axis=0) / 8**2, rtol=1e-5, atol=1e-9)
    assert not passes.RenderState(*sums, 64, 2, 0).skew.any()


def fake(count, error, mean=2.0, pass_spp=64):
    """A state of constant mean whose standard error is `error`."""
    shape = (4, 4, 3)
    total = np.full(shape, mean * count)
    spread = error**2 * count * (count - 1) / count
    squares = np.full(shape, count * (mean**2 + spread))
    return passes.RenderState(total / 2, total / 2, squares, np.zeros(shape), pass_spp, count, 0)


def test_relative_error_and_mask():
    state = fake(16, 0.1)
    assert passes.relative_error(state) == pytest.approx(0.05)
    state.even[0], state.odd[0] = 0, 0  # black, and noisier
    mask = np.ones((4, 4), bool)
    mask[0] = False
    assert passes.relative_error(state, mask) == pytest.approx(0.05)
    assert passes.relative_error(state) > 0.05  # fewer bright pixels in the mean
    assert passes.relative_error(state, np.zeros((4, 4), bool)) == 0.0
    assert passes.relative_error(fake(16, 0.0, mean=0.0)) == 0.0


def test_plan():
    cap = 64 * 1000
    assert passes.plan(passes.blank((4, 4)), 0.01, cap) == passes.LOOK  # whether to climb
    assert passes.plan(passes.blank((4, 4), 0, 1024), 0.01, cap) == passes.MIN_PASSES  # the top: nowhere to climb to
    assert passes.plan(passes.blank((4, 4), 0, 64), 0.01, 64 * 20) == passes.MIN_PASSES  # the cap allows no climbing
    assert passes.plan(fake(2, 1.0), 0.01, cap) == 6  # first look after eight
    assert passes.plan(fake(16, 0.01), 0.005, cap) == 0  # relative error is half of 0.01: reached
    assert passes.plan(fake(16, 0.012), 0.005, cap) == 8  # (0.006 / 0.005)² · 16 = 23.04 → 24
    assert passes.plan(fake(16, 1.0), 0.005, cap) == 16  # at most doubled
    assert passes.plan(fake(16, 1.0), 0.005, 64 * 20) == 4  # the cap
    assert passes.plan(fake(20, 1.0), 0.005, 64 * 20) == 0
    assert passes.plan(fake(16, 0.0, mean=0.0), 0.005, cap) == 0  # black


def test_climbs_to_stronger_stratification_when_it_pays():
    cap = 64 * 1000
    for count in (passes.LOOK, passes.MIN_PASSES):  # after the first look, and once more of a better known error
        look = fake(count, 0.2 / count**0.5, pass_spp=16)
        assert passes.rung(look, 0.017, cap) == 64  # (0.1 / 0.017)² = 35 passes at 16 spp, more than 8 at 64
        assert passes.rung(look, 0.018, cap) == 16  # 31
        assert passes.rung(fake(count + 2, 0.2 / count**0.5, pass_spp=16), 0.017, cap) == 16
        assert passes.rung(fake(count, 0.1, pass_spp=1024), 0.001, cap) == 1024  # the top
        assert passes.rung(look, 0.017, 64 * 7) == 16  # the cap would cut it short
    assert not passes.may_climb(256, 2**17 + 1, cap) and passes.may_climb(256, 2**17, cap)  # samples of one pass


def test_passes_over_rungs_on_which_it_would_not_stay():
    cap, many = 1 << 20, passes.CLIMB
    for times, rung in ((0.9, 16), (6.5, 64), (6.7, 256), (37, 256), (38, 1024), (1e9, 1024)):
        assert passes.rung_for(16, many * times, 4096, cap) == rung
    assert [passes.rung_for(64, many * times, 4096, cap) for times in (0.9, 5.6, 5.8)] == [64, 256, 1024]
    assert passes.rung_for(16, many * 1e9, 4096, 256 * 8) == 256, "the cap"
    assert passes.rung_for(16, many * 1e9, passes.MAX_PASS_SAMPLES // 64, cap) == 64, "samples of one pass"


def test_nan_is_reported_not_swept(source, tmp_path):
    source.path.write_text(
        source.path.read_text().replace(
            '<bsdf type="phong" id="subject"><float name="exponent" value="10"/></bsdf>',
            '<bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
            '<string name="filename" value="nan.exr"/><boolean name="raw" value="true"/></texture></bsdf>',
        )
    )
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.full((4, 4, 3), np.nan, np.float32)}) as file:
        file.write(str(tmp_path / "nan.exr"))
    with pytest.raises(EvalsuiteError, match=r"scene\.xml.*NaN or Inf in \d+ pixels of `direct`, pass 0, the first in row"):
        render.advance(source, "direct", None, 1)


def finished(source, plan, mask, partial, pool):
    size = render.load_cached(source).scene.camera.size
    return references.sampled(pool, source, size, plan, mask, partial, lambda state, error: None)


def test_sampled_to_the_goal_resumed_and_shared_out(source, tmp_path, monkeypatch):
    plan = {"target": "unoccluded", "target_error": 0.005, "cap": 1 << 15, "seed": 1}
    mask = worker.gbuffer(source).coverage == 1
    one, error = finished(source, plan, mask, tmp_path / "a.npz", Here())
    assert error <= 0.005 and one.passes >= passes.MIN_PASSES and one.pass_spp > passes.RUNGS[0]
    for killed_at in (1, 2, 3):  # tasks that a run before had done
        with pytest.raises(WorkerFailed):
            finished(source, plan, mask, tmp_path / "b.npz", Here(mortal=killed_at))
        assert same(finished(source, plan, mask, tmp_path / "b.npz", Here())[0], one)
        (tmp_path / "b.npz").unlink()
    monkeypatch.setattr(references, "CHUNK_SAMPLES", 1)
    for width in (2, 3, 5, 1000):
        assert same(finished(source, plan, mask, tmp_path / f"{width}.npz", Here(width))[0], one)
    capped = {**plan, "target_error": 1e-6, "cap": 16 * 4}
    state, error = finished(source, capped, mask, tmp_path / "c.npz", Here())
    assert error > 1e-6 and state.passes == 4


def test_scenes_are_kept_until_their_file_changes(source):
    first = render.load_cached(source)
    assert render.load_cached(replace(source)) is first
    import os

    os.utime(source.path, ns=(1, 1))
    assert render.load_cached(source) is not first


def test_states_survive_pickling(source):
    import pickle

    state = render.advance(source, "direct", None, 2)
    assert same(pickle.loads(pickle.dumps(state)), state)
    assert pickle.loads(pickle.dumps(worker.load_model(source))).meshes[0].name


def test_pooled_standard_error_makes_z_normal(source):
    """Eight passes against many: with each pixel's own scatter z has Student's tails, pooled over neighbours it is normal."""
    mask = worker.gbuffer(source).coverage >= 1
    truth = render.advance(source, "unoccluded", render.fresh(source, 99, 256), 16, 99)
    state = render.advance(source, "unoccluded", render.fresh(source, 5, 16), passes.MIN_PASSES, 5)
    difference = (state.mean.astype(np.float64) - truth.mean)[mask]
    z, raw = (
        difference / np.hypot(error, truth.standard_error)[mask]
        for error in (passes.standard_error(state, mask), state.standard_error)
    )
    assert z.size > 500
    limit = NormalDist().inv_cdf(1 - (1 - 0.99 ** (1 / z.size)) / 2)  # Šidák at 1 %
    assert 0.85 < z.std() < 1.1 and np.abs(z).max() < limit
    assert np.abs(raw).max() > np.abs(z).max() and raw.std() > 1.05
    # Pooling moves variance between neighbours; it does not make it more or less.
    own, pooled = ((e.astype(np.float64)[mask] ** 2).mean() for e in (state.standard_error, passes.standard_error(state, mask)))
    assert pooled == pytest.approx(own, rel=0.1)


def test_pooling_stays_on_its_side_and_spares_outliers():
    state = fake(8, 0.1)
    eights, zeros = np.full((12, 12, 3), 8.0), np.zeros((12, 12, 3))
    state = passes.RenderState(eights, eights, zeros, zeros, 64, 8, 0)
    state.squares[...] = 8 * (4.0 + 7 * 0.01)  # standard error 0.1 …
    state.squares[:, 6:] = 8 * 4.0  # … on the left, none on the right
    state.squares[5, 2] = 8 * (4.0 + 7 * 1.0)  # and one pixel of ten times the error
    mask = np.zeros((12, 12), bool)
    mask[:, :6] = True
    error = passes.standard_error(state, mask)
    assert error[5, 2] == pytest.approx(1.0, rel=1e-3)  # its own
    assert error[11, 5] == pytest.approx(0.1, rel=1e-3)  # not dragged down by the quiet side
    assert error[5, 8].max() < 1e-5  # nor the quiet side up
