"""The pytest fixture `evalsuite_match`: an engine's own test suite holds its pictures against ground truth (docs/gate.md).

Nothing heavy is imported until a test asks for the fixture."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from evalsuite.api import Reference, SceneHandle
    from evalsuite.compare import Comparison

_ACCEPTED = pytest.StashKey[list]()


class EvalsuiteWarning(UserWarning):
    """Noise leaves open whether a picture keeps to what was asked of it."""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("evalsuite", "pictures against ground truth")
    group.addoption("--evalsuite-bless", action="store_true", help="accept the pictures of evalsuite_match as the baseline")
    group.addoption("--evalsuite-reason", metavar="TEXT", help="why; needed for pictures further from the truth")
    group.addoption("--evalsuite-strict", action="store_true", help="fail where noise leaves it open")
    parser.addini("evalsuite_baseline", "baseline file, from the root folder", default="evalsuite.baseline.json")


@pytest.fixture
def evalsuite_match(request: pytest.FixtureRequest) -> Callable[..., Comparison]:
    """match(image, truth, target="unoccluded", …) fails the test where the picture is beyond its bounds, or further from the
    truth than the blessed one. See `Match`."""
    return Match(request)


class Match:
    """What `evalsuite_match` gives a test."""

    def __init__(self, request: pytest.FixtureRequest) -> None:
        self.config, self.test = request.config, request.node.nodeid

    def __call__(
        self,
        image: ArrayLike,
        truth: str | Path | SceneHandle | Reference,
        target: str = "unoccluded",
        *,
        at_most: Mapping[str, float] | None = None,
        at_least: Mapping[str, float] | None = None,
        name: str = "",
        mask: ArrayLike | None = None,
        envmap: str | Path | None = None,
        target_error: float = 0.02,
        seed: int = 0,
        renderer: str = "",
        **parameters: Any,
    ) -> Comparison:
        """Hold a picture against the truth; returns the comparison (`.metrics["rel_rmse"].value`, `.ci95`).

        image: (H, W, 3) linear radiance. truth: a scene (name, Mitsuba XML file or `evalsuite.load_scene`'s), rendered at the
        picture's size with target, envmap, parameters, target_error and seed as in `evalsuite.reference`; or what that returned.
        at_most, at_least: bounds on metrics, a signed one by its amount. Without bounds, and wherever it was blessed
        (`--evalsuite-bless`), the picture must be no further from the truth than the blessed one. name: tells pictures of one
        test apart. renderer: the engine's and driver's name; another one allows for another driver. Raises EvalsuiteError for
        bad input."""
        import numpy as np

        import evalsuite
        from evalsuite.api import Reference
        from evalsuite.gate.engine import run_of
        from evalsuite.store.cache import package_versions

        picture = np.asarray(image, np.float32)
        if not isinstance(truth, Reference):
            if isinstance(truth, str | Path):
                truth = evalsuite.load_scene(truth, envmap=envmap, size=picture.shape[1::-1], **parameters)
            truth = evalsuite.reference(truth, target, target_error=target_error, seed=seed)
        inside = truth.mask if mask is None else np.asarray(mask) > 0.5
        comparison = evalsuite.compare(picture, truth, mask=inside)
        bounded = [self._bound(comparison, metric, bound, 1) for metric, bound in (at_most or {}).items()]
        bounded += [self._bound(comparison, metric, bound, -1) for metric, bound in (at_least or {}).items()]

        identity = f"{self.test}/{name or 'picture'}/{target}"
        cell = {"id": identity, "technique": "engine", "target": target, "seed": seed, "target_error": target_error}
        host = {"gl_renderer": renderer, "versions": package_versions("evalsuite", "mitsuba", "numpy", "flip-evaluator")}
        run = run_of({**cell, "all_parameters": parameters}, picture, truth.mean, truth.standard_error, inside, comparison, host)
        self._against_baseline(run, identity, bool(bounded))
        return comparison

    def _bound(self, comparison: Comparison, metric: str, bound: float, sign: int) -> None:
        from evalsuite.errors import unknown

        if metric not in comparison.metrics:
            raise unknown("metric", metric, list(comparison.metrics), "docs/results.md")
        found = comparison.metrics[metric]
        ends = found.ci95
        if sign > 0 and ends[0] < 0:  # of a signed metric the amount counts
            low, high = max(ends[0], -ends[1], 0.0), max(-ends[0], ends[1])
        else:
            low, high = sorted(sign * end for end in ends)
        asked = f"at {'most' if sign > 0 else 'least'} {bound:g}"
        text = f"{metric} is {found.value:.4g} [{ends[0]:.4g}, {ends[1]:.4g}], asked for was {asked}"
        if low > sign * bound:
            pytest.fail(text, pytrace=False)
        if high > sign * bound:
            self._open(f"{text}: noise leaves it open")

    def _against_baseline(self, run: Any, identity: str, bounded: bool) -> None:
        from evalsuite.gate import baseline as baselines
        from evalsuite.gate.bless import require_reason
        from evalsuite.gate.verdict import judge

        path, blessing = baseline_path(self.config), self.config.getoption("evalsuite_bless")
        old = baselines.read(path) if path.exists() else baselines.Baseline(path)
        if identity not in old.cells and bounded and not blessing:
            return
        [row] = judge(run, old, complete=False)
        if blessing:
            if row["verdict"] != "unchanged":
                require_reason([row], self.config.getoption("evalsuite_reason"))
                self.config.stash.setdefault(_ACCEPTED, []).append((run, row))
        elif row["verdict"] == "extra":
            pytest.fail(f"{identity}: no blessed picture in {path}; look at it, then run pytest --evalsuite-bless", pytrace=False)
        elif not row["passed"]:
            pytest.fail(f"{row['verdict']}: {row['reason']}\n{_details(row)}", pytrace=False)
        elif row["verdict"] == "inconclusive":
            self._open(row["reason"])

    def _open(self, text: str) -> None:
        if self.config.getoption("evalsuite_strict"):
            pytest.fail(text, pytrace=False)
        import warnings

        warnings.warn(text, EvalsuiteWarning, stacklevel=4)


def baseline_path(config: pytest.Config) -> Path:
    return config.rootpath / config.getini("evalsuite_baseline")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write what was accepted, at once: one `evalsuite bless --undo` takes it back."""
    accepted = session.config.stash.get(_ACCEPTED, [])
    if not accepted:
        return
    from filelock import FileLock

    from evalsuite.gate import baseline as baselines
    from evalsuite.gate import bless

    path = baseline_path(session.config)
    new, records = baselines.Baseline(path), {}
    new.folder.mkdir(parents=True, exist_ok=True)
    with FileLock(new.folder / ".lock"):  # pytest-xdist: each worker writes its own tests'
        old = baselines.read(path) if path.exists() else None
        new = old or new
        date = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        for run, row in accepted:
            new, record = bless.blessed(run, new, [row], session.config.getoption("evalsuite_reason"), date)
            records |= record
        bless.store(new, records, old)


def _details(row: Mapping) -> str:
    from evalsuite.gate.outlets import details

    return details(row)
