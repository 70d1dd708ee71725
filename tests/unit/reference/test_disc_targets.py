"""The targets `discs*`: closed forms, quadrature, and against the targets that look the environment up itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import OpenEXR
import pytest
from scipy import ndimage, stats

from evalsuite import api, steps
from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.lights import decompose
from evalsuite.lights.model import Decomposition, DecompositionSettings, Light
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.plan import DISCS
from evalsuite.plan import TARGETS as LISTED
from evalsuite.reference import integrators, worker
from evalsuite.reference.integrators import TARGETS
from evalsuite.scene.model import SceneSource
from evalsuite.steps import Steps
from evalsuite.store.cache import Store

ENVMAP = '<emitter type="envmap"><string name="filename" value="map.exr"/>{}</emitter>'
CUBE = '<shape type="cube"><bsdf type="diffuse" id="subject"/><transform name="to_world"><translate y="1"/></transform></shape>'
FLOOR = """<shape type="rectangle"><bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>
  <transform name="to_world"><scale value="20"/><rotate x="1" angle="-90"/></transform></shape>"""


def write(tmp_path, shapes, texels, origin="2,4,9", target="0,0.6,0", fov=25.0, up="0,1,0", transform=""):
    """A scene of 32 × 32 pixels lit by a map."""
    texels = np.ascontiguousarray(np.broadcast_to(texels, (*texels.shape[:2], 3)), np.float32)
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": texels}) as file:
        file.write(str(tmp_path / "map.exr"))
    sensor = f"""<sensor type="perspective"><float name="fov" value="{fov}"/>
      <transform name="to_world"><lookat origin="{origin}" target="{target}" up="{up}"/></transform>
      <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>"""
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene version="3.0.0">{sensor}{shapes}{ENVMAP.format(transform)}</scene>')
    return SceneSource(path)


@pytest.fixture
def apart(monkeypatch):
    """apart(lights, remainder): what the environment is taken apart into, without a search."""

    def into(lights, remainder):
        integrators._decomposed.cache_clear()
        found = Decomposition(tuple(lights), np.ascontiguousarray(remainder, np.float32))
        monkeypatch.setattr(decompose, "of", lambda environment, settings: found)

    return into


def light(direction, degrees, radiance):
    direction, r = np.asarray(direction, float) / np.linalg.norm(direction), np.radians(degrees)
    irradiance = np.broadcast_to(radiance, 3) * 2 * np.pi * (1 - np.cos(r))
    return Light(tuple(direction), float(r), tuple(float(e) for e in irradiance))


def inside(source):
    return worker.gbuffer(source).coverage == 1.0


def sidak_t(comparisons, passes, level=0.01):
    """Two-sided critical value over many comparisons; Student's t, as each standard error comes from a few passes."""
    return stats.t.isf((1 - (1 - level) ** (1 / comparisons)) / 2, passes - 1)


def assert_equal_but_for_noise(state, expected, mask, most):
    """Pixel by pixel, and all together. most: relative standard error of a pixel that still tells."""
    error, mean = state.standard_error[mask].astype(float), state.mean[mask].astype(float)
    expected = np.broadcast_to(expected, state.mean.shape)[mask]
    z = (mean - expected) / error
    assert (error / expected).max() < most
    assert np.abs(z).max() < sidak_t(z.size, state.passes)
    together = (mean - expected).sum(0) / np.sqrt((error**2).sum(0))
    assert np.abs(together).max() < sidak_t(3, state.passes)


BLACK = np.zeros((4, 8, 3))


def test_the_lists_agree():
    assert list(LISTED) == list(TARGETS)
    assert tuple(target.id for target in TARGETS.values() if target.decomposed) == DISCS


@pytest.mark.parametrize(("theta", "alpha"), [(0.0, 20.0), (50.0, 20.0), (70.0, 0.27), (20.0, 60.0)])
def test_irradiance_of_a_disc_above_the_horizon(tmp_path, apart, theta, alpha):
    """E = πL sin²α cosθ; shading from the centre, L Ω cosθ, exceeds it by 1/cos²(α/2)."""
    source = write(tmp_path, FLOOR, BLACK, target="0,0,0", fov=10)
    radiance = np.array([2.0, 1.0, 0.5])
    towards = (np.sin(np.radians(theta)), np.cos(np.radians(theta)), 0.0)
    apart([light(towards, alpha, radiance)], BLACK)
    exact = 0.5 * radiance * np.sin(np.radians(alpha)) ** 2 * np.cos(np.radians(theta))
    for target in ("discs-unshadowed", "discs", "discs-shadowed"):
        state = worker.advance(source, target, worker.render.fresh(source, 0, 64), 16)
        assert inside(source).all()
        assert_equal_but_for_noise(state, exact, np.ones((32, 32), bool), 0.05)
        assert state.mean.mean(axis=(0, 1)) == pytest.approx(exact, rel=2e-3)
    state = worker.advance(source, "discs-centre", None, 2)
    # The disc of radius tan α dips below the horizon where the cap does; then some of it is hidden by the floor itself.
    np.testing.assert_allclose(state.mean / (exact / np.cos(np.radians(alpha) / 2) ** 2), 1.0, rtol=2e-6)


@pytest.mark.parametrize("alpha", [4.0, 15.0])
def test_penumbra_of_a_half_plane(tmp_path, apart, alpha):
    """V = ½ + (x√(1 − x²) + asin x)/π over the tangent disc, x = offset / (h tan α); external oracle for `discs-centre`."""
    height, tan = 1.0, np.tan(np.radians(alpha))
    half = f"""<shape type="rectangle"><bsdf type="diffuse"/><transform name="to_world"><rotate x="1" angle="90"/>
      <scale value="30"/><translate x="-30" y="{height}"/></transform></shape>"""
    # The camera stands below the occluder and looks down on its penumbra.
    fov = float(np.degrees(2 * np.arctan(1.2 * tan / 0.9)))
    source = write(tmp_path, FLOOR + half, BLACK, "0,0.9,0", "0,0,0", fov, "0,0,1")
    apart([light((0, 1, 0), alpha, 3.0)], BLACK)
    state = worker.advance(source, "discs-centre", worker.render.fresh(source, 3, 64), 48, 3)

    offset = worker.gbuffer(source).position[..., 0].astype(float)
    pixel = np.abs(np.diff(offset[16])).mean()
    offset = offset[..., None] + pixel * (np.arange(64) + 0.5 - 32) / 64

    def expect(tan):
        x = np.clip(offset / (height * tan), -1, 1)
        visible = (0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi).mean(-1)
        return visible, 0.5 * 3.0 * 2 * (1 - np.cos(np.radians(alpha))) * visible[..., None] * np.ones(3)

    visible, expected = expect(tan)
    penumbra = (visible > 0.02) & (visible < 0.98)
    assert penumbra.sum() > 600 and (visible == 1).any() and (visible == 0).any()
    assert_equal_but_for_noise(state, expected, penumbra, 0.2)
    np.testing.assert_allclose(state.mean[visible == 1], expected[visible == 1], rtol=2e-6)
    assert not state.mean[visible == 0].any()
    with pytest.raises(AssertionError):  # it would tell a penumbra that is 2 % wider
        assert_equal_but_for_noise(state, expect(1.02 * tan)[1], penumbra, 0.2)


def test_without_lights_the_remainder_is_all(tmp_path, apart):
    texels = np.random.default_rng(3).random((9, 16, 3)) ** 2
    for shapes in (CUBE + FLOOR, CUBE.replace("diffuse", "phong") + FLOOR, CUBE.replace('"diffuse"', '"conductor"')):
        source = write(tmp_path, shapes, texels, fov=20.0)
        apart([], texels)
        plain = worker.advance(source, "unoccluded", None, 8)
        ours = worker.advance(source, "discs-unshadowed", None, 8)
        np.testing.assert_allclose(ours.mean, plain.mean, rtol=1e-5)  # the same samples
        assert plain.mean.min() > 0
        seen = worker.advance(source, "discs-shadowed", None, 16, 1), worker.advance(source, "direct", None, 16, 2)
        error = np.hypot(*(state.standard_error for state in seen))
        mask = inside(source) & (error.min(-1) > 1e-5)  # mirrors have no noise within a texel
        z = ((seen[0].mean - seen[1].mean) / error)[mask]
        assert z.size > 100 and np.abs(z).max() < sidak_t(z.size, 2 * 16 - 1)
    constant = write(tmp_path, CUBE, np.ones((3, 2, 3)))
    apart([], np.full((1, 1, 3), 2.0))
    state = worker.advance(constant, "discs-unshadowed", None, 16)
    assert state.mean[inside(constant)].mean() == pytest.approx(2.0 * 0.5, rel=1e-3)


@pytest.mark.parametrize("turn", ["", '<transform name="to_world"><rotate y="1" angle="110"/></transform>'])
def test_a_disc_in_the_map_is_that_disc(tmp_path, apart, turn):
    """A flat disc painted into a map, the rest constant: lights + remainder shadowed is `direct`, whichever way the map is
    turned. The map's edge is one texel (0.7°) of ramp about the disc's, which its penumbrae spread over."""
    height, width, alpha = 256, 512, 10.0
    towards = np.array([0.5, 0.7, 0.3]) / np.linalg.norm([0.5, 0.7, 0.3])
    within = np.arccos(np.clip(latlong_directions(height, width) @ towards, -1, 1))
    share = np.clip(0.5 + (np.radians(alpha) - within) / (np.pi / (height - 1)), 0, 1)[..., None]
    source = write(tmp_path, CUBE + FLOOR, 0.2 + 40.0 * share, transform=turn)
    irradiance = 40.0 * (share[..., 0] * latlong_solid_angles(height, width)).sum()
    found = replace(light(towards, alpha, 40.0), irradiance=(float(irradiance),) * 3)
    assert irradiance == pytest.approx(light(towards, alpha, 40.0).irradiance[0], rel=2e-3)
    apart([found], np.full((height, width, 3), 0.2))
    whole, ours = (
        worker.advance(source, target, worker.render.fresh(source, seed, 64), 32, seed)
        for seed, target in enumerate(("direct", "discs-shadowed"))
    )
    mask = inside(source)
    assert ours.mean[mask].mean() == pytest.approx(whole.mean[mask].mean(), rel=1e-3)
    error = np.hypot(whole.standard_error, ours.standard_error)
    assert (np.abs(ours.mean - whole.mean) < 5 * error + 0.03 * whole.mean)[mask].all()
    # Without the light there is little left, and shadows are deep: the comparison means something.
    assert whole.mean[mask].mean() > 0.3 and whole.mean[mask].min() < 0.15
    assert np.array_equal(ours.mean[:2, :2] > 0, whole.mean[:2, :2] > 0)


def test_each_target_leaves_out_its_own(tmp_path, apart):
    rest = 0.5 + np.random.default_rng(5).random((8, 16, 3))
    source = write(tmp_path, CUBE + FLOOR.replace("20", "4"), 2 * rest)
    lights = [light((-2, 2, 1), 20, 8.0), light((-2.3, 2, 1), 12, (1, 2, 8)), light((2, 1, -1), 30, 8.0)]
    apart(lights, rest)
    # One seed: what two targets share is the same samples, but for the order in which they are added.
    pictures = {target: worker.advance(source, target, None, 16).mean.astype(float) for target in DISCS}
    plain = worker.advance(source, "unoccluded", None, 16).mean.astype(float)
    outside = ndimage.binary_erosion(worker.gbuffer(source).coverage == 0)
    assert outside.sum() > 100
    for picture in pictures.values():  # the camera sees the map, not what is left of it
        np.testing.assert_array_equal(picture[outside], plain[outside])
    mask = inside(source)
    unshadowed, centre, both, shadowed = (pictures[target][mask] for target in DISCS)
    assert (unshadowed > both - 1e-5).all() and (both > shadowed - 1e-5).all()
    assert unshadowed.mean() > 1.05 * both.mean() and both.mean() > 1.05 * shadowed.mean()
    # Shading from the centre is too bright where no light sets: by 1/cos²(α/2) of each.
    free = np.abs(unshadowed - both).max(-1) < 1e-5
    assert free.sum() > 20
    assert 0.001 < np.median((centre / both - 1)[free]) < 1 / np.cos(np.radians(15)) ** 2 - 1


PHONG = {"type": "phong", "diffuse_reflectance": 0.2, "specular_reflectance": 0.6}
LOBES = {
    "phong 20": PHONG | {"exponent": 20.0},
    "phong 1000": PHONG | {"exponent": 1000.0},
    "blinnphong 200": {"type": "blinnphong", "exponent": 200.0, "diffuse_reflectance": 0.2, "specular_reflectance": 0.6},
}


def brdf_cos(plugin, n, v, towards):
    """f (n·l)₊ of Mitsuba's plugins, (K,)."""
    cosine, exponent = towards @ n, plugin["exponent"]
    if plugin["type"] == "phong":
        lobe = (exponent + 1) / (2 * np.pi) * np.maximum(towards @ (2 * (v @ n) * n - v), 0) ** exponent
    else:
        half = (towards + v) / np.linalg.norm(towards + v, axis=-1, keepdims=True)
        lobe = (exponent + 8) / (8 * np.pi) * np.maximum(half @ n, 0) ** exponent * cosine
    return np.where(cosine > 0, 0.2 / np.pi * cosine + 0.6 * lobe, 0)


def cap(direction, r, count=1200):
    """Points of a cap, (K, 3), each with the same solid angle."""
    u, phi = (np.arange(count) + 0.5) / count, (np.arange(count) + 0.5) / count * 2 * np.pi
    z = (1 - u * (1 - np.cos(r)))[:, None]
    t = np.cross(direction, [0.3, -0.5, 0.8])
    t /= np.linalg.norm(t)
    s = np.sqrt(1 - z * z)
    points = s[..., None] * (np.cos(phi)[:, None] * t + np.sin(phi)[:, None] * np.cross(direction, t))
    return (points + z[..., None] * direction).reshape(-1, 3)


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("name", list(LOBES))
def test_lobes_over_discs_are_the_plain_sum(tmp_path, apart, name, two_sided):
    """Small and large discs in and beside the lobe, one over another, one half below the horizon; a facet askew, seen from so
    far that the view direction is one."""
    shape = '<shape type="rectangle"><bsdf type="diffuse" id="subject"/>'
    if two_sided:
        shape = '<shape type="rectangle"><bsdf type="twosided"><bsdf type="diffuse" id="subject"/></bsdf>'
    shape += '<transform name="to_world"><rotate x="1" angle="-35"/><rotate y="1" angle="30"/></transform></shape>'
    source = write(tmp_path, shape, BLACK, "100,200,600", "0,0,0", 0.005)
    source = replace(source, bindings={"subject": LOBES[name]}, size=(8, 8))
    n = worker.gbuffer(source).normal[4, 4].astype(float)
    n /= np.linalg.norm(n)
    v = np.array([100.0, 200.0, 600.0]) / np.linalg.norm([100.0, 200.0, 600.0])
    r = 2 * (v @ n) * n - v
    aside = np.cross(r, [0.0, 0.0, 1.0])
    grazing = np.cross(n, [0.2, 1.0, 0.0])
    lights = [
        light(r + 0.02 * aside, 1.7, (9, 3, 1)),
        light(r + 0.25 * aside, 16.0, (1, 2, 3)),
        light(r - 0.06 * aside, 2.5, 1.0),
        light(grazing, 20.0, 1.0),
    ]
    apart(lights, BLACK)
    exact, centre = np.zeros(3), np.zeros(3)
    for one in lights:
        values = brdf_cos(LOBES[name], n, v, cap(np.array(one.direction), one.angular_radius))
        exact += values.mean() * np.array(one.irradiance)
        centre += brdf_cos(LOBES[name], n, v, np.array([one.direction]))[0] * np.array(one.irradiance)
    everywhere = np.ones((8, 8), bool)
    assert inside(source).all()
    for target in ("discs-unshadowed", "discs"):
        state = worker.advance(source, target, worker.render.fresh(source, 1, 64), 48, 1)
        assert_equal_but_for_noise(state, exact, everywhere, 0.05)
    state = worker.advance(source, "discs-centre", worker.render.fresh(source, 1, 64), 48, 1)
    assert state.mean.mean(axis=(0, 1)) == pytest.approx(centre, rel=5e-3)  # half of the grazing light is hidden by the facet
    assert np.abs(centre / exact - 1).max() > 0.01


def test_a_hidden_disc_gives_no_light(tmp_path, apart):
    """Neither to samples of the disc nor to those of the lobe, which meets it everywhere."""
    ceiling = """<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><scale value="200"/>
      <translate y="5"/></transform></shape>"""
    floor = FLOOR.replace("diffuse", "phong").replace('name="reflectance"', 'name="diffuse_reflectance"')
    source = write(tmp_path, floor + ceiling, BLACK, "0,4,0.1", "0,0,0")
    apart([light((0, 1, 0), 40, 5.0)], BLACK)
    assert worker.advance(source, "discs-unshadowed", None, 1).mean.min() > 0.5
    for target in ("discs", "discs-shadowed", "discs-centre"):
        assert not worker.advance(source, target, None, 4).mean.any()


def test_seeds(tmp_path, apart):
    source = write(tmp_path, CUBE + FLOOR, BLACK + 0.3)
    apart([light((1, 2, 1), 15, 5.0), light((1, 1, 1), 4, 9.0)], BLACK + 0.2)
    for target in DISCS:
        once, again, other = (worker.advance(source, target, None, 4, seed) for seed in (7, 7, 8))
        longer = worker.advance(source, target, worker.advance(source, target, None, 2, 7), 2, 7)
        assert np.array_equal(once.mean, again.mean) and np.array_equal(once.mean, longer.mean)
        assert not np.array_equal(once.mean, other.mean)


def test_settings_reach_the_decomposition(tmp_path, monkeypatch):
    source = write(tmp_path, CUBE, BLACK + 1.0)
    asked = []

    def of(environment, settings):
        asked.append((environment.radiance.shape, settings))
        return Decomposition((), environment.radiance)

    monkeypatch.setattr(decompose, "of", of)
    integrators._decomposed.cache_clear()
    worker.advance(source, "discs", None, 1)
    worker.advance(source, "discs", None, 1, 0, DecompositionSettings(stop=0.1))
    worker.advance(source, "direct", None, 1, 0, DecompositionSettings(stop=0.2))
    worker.passes(source, "discs", 16, range(1), 0, DecompositionSettings(stop=0.3))
    assert asked == [((4, 8, 3), one) for one in (DecompositionSettings(), *(DecompositionSettings(stop=s) for s in (0.1, 0.3)))]


def test_maps_that_no_light_reaches_are_not_held_against_them():
    for target in DISCS:
        assert "npr-sketch draws no light" in TECHNIQUES["npr-sketch"].reason_against_target(target)
        assert TECHNIQUES["diffuse-sh9"].reason_against_target(target) is None


def test_a_scene_without_an_environment_is_refused(tmp_path):
    source = write(tmp_path, CUBE, BLACK)
    path = source.path
    path.write_text(path.read_text().replace(ENVMAP.format(""), '<emitter type="point"/>'))
    with pytest.raises(EvalsuiteError, match="target discs: got a scene without an environment"):
        worker.advance(source, "discs", None, 1)


class Keys(Steps):
    """Steps that only say what they would look for."""

    def once(self, kind, key, make):
        return key, {}, True


def test_settings_decide_the_keys_of_these_targets_alone(tmp_path, monkeypatch):
    source, keys = write(tmp_path, CUBE, BLACK), Keys(Store(tmp_path / "store"), None)
    settings = [None, DecompositionSettings(), DecompositionSettings(stop=0.05)]
    formulas = tmp_path / "decompose.py"

    def all_keys():
        return {target: [keys.reference(source, target, 0, one)[3] for one in settings] for target in LISTED}

    before = all_keys()
    assert len({key for some in before.values() for key in some}) == 2 * len(DISCS) + (len(LISTED) - len(DISCS))
    formulas.write_text("other formulas")
    monkeypatch.setattr(steps, "module_files", lambda path: [formulas])
    after = all_keys()
    for target in LISTED:
        assert before[target][0] == before[target][1]
        assert (before[target][1] != before[target][2]) == (target in DISCS)
        assert set(before[target]).isdisjoint(after[target]) == (target in DISCS)


def test_parameters_of_the_decomposition(tmp_path):
    given = {"stop": 0.05, "frame": 3, "exponent": 7}
    assert api.of_decomposition("sphere", "discs", given) == {"stop": 0.05}
    assert api.of_decomposition("sphere", "direct", given) == {}
    path = write(tmp_path, CUBE, BLACK).path
    path.write_text(path.read_text().replace("<sensor", '<default name="stop" value="1"/><sensor'))
    assert api.of_decomposition(path, "discs", given) == {}  # the scene has one of its own
    handle = api.SceneHandle(SceneSource(path))
    for target, parameters, words in (
        ("discs", {"stop": 3}, "target discs, parameter stop: got 3"),
        ("discs", {"exponent": 3}, "parameter 'exponent', expected one of sizes, "),
        ("direct", {"stop": 0.1}, "only discs-unshadowed, .* take the environment apart"),
    ):
        with pytest.raises(EvalsuiteError, match=words):
            api.reference(handle, target, **parameters)
