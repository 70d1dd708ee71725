"""Do the 95 % intervals hold the truth 95 % of the time, with Mitsuba's own noise?

Each cell's picture is fixed and set against 200 independent references of few samples, made as a run makes them (passes, rungs,
stop at a relative error, pooled variances, halves), and against one of a hundred thousand samples, whose value the intervals have
to hold. The measured shares go to reports/build/intervals.md; docs/intervals.md has them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from evalsuite import references
from evalsuite.compare import compare
from evalsuite.compare.comparison import debiased_metrics, noisy_picture, noisy_reference
from evalsuite.compare.decide import difference
from evalsuite.compare.mask import whole_pixels
from evalsuite.reference import passes, render, variants, worker
from tests.unit.reference.in_process import Here

DEBIASED = ("mse", "rmse", "relmse", "rel_rmse", "bias", "rel_bias", "difference")
#: They grow with noise by their nature: their intervals reach to the noise-free value, and may promise too little.
OTHERS = ("psnr", "mae", "smape", "ssim", "flip", "flip_hdr", "delta_e2000", "max_abs", "p99_abs")
SIZE, REPETITIONS = 48, 200
TABLE = Path(__file__).parents[3] / "reports" / "build" / "intervals.md"


@dataclass(frozen=True)
class Case:
    """rival: the other technique of the paired difference. error: relative standard error at which sampling stops. worst: of the
    worst pixel, where samples are adaptive."""

    scene: str
    environment: str
    technique: str
    rival: str
    target: str
    error: float
    parameters: dict = field(default_factory=dict)
    worst: float | None = None

    def __str__(self) -> str:
        adaptive = "" if self.worst is None else "-adaptive"
        return f"{self.scene}-{self.environment}-{self.technique}-{self.target}{adaptive}"


CASES = (
    Case("sphere", "office", "diffuse-sh9", "diffuse-map", "unoccluded", 0.04),
    Case("sphere", "office", "diffuse-map", "diffuse-sh9", "unoccluded", 0.04),  # hardly any error
    Case("torus", "cathedral", "diffuse-sh9", "diffuse-map", "direct", 0.04),
    Case("torus", "sunsky", "diffuse-sh9", "diffuse-topmip", "direct", 0.02),
    Case("sphere", "office", "glossy-phong-map", "glossy-boxmip", "unoccluded", 0.04, {"exponent": 10}),
    Case("torus", "cathedral", "glossy-boxmip", "glossy-phong-map", "direct", 0.04, {"exponent": 10}),
    Case("sphere", "sunsky", "glossy-boxmip", "glossy-phong-map", "direct", 0.02, {"exponent": 50}),
    pytest.param(
        Case("sphere", "sunsky", "glossy-boxmip", "glossy-phong-map", "direct", 0.04, {"exponent": 50}, 0.4),
        marks=pytest.mark.xfail(reason="wider than need be: rel_rmse holds 98.5 % (docs/adaptive.md)", strict=False),
    ),
)


@pytest.fixture(scope="module")
def rows():
    """The lines of the table, written when all cases are through."""
    lines: list[str] = []
    yield lines
    if not lines:
        return
    names = (*DEBIASED, *OTHERS)
    head = ["| cell | error | spp | " + " | ".join(names) + " |", "|---" * (len(names) + 3) + "|"]
    TABLE.parent.mkdir(parents=True, exist_ok=True)
    TABLE.write_text("\n".join(head + lines) + "\n", encoding="utf-8")
    print(TABLE.read_text(encoding="utf-8"))


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_intervals_hold_the_high_sample_value(case, rows, tmp_path, monkeypatch):
    """The share of a true 95 % interval has a standard deviation of 1.5 % over 200 repetitions."""
    monkeypatch.setenv("EVALSUITE_CACHE", str(tmp_path / "cache"))
    from evalsuite import api

    handle = api.load_scene(case.scene, envmap=case.environment, size=(SIZE, SIZE))
    image, rival = (api.render(handle, technique, **case.parameters).astype(float) for technique in (case.technique, case.rival))
    source = handle.bound
    variants.activate()
    mask = whole_pixels(worker.gbuffer(source).coverage)
    assert mask.sum() > 500 and not np.array_equal(image, rival)

    def metrics(mean, sigma, halves, skew):
        truth = noisy_reference(mean.astype(float), sigma, halves, [], skew)[mask]
        found = compare(image, mean, sigma, halves, mask, skew=skew).metrics
        found = {k: m for k, m in found.items() if not k.endswith("_full")}
        pictures = [noisy_picture(p, None, seed=1)[mask] for p in (image, rival)]
        return found | debiased_metrics(pictures[0], truth) | {"difference": difference(*pictures, truth)}

    def low(seed):
        partial = tmp_path / "partial.npz"
        plan = {"target": case.target, "target_error": case.error, "cap": 4096, "seed": seed}
        plan |= {} if case.worst is None else {"worst_error": case.worst}
        state, _ = references.sampled(Here(), source, mask.shape[::-1], plan, mask, partial, lambda state, error: None)
        partial.unlink(missing_ok=True)
        return state

    state = render.advance(source, case.target, render.fresh(source, 10_000, 1024), 100, 10_000)
    exact = metrics(state.mean, passes.standard_error(state, mask), state.halves, state.skew)
    hits, samples = Counter(), []
    for seed in range(REPETITIONS):
        state = low(seed)
        samples.append(state.spp)
        for name, metric in metrics(state.mean, passes.standard_error(state, mask), state.halves, state.skew).items():
            lo, hi = metric.ci95
            hits[name] += lo <= exact[name].value <= hi
    shares = {name: hits[name] / REPETITIONS for name in (*DEBIASED, *OTHERS)}
    cell = f"{case.scene}, {case.environment}, {case.technique}, {case.target}"
    cell += "" if case.worst is None else f", worst pixel {case.worst:.0%}"
    spp = f"{min(samples)}–{max(samples)}" if min(samples) < max(samples) else str(min(samples))
    rows.append(f"| {cell} | {case.error:.0%} | {spp} | " + " | ".join(f"{s:.1%}" for s in shares.values()) + " |")
    for name in DEBIASED:
        assert 0.90 <= shares[name] <= 0.98, (name, shares)
    for name in OTHERS:
        assert shares[name] >= 0.90, (name, shares)
