"""Pixels that differ in their samples: the same measure as Mitsuba's film, same bits however rendered, no bias, and how many."""

import hashlib
import math
import os
import subprocess
import sys
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from evalsuite import references
from evalsuite.errors import WorkerFailed
from evalsuite.pipeline import Settings, reproduce
from evalsuite.plan import Cell
from evalsuite.reference import adaptive, passes, render, worker
from evalsuite.reference.adaptive import Goal
from evalsuite.scene import builtin
from evalsuite.scene.model import SceneSource
from evalsuite.steps import Steps
from evalsuite.store.cache import Store
from tests.unit.reference.in_process import Here


def boxes():
    return SceneSource(builtin.scene_path("three-boxes"), builtin.environment_path("office"), (24, 20))


@pytest.fixture
def source():
    return boxes()


def mixed(shape=(20, 24)):
    """Counts of three sizes, in no order."""
    return np.random.default_rng(7).choice([4, 36, 64], shape).astype(np.int32)


@pytest.mark.parametrize("target", ["direct", "path", "unoccluded", "discs"])
def test_agrees_with_the_film(source, target):
    """Silhouettes and background too. Both sides' errors come from the scatter of 24 passes."""
    ours, theirs = (render.advance(source, target, passes.blank((24, 20), seed, spp, look=1), 24)
                    for seed, spp in ((3, mixed()), (4, 16)))  # fmt: skip
    sigma = np.hypot(ours.standard_error, theirs.standard_error).astype(np.float64)
    z = ((ours.mean.astype(np.float64) - theirs.mean) / sigma)[sigma > 1e-6].ravel()
    assert z.size > 600
    assert np.abs(z).max() < student.ppf(1 - 0.01 / (2 * z.size), 23)  # the smaller of the sides' degrees of freedom
    assert abs(z.mean()) < 4 / math.sqrt(z.size / 9)  # channels go together, and neighbours in part
    assert z.std() < 1.15


def test_more_samples_have_less_noise_where_they_are(source):
    counts = np.full((20, 24), 4, np.int32)
    counts[:, 12:] = 64
    few = render.advance(source, "direct", passes.blank((24, 20), 1, np.full_like(counts, 4), look=1), 16).standard_error
    some = render.advance(source, "direct", passes.blank((24, 20), 1, counts, look=1), 16).standard_error
    assert some[:, :12].mean() == pytest.approx(few[:, :12].mean(), rel=0.1)
    assert some[:, 12:].mean() < few[:, 12:].mean() / 3  # 1/4, or less for stratification


@pytest.mark.parametrize("threads", [1, 2])
def test_bits_do_not_depend_on_process_or_threads(source, threads):
    code = (
        "import sys, hashlib, numpy as np\nfrom tests.unit.reference.test_adaptive import *\n"
        "state = render.advance(boxes(), 'path', passes.blank((24, 20), 5, mixed(), look=2), 2)\n"
        "print(hashlib.sha256(state.even.tobytes() + state.odd.tobytes()).hexdigest())"
    )
    environment = os.environ | {"EVALSUITE_THREADS": str(threads), "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    state = render.advance(source, "path", passes.blank((24, 20), 5, mixed(), look=2), 2)
    assert done.stdout.strip() == hashlib.sha256(state.even.tobytes() + state.odd.tobytes()).hexdigest()


def test_no_look_shares_random_numbers_with_another(source):
    counts = np.full((20, 24), 16, np.int32)
    pictures = [render.advance(source, "direct", passes.blank((24, 20), 5, counts, look=look), 1).even for look in (1, 2)]
    pictures.append(render.advance(source, "direct", passes.blank((24, 20), 5, 16), 1).even)
    pictures.append(render.advance(source, "direct", passes.blank((24, 20), 6, counts, look=1), 1).even)
    for k, one in enumerate(pictures):
        for other in pictures[:k]:
            assert (one != other).mean() > 0.5


def finished(pool, source, plan, mask, partial):
    return references.sampled(pool, source, mask.shape[::-1], plan, mask, partial, lambda state, error: None)[0]


def test_reaches_its_goals_resumed_and_shared_out(source, tmp_path):
    plan = {"target": "direct", "target_error": 0.03, "cap": 1 << 15, "seed": 1, "worst_error": 0.1}
    mask = worker.gbuffer(source).coverage == 1
    one = finished(Here(), source, plan, mask, tmp_path / "a.npz")
    assert passes.relative_error(one, mask) <= 0.03 and adaptive.worst_error(one, mask) <= 0.1
    assert one.look >= 1 and one.passes >= one.planned >= passes.MIN_PASSES
    counts = adaptive.samples(one)
    assert counts[mask].max() > counts[mask].min() >= adaptive.LEAST * one.passes
    assert counts[~mask].max() == 4 * one.passes
    assert one.spp == round(float(counts.mean()))
    for killed_at in (1, 2, 3):
        partial = tmp_path / f"killed-{killed_at}.npz"
        with pytest.raises(WorkerFailed):
            finished(Here(mortal=killed_at), source, plan, mask, partial)
        again = finished(Here(width=3), source, plan, mask, partial)
        assert np.array_equal(again.even, one.even) and np.array_equal(again.squares, one.squares)
        assert np.array_equal(again.pass_spp, one.pass_spp) and again.passes == one.passes


class Lamps:
    """A renderer whose truth is known: radiance 1, and in each pixel a lamp that a sample finds with probability `found`, as
    `worker.passes` would answer. given_up: the states that planned the last one, and itself."""

    width = 1

    def __init__(self, shape, found, lamp):
        self.shape, self.found, self.lamp = shape, found, lamp

    @property
    def truth(self):
        return 1.0 + self.lamp * self.found

    def submit(self, function, source, target, pass_spp, numbers, seed, decomposition, look):
        counts = np.broadcast_to(pass_spp, self.shape)
        drawn = [np.random.default_rng([seed, number, look]).binomial(counts, self.found) for number in numbers]
        radiance = np.stack([1.0 + self.lamp * hits / counts for hits in drawn])[..., None].repeat(3, axis=-1)
        task = Future()
        task.set_result((radiance.astype(np.float32), 0.0, 0.0))
        return task


def test_no_bias_where_few_samples_find_much_and_the_naive_scheme_has_one(tmp_path):
    """400 runs on 16 × 16 pixels. A lamp of 100 that one sample in 500 finds: a first look misses it in 77 % of the pixels."""
    lamps, mask, runs = Lamps((16, 16), 1 / 500, 100.0), np.ones((16, 16), bool), 400
    ours, naive, reached = [], [], []
    for seed in range(runs):
        states = {}
        plan = {"target": "-", "target_error": 0.2, "cap": 1 << 16, "seed": seed, "worst_error": 0.15}
        partial = tmp_path / "partial.npz"
        state, _ = references.sampled(lamps, None, (16, 16), plan, mask, partial, lambda s, e: states.update({s.look: s}))  # noqa: B023
        partial.unlink()
        ours.append(state.mean[..., 0])
        reached.append(adaptive.worst_error(state, mask))
        samples = np.array([adaptive.samples(s) for s in states.values()])
        naive.append((samples * [s.mean[..., 0] for s in states.values()]).sum(0) / samples.sum(0))
    assert len(states) > 1

    def z(pictures):
        pictures = np.asarray(pictures, np.float64)
        return (pictures.mean(0) - lamps.truth) / (pictures.std(0, ddof=1) / math.sqrt(runs))

    assert abs(z(ours).sum()) < 3.3 * 16  # of 256 pixels: 99.9 %
    assert (z(ours) ** 2).mean() == pytest.approx(1.0, abs=3.3 * math.sqrt(2 / 256))
    assert np.abs(z(ours)).max() < 4.5
    assert z(naive).sum() < -4 * 16  # too little light
    scatter = np.std(ours, axis=0, ddof=1) / lamps.truth
    assert 0.05 < scatter.max() < 0.15
    assert np.median(reached) > scatter.max()  # the worst of 256 estimates is one of those too large


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_no_bias_beneath_a_small_sun(tmp_path):
    """With Mitsuba: 100 runs of a glossy sphere, 16 × 16 pixels, against one long uniform reference."""
    bindings = {"subject": {"type": "phong", "exponent": 50.0}}
    source = SceneSource(builtin.scene_path("sphere"), builtin.environment_path("sunsky"), (16, 16), bindings)
    mask, runs = worker.gbuffer(source).coverage == 1, 100
    plan = {"target": "direct", "target_error": 0.1, "cap": 1 << 14, "worst_error": 0.2}
    made = []
    for seed in range(runs):
        made.append(finished(Here(), source, plan | {"seed": seed}, mask, tmp_path / "partial.npz"))
        (tmp_path / "partial.npz").unlink()
    assert all(state.look >= 1 for state in made)
    truth = render.advance(source, "direct", render.fresh(source, 10_000, 1024), 64, 10_000)
    pictures = np.array([state.mean for state in made], np.float64)
    sigma = np.hypot(pictures.std(0, ddof=1) / math.sqrt(runs), truth.standard_error)
    z = ((pictures.mean(0) - truth.mean) / sigma)[mask].mean(axis=1)
    assert np.abs(z).max() < student.ppf(1 - 0.01 / (2 * z.size), 63)
    assert abs(z.mean()) < 3.3 / math.sqrt(z.size)
    # What references say of themselves is what they scatter.
    stated = np.mean([state.standard_error.astype(np.float64) ** 2 for state in made], axis=0)[mask].mean()
    assert pictures.var(0, ddof=1)[mask].mean() == pytest.approx(stated, rel=0.2)


def noisy(sigma, count=8, pass_spp=16, mean=2.0):
    """A state of constant mean whose passes scatter by `sigma` (H, W)."""
    sigma = np.broadcast_to(np.asarray(sigma, float)[..., None], (*np.shape(sigma), 3))
    total = np.full(sigma.shape, mean * count)
    squares = count * (mean**2 + sigma**2 * (count - 1) / count)
    return passes.RenderState(total / 2, total / 2, squares, np.zeros(sigma.shape), pass_spp, count, 0)


def test_worst_error_is_the_pixel_that_one_in_a_thousand_exceeds():
    small = np.full((16, 16), 0.1)
    small[4, 4] = 4.0  # its own, 40 times its neighbours'
    inside = np.ones((16, 16), bool)
    assert adaptive.worst_error(noisy(small), inside) == pytest.approx(4.0 / math.sqrt(8) / 2.0, rel=1e-4)
    inside[4, 4] = False
    assert adaptive.worst_error(noisy(small), inside) == pytest.approx(0.1 / math.sqrt(8) / 2.0, rel=1e-4)
    assert adaptive.worst_error(noisy(small), np.zeros((16, 16), bool)) == 0.0
    assert adaptive.worst_error(noisy(small, mean=0.0), inside) == 0.0
    large = np.full((64, 64), 0.1)
    large[8:40:16, 8:24:8] = 4.0  # 4 of 4096
    assert adaptive.worst_error(noisy(large), np.ones((64, 64), bool)) < 0.2  # of the neighbours, pooled
    large[8:40:8, 40] = 4.0  # 8
    assert adaptive.worst_error(noisy(large), np.ones((64, 64), bool)) > 0.7


def test_each_pixel_is_given_what_it_needs():
    sigma = np.full((16, 16), 0.1)
    sigma[:, 8:] = 0.4
    mask = np.ones((16, 16), bool)
    mask[:4] = False
    goal = Goal(0.02, 1.0, 1 << 16, mask)
    wanted = adaptive.needed(noisy(sigma), goal)
    # A sample's error is √16 · σ, relative to 2: (4 · 0.1 / 2 / (0.7 · 0.02))².
    assert wanted[10, 2] == pytest.approx((0.2 / 0.014) ** 2, rel=1e-4)
    assert wanted[10, 13] == pytest.approx((0.8 / 0.014) ** 2, rel=1e-4)
    assert not wanted[:4].any()
    counts, number = adaptive.shared(wanted, adaptive.PASSES, goal)
    total = counts * number
    assert (total >= wanted).all() and (total[10, 2] < 3 * wanted[10, 2]) and total[10, 13] < 3 * wanted[10, 13]
    assert (counts[:4] == 4).all() and set(np.unique(counts)) <= set(adaptive.COUNTS)


def test_the_mean_error_is_cared_for_too():
    rough = adaptive.needed(noisy(np.full((16, 16), 0.1)), Goal(0.9, 0.01, 1 << 16, np.ones((16, 16), bool)))
    # (4 · 0.1 / 2 / 0.01)², half of it.
    assert rough == pytest.approx(np.full((16, 16), 0.5 * 20.0**2), rel=1e-4)


def test_no_noise_seen_is_not_trusted():
    counts, number = adaptive.shared(np.zeros((8, 8)), adaptive.PASSES, Goal(0.1, 0.1, 4096, np.ones((8, 8), bool)))
    assert (counts == adaptive.LEAST).all() and number == adaptive.PASSES[0]


def test_the_cap_holds_on_average_and_the_highest_count_is_made_up_for_by_passes():
    wanted = np.full((8, 8), 1e3)
    wanted[0] = 1e6
    mask = np.ones((8, 8), bool)
    counts, number = adaptive.shared(wanted, adaptive.PASSES, Goal(0.1, 0.1, 1 << 30, mask))
    assert counts.max() == adaptive.COUNTS[-1] and (counts * number >= wanted).all()
    counts, number = adaptive.shared(wanted, adaptive.PASSES, Goal(0.1, 0.1, 2000, mask))
    assert number * counts.mean() <= 2000 and counts[0, 0] > 10 * counts[4, 4]
    for cap in (32, 80, 150):
        counts, number = adaptive.shared(wanted, adaptive.PASSES, Goal(0.1, 0.1, cap, mask))
        assert number * counts.mean() <= cap


def test_a_look_gives_itself_up_and_a_reference_does_not():
    mask = np.ones((16, 16), bool)
    goal = Goal(0.01, 0.1, 1 << 20, mask)
    look = noisy(np.full((16, 16), 0.5), passes.MIN_PASSES)
    assert adaptive.more(passes.blank((16, 16)), goal) == passes.MIN_PASSES and adaptive.more(look, goal) == 0
    nxt = adaptive.onward(look, goal)
    assert (nxt.look, nxt.passes, nxt.planned) == (1, 0, 0) and not nxt.even.any()  # far away: looks again
    last = adaptive.onward(look, Goal(0.1, 0.1, 1 << 20, mask))
    assert last.look == 1 and last.planned == adaptive.more(last, goal) >= adaptive.PASSES[0]
    assert adaptive.onward(last, goal) is last


def test_the_option_is_part_of_key_and_command_only_where_it_is_given(tmp_path):
    source = SceneSource(builtin.scene_path("sphere"), None, (24, 20))
    keys = {worst: Steps(Store(tmp_path), None, Settings(worst_error=worst)).reference_key(source, "direct", 0)
            for worst in (None, 0.1, 0.2)}  # fmt: skip
    assert len({key for key, _ in keys.values()}) == 3
    assert "worst_error" not in keys[None][1] and keys[0.1][1]["worst_error"] == 0.1
    cell = Cell("sphere", builtin.scene_path("sphere"), None, None, "diffuse-sh9")
    assert "--worst-error 0.1" in reproduce(cell, Settings(worst_error=0.1))
    assert "worst" not in reproduce(cell, Settings())
