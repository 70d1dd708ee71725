"""Claims: each verdict rests on a number, and a planted change of a formula turns it."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.math import cubemap, hierarchical, paraboloid, phong, sh
from evalsuite.report import claims
from evalsuite.report.claims import area_lights, harmonics, highlights, intervals, levels, maps, mcguire_errors, mcguire_maps
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


def test_highlights_are_alike_one_level_further_only(monkeypatch):
    """As published four times too bright at most and half as wide; one level more gives cos^s about h its own solid angle."""
    monkeypatch.setattr(highlights, "LAMPS", 20)
    monkeypatch.setattr(highlights, "EXPONENTS", (100,))
    found = highlights.similar()
    ratios = found.numbers["looked_up_over_direct"]["100"]
    assert found.verdict == FAILS and "peak and radius" in found.why
    assert 2.5 < ratios["peak"]["value"] < 4.5 and 0.5 < ratios["radius"]["value"] < 0.7
    assert ratios["direct_over_exact"]["value"] == pytest.approx(1.0, abs=0.01)
    published = phong.exponent_to_lod
    monkeypatch.setattr(phong, "exponent_to_lod", lambda s, w: published(s, w) + 1.0)
    assert highlights.similar().verdict == HOLDS


def test_direct_light_has_its_closed_form():
    """Over the normals at l = v, ∫ (s + 8)/8π cos^(s + 1) dω = (s + 8)/4(s + 2); a lamp that shrinks becomes a direction."""
    z = np.array([0.0, 0.0, 1.0])
    normals, weights = highlights._normals(2 * z)
    for s in highlights.EXPONENTS:
        lit = highlights._lit(normals, z[None], z, s)
        assert lit @ weights == pytest.approx((s + 8) / (4 * (s + 2)), rel=2e-3)
        assert highlights._lit(z[None], highlights._disc(z, 1e-4), z, s)[0] == pytest.approx((s + 8) / (8 * np.pi), rel=1e-3)


@pytest.fixture
def few(monkeypatch):
    """Two exponents and few pixels, computed anew."""
    for name, value in {"EXPONENTS": (5, 80), "TURNS": 5, "PIXELS": 60, "PICTURE": 96}.items():
        monkeypatch.setattr(mcguire_errors, name, value)
    mcguire_errors.errors.cache_clear()
    yield
    mcguire_errors.errors.cache_clear()


def test_where_the_level_errs_and_planted_levels_and_texels(few, monkeypatch):
    found, boxy = mcguire_maps.centres_corners(), mcguire_maps.flat_boxy()
    assert (
        found.verdict == LIMITS
        and found.numbers["r"]["corner_over_centre"]["ci95"][1] < 1 < found.numbers["r"]["low_over_high"]["ci95"][0]
    )
    assert boxy.verdict == LIMITS and "too shiny" in boxy.why and "too dull" in boxy.why
    # Two levels further nothing is too shiny.
    published = phong.exponent_to_lod
    with monkeypatch.context() as patch:
        patch.setattr(phong, "exponent_to_lod", lambda s, w: published(s, w) + 2.0)
        mcguire_errors.errors.cache_clear()
        assert "too dull among six walls for either lobe" in mcguire_maps.flat_boxy().why.replace(
            "it is too dull", "too dull among six walls"
        )
    # Corners a level further out are worse for the lobe about r too.
    whole = cubemap.SeamlessCube.lookup

    def blurred(self, directions, lod):
        corner = np.sort(np.abs(directions), axis=-1)[..., 0] > 0.45
        return whole(self, directions, np.asarray(lod) + 2.0 * corner)

    monkeypatch.setattr(cubemap.SeamlessCube, "lookup", blurred)
    mcguire_errors.errors.cache_clear()
    assert mcguire_maps.centres_corners().numbers["r"]["corner_over_centre"]["ci95"][0] > 1


def test_intervals_are_students():
    found = intervals.mean([1.0, 2.0, 3.0, 4.0])
    assert found["value"] == 2.5 and found["ci95"] == pytest.approx([2.5 - 2.0542, 2.5 + 2.0542], abs=1e-3)  # t₃ = 3.182, s/√4
    ratio = intervals.geometric([0.5, 2.0])
    assert ratio["value"] == pytest.approx(1.0) and ratio["ci95"][0] * ratio["ci95"][1] == pytest.approx(1.0)
    one = intervals.mean([3.0])
    assert one["ci95"] == [None, None] and not intervals.above(one, 0) and not intervals.below(one, 9)


def test_every_claim_names_a_measurement_and_a_figure_that_exist():
    from evalsuite.report.figures import FIGURES

    for claim in claims.CLAIMS.values():
        module, function = claim.measure.split(":")
        assert callable(getattr(__import__(f"evalsuite.report.claims.{module}", fromlist=[function]), function))
        assert claim.figure is None or claim.figure in FIGURES
    with pytest.raises(EvalsuiteError, match="did you mean '001-circle'"):
        claims.choose(["001-circel"])
