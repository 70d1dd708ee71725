"""The pytest fixture, in a suite of an engine that has one picture: pytester runs it as its developers would."""

from __future__ import annotations

import tomllib
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

import pytest
import synthetic  # noqa: F401  NumPy loads once a process: before pytester, which forgets what its runs import

import evalsuite.api
import evalsuite.gate.bless  # noqa: F401

pytest_plugins = ["pytester"]
HERE = Path(__file__).resolve().parent

#: Truth with noise of another seed each time that the engine is changed; error: how far its picture is off.
ENGINE = """
import sys
sys.path.insert(0, {helpers!r})
import numpy as np
import two_runs as two
import evalsuite

def truth(seed):
    mean, sigma = (part.astype(np.float32) for part in two.reference(seed, {noise}))
    spread = ({noise} * two.truth() * np.random.default_rng(seed + 100).standard_normal(mean.shape)).astype(np.float32)
    from evalsuite.api import Reference
    return Reference(mean, sigma, (mean + spread, mean - spread), 0 * mean, two.mask(), 64, 0.02, False)

def test_sphere(evalsuite_match):
    result = evalsuite_match(two.picture({error}), truth({seed}), "direct"{more})
    assert result.metrics["rel_rmse"].value > 0
"""


@pytest.fixture
def engine(pytester):
    """engine(error=…) → outcome of its suite."""

    installed = "evalsuite" in {one.name for one in entry_points(group="pytest11")}
    plugin = [] if installed else ["-p", "evalsuite.pytest_plugin"]

    def call(*words: str, error: float = 0.05, seed: int = 0, noise: float = 0.02, more: str = ""):
        text = ENGINE.format(helpers=str(HERE.parent / "report"), error=error, seed=seed, noise=noise, more=more)
        pytester.path.joinpath("test_engine.py").write_text(text)
        return pytester.runpytest_inprocess(*plugin, "-p", "no:cacheprovider", *words)

    return call


def said(outcome) -> str:
    return outcome.stdout.str()


def test_entry_point_names_the_plugin():
    project = tomllib.loads((HERE.parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    module = import_module(project["entry-points"]["pytest11"]["evalsuite"])
    assert callable(module.pytest_addoption) and module.evalsuite_match


def test_baseline(engine, pytester):
    first = engine()
    first.assert_outcomes(failed=1)
    assert "no blessed picture" in said(first) and "--evalsuite-bless" in said(first)
    engine("--evalsuite-bless").assert_outcomes(passed=1)
    assert (pytester.path / "evalsuite.baseline.json").exists()
    engine().assert_outcomes(passed=1)
    engine("--evalsuite-strict", seed=7).assert_outcomes(passed=1)
    worse = engine(error=0.1, seed=7)
    worse.assert_outcomes(failed=1)
    assert "further from the truth" in said(worse) and "rel_rmse: 0.0" in said(worse)
    engine(error=0.02, seed=7).assert_outcomes(passed=1)
    refused = engine("--evalsuite-bless", error=0.1)
    refused.assert_outcomes(failed=1)
    assert "without a reason" in said(refused)
    engine("--evalsuite-bless", "--evalsuite-reason", "softer", error=0.1).assert_outcomes(passed=1)
    engine(error=0.1).assert_outcomes(passed=1)
    assert "softer" in (pytester.path / "evalsuite.baseline.json").read_text()


def test_baseline_of_the_projects_choice(engine, pytester):
    pytester.makeini("[pytest]\nevalsuite_baseline = golden/engine.json")
    engine("--evalsuite-bless").assert_outcomes(passed=1)
    assert (pytester.path / "golden" / "engine.json").exists()
    (pytester.path / "golden" / "engine.json").write_text("{")
    damaged = engine()
    damaged.assert_outcomes(failed=1)
    assert "does not read" in said(damaged)


@pytest.mark.parametrize(("bounds", "outcome"), [
    ("at_most={'rel_rmse': 0.06}", "passed"),
    ("at_most={'rel_rmse': 0.04}", "failed"),
    ("at_least={'psnr': 10}", "passed"),
    ("at_least={'psnr': 90}", "failed"),
    ("at_most={'rel_bias': 0.05}, mask=np.indices((48, 48))[1] < 24", "passed"),
    ("at_most={'rel_bias': 0.02}, mask=np.indices((48, 48))[1] < 24", "failed"),
    ("at_most={'rel_bias': 0.02}, mask=np.indices((48, 48))[1] >= 24", "failed"),
    ("at_most={'rmes': 1}", "failed"),
])  # fmt: skip
def test_bounds_need_no_baseline(engine, bounds, outcome):
    error = 0.04 if "rel_bias': 0.05" in bounds else 0.05
    engine(more=f", {bounds}", error=error).assert_outcomes(**{outcome: 1})


def test_bound_within_noise_warns_and_fails_when_strict(engine):
    noisy = {"noise": 0.4, "more": ", at_most={'rel_rmse': 0.05}"}
    open_ = engine(**noisy)
    open_.assert_outcomes(passed=1)
    assert "noise leaves it open" in said(open_)
    engine("--evalsuite-strict", **noisy).assert_outcomes(failed=1)


def test_names_tell_pictures_apart(engine):
    engine("--evalsuite-bless", more=", name='left'").assert_outcomes(passed=1)
    engine(more=", name='right'").assert_outcomes(failed=1)
    engine(more=", name='left'").assert_outcomes(passed=1)
