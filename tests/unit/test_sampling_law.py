"""What a reference takes: followed up its rungs as the renderer goes, and told from references whose law is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evalsuite import sampling_law
from evalsuite.reference import render
from evalsuite.sampling_law import Effort, Law, effort, errors_of

LIKE = {"scene": "s", "environment": "e", "target": "t", "bsdf": "b"}
START, STEP, RATE = 0.4, 0.02, 3e-7
FEW = Effort(128, 128, 8, 1)


def state(error, passes, rung, size):
    """A reference of radiance 1 whose relative standard error is `error`: half of its passes lie as much above as below."""
    half = error * math.sqrt(passes - 1)
    sums = np.full((size, size, 3), passes / 2)
    squares = np.full((size, size, 3), passes * (1 + half**2))
    return render.RenderState(sums, sums, squares, squares, rung, passes, 0)


def renderer(errors, goal, cap, size):
    """What `reference.worker.sample` does, of a picture whose passes have these errors."""
    rung, passes, drawn, all_passes, rungs = 16, 0, 0, 0, 1
    while True:
        more = (
            render.plan(state(errors[rung] / math.sqrt(max(passes, 2)), max(passes, 2), rung, size), goal, cap) if passes else 8
        )
        more = min(more, max(cap // rung, 2) - passes, 16)
        if more <= 0:
            return Effort(passes * rung, drawn, all_passes, rungs)
        passes, drawn, all_passes = passes + more, drawn + more * rung, all_passes + more
        if render.climbs(state(errors[rung] / math.sqrt(passes), passes, rung, size), goal, cap):
            rung, passes, rungs = 4 * rung, 0, rungs + 1


@pytest.mark.parametrize("q", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("goal", [0.2, 0.03, 0.01, 0.004, 0.001])
@pytest.mark.parametrize("cap", [64, 1000, 1 << 15])
def test_it_goes_as_the_renderer_goes(q, goal, cap):
    errors = {rung: 0.15 * (16 / rung) ** q for rung in render.RUNGS}
    found, true = effort(errors, q, goal, cap, 16), renderer(errors, goal, cap, 4)
    assert found.rungs == true.rungs
    assert found.spp == pytest.approx(true.spp, abs=2 * 1024 if true.rungs == 4 else 2 * 16 * 4 ** (true.rungs - 1))
    assert found.drawn - found.spp == true.drawn - true.spp and found.passes == pytest.approx(true.passes, abs=2)


def reference(errors, pixels=4096, error=0.02, q=0.7, **other):
    took = effort(errors, q, error, 1 << 15, pixels)
    rungs = dict(list(sampling_law._on_all(errors, q).items()))
    known = {str(rung): rungs[rung] for rung in render.RUNGS[: took.rungs]}
    seconds = START * took.rungs + STEP * took.passes + RATE * took.drawn * pixels
    return {"kind": "reference", **LIKE, **other, "pixels": pixels, "spp": took.spp, "reached_error": error,
            "seconds": seconds, "pass_errors": known}  # fmt: skip


def test_samples_of_a_finer_error_follow_from_the_rungs_that_are_known():
    easy, hard = {16: 0.05}, {16: 0.4}
    law = Law.of([reference(easy), reference(hard, bsdf="hard")])
    # The hard one has climbed twice at 2 %, and knows its own exponent.
    assert law.effort(errors_of(law.rows[1]), 4096, 0.005, 1 << 15) == effort(hard, 0.7, 0.005, 1 << 15, 4096)
    spp, _ = law.reference(LIKE | {"bsdf": "hard"}, 16384, 0.005, 1 << 15)
    assert spp == effort(hard, 0.7, 0.005, 1 << 15, 16384).spp
    # The easy one has not: the law's exponent, between what is granted and what the hard one shows.
    assert sampling_law.GRANTED_Q < law.q < 0.7
    assert law.reference(LIKE, 4096, 0.005, 1 << 15)[0] == effort(easy, law.q, 0.005, 1 << 15, 4096).spp
    assert law.reference(LIKE, 4096, 0.001, 1 << 15, 1.0)[0] > law.reference(LIKE, 4096, 0.001, 1 << 15)[0]
    assert law.reference(LIKE, 4096, 0.001, 4096)[0] <= 4096, "the cap"


def test_the_most_alike_count():
    known = [reference({16: 0.3}), reference({16: 0.6}, bsdf="other"), reference({16: 0.9}, scene="other")]
    law = Law.of(known)

    def spp(**other):
        return law.reference(LIKE | other, 4096, 0.01, 1 << 20)[0]

    assert spp() < spp(bsdf="new") < spp(bsdf="other") < spp(scene="other") and spp(scene="new", target="new") == spp(
        bsdf="other"
    )
    # Of one and the same, what it took at the finer error tells more.
    finer = Law.of([reference({16: 0.3}, error=1.0), reference({16: 0.3}, q=0.9)])
    assert finer.reference(LIKE, 4096, 0.01, 1 << 20)[0] == effort({16: 0.3}, 0.9, 0.01, 1 << 20, 4096).spp
    assert Law.of([]).reference(LIKE, 100, 0.01, 4096)[0] == FEW.spp


def test_a_reference_of_the_fewest_samples_says_nothing_of_coarser_ones():
    assert effort({16: 0.001}, 0.7, 0.05, 4096, 4096) == FEW == effort({16: 0.0}, 0.7, 1e-6, 4096, 4096)


def test_seconds_are_a_kernel_passes_and_samples():
    """Little pictures take what their kernels and passes take, whatever their samples."""
    rows = [
        reference({16: e}, pixels, goal) for e in (0.05, 0.2, 0.5) for goal in (0.02, 0.01) for pixels in (1024, 65536, 262144)
    ]
    law = Law.of(10 * rows)
    for row in rows:
        one = effort(errors_of(row), 0.7, row["reached_error"], 1 << 15, row["pixels"])
        assert law.seconds(one, LIKE, row["pixels"]) == pytest.approx(row["seconds"], rel=0.15)
    assert law.seconds(FEW, LIKE, 1024) == pytest.approx(START + 8 * STEP + 128 * 1024 * RATE, rel=0.25)
    slow = [row | {"target": "path", "scene": "p", "seconds": 5 * row["seconds"]} for row in rows]
    both = Law.of(10 * [*rows, *slow])
    path = both.seconds(Effort(8192, 10880, 48, 3), LIKE | {"target": "path", "scene": "new"}, 65536)
    assert path > 3 * both.seconds(Effort(8192, 10880, 48, 3), LIKE, 65536)


@pytest.mark.parametrize("pass_errors", [None, {}, [1], {"17": 0.1}, {"16": "much"}, {"16": -1.0}, {"16": math.nan}])
def test_facts_that_do_not_say_their_rungs_tell_it_by_their_samples(pass_errors):
    assert errors_of({"spp": 512, "reached_error": 0.01, "pass_errors": pass_errors}) == {64: pytest.approx(0.01 * math.sqrt(8))}
    assert errors_of({"spp": 160, "reached_error": 0.01}) == {16: pytest.approx(0.01 * math.sqrt(10))}
