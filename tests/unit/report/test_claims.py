"""Claims: each verdict rests on a number, and a planted change of a formula turns it."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.math import cubemap, hierarchical, paraboloid, sh
from evalsuite.report import claims
from evalsuite.report.claims import area_lights, harmonics, levels, maps
from evalsuite.report.claims.verdict import FAILS, HOLDS, LIMITS, UNTESTED, Finding
from evalsuite.report.figures import circle_distortion
from evalsuite.scene.builtin import environment_path


def test_no_verdict_without_a_number_or_a_reason():
    for verdict in (HOLDS, LIMITS, FAILS):
        with pytest.raises(ValueError, match="number"):
            Finding(verdict, "words", "why")
    for verdict in (LIMITS, FAILS):
        with pytest.raises(ValueError, match="reason"):
            Finding(verdict, "words", numbers={"a": 1})
    with pytest.raises(ValueError, match="reason"):
        Finding(UNTESTED, "")


@pytest.mark.parametrize(
    ("measure", "verdict"),
    [
        (maps.cube, HOLDS),
        (maps.paraboloid_map, HOLDS),
        (maps.circle, LIMITS),
        (maps.radii, LIMITS),
        (maps.filter_sizes, HOLDS),
        (maps.shrink_factors, HOLDS),
        (harmonics.eight_texels, LIMITS),
    ],
)
def test_verdicts(measure, verdict):
    finding = measure()
    assert finding.verdict == verdict, finding
    assert finding.measured and finding.numbers and measure.__doc__


def test_planted_changes_turn_verdicts(monkeypatch):
    """A solid angle without its third power, a radius in another place, another cut-off, an off-by-one filter, a wrong basis."""

    def turned(measure, module, name, wrong, verdict):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, wrong)
            assert measure().verdict == verdict, measure

    exact, radius, size, basis = cubemap.texel_solid_angles, hierarchical.radius, hierarchical.filter_size, sh.project_cube
    turned(maps.cube, cubemap, "texel_solid_angles", lambda w: exact(w) ** (2 / 3), FAILS)
    whole = paraboloid.texel_solid_angles
    turned(maps.paraboloid_map, paraboloid, "texel_solid_angles", lambda n: np.sqrt(whole(n)), FAILS)
    turned(maps.radii, hierarchical, "radius", lambda which, n, c: radius(which, n, c) * (0.7 if which else 1.0), FAILS)
    turned(maps.filter_sizes, hierarchical, "radius", lambda which, n, c: radius(which, n, 0.2), FAILS)
    turned(maps.filter_sizes, hierarchical, "filter_size", lambda r, circle: size(r, circle) + 1, FAILS)
    turned(maps.shrink_factors, hierarchical, "shrink_level", lambda size, taps: int(np.log2(size / taps)), FAILS)
    line = circle_distortion.outline
    turned(maps.circle, circle_distortion, "outline", lambda r, place, points: line(r, place, points) - [20 * r, 0], FAILS)
    turned(harmonics.eight_texels, sh, "project_cube", lambda cube: basis(cube) * (1 + 1 / cube.shape[1]), FAILS)


def test_lights_are_larger_unless_they_are_not(monkeypatch):
    monkeypatch.setattr(area_lights, "REGIONS", 8)
    monkeypatch.setattr(area_lights, "HEIGHT", 128)
    finding = area_lights.larger()
    assert finding.verdict == HOLDS and 1.2 < finding.numbers["ci95"][0] < finding.numbers["ci95"][1] < 2.2
    whole = area_lights.decompose

    class Smaller:
        def __init__(self, found):
            self.lights = [type("Light", (), {"solid_angle": 0.5 * light.solid_angle}) for light in found.lights]

    monkeypatch.setattr(area_lights, "decompose", lambda radiance: Smaller(whole(radiance)))
    assert area_lights.larger().verdict == FAILS


def test_maps_that_are_not_there_are_not_judged():
    assert area_lights.counts({}).verdict == UNTESTED
    given = area_lights.counts({"grace": environment_path("furnace")})
    assert given.verdict == FAILS and given.numbers == {"lights": {"grace": 0}, "stated": {"grace": 10}}


def test_the_bias_is_within_its_interval():
    finding = levels.bias_for_phong()
    low, high = finding.numbers["ci95"]
    assert (finding.verdict == HOLDS) == (low <= 2.25 <= high) and low < finding.numbers["bias"] < high


def test_every_claim_names_a_measurement_and_a_figure_that_exist():
    from evalsuite.report.figures import FIGURES

    for claim in claims.CLAIMS.values():
        module, function = claim.measure.split(":")
        assert callable(getattr(__import__(f"evalsuite.report.claims.{module}", fromlist=[function]), function))
        assert claim.figure is None or claim.figure in FIGURES
    with pytest.raises(EvalsuiteError, match="did you mean '001-circle'"):
        claims.choose(["001-circel"])
