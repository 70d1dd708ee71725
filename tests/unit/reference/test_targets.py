"""What the targets mean: closed forms, plain quadrature, and one target against another."""

from dataclasses import replace

import numpy as np
import OpenEXR
import pytest
from scipy import stats

from evalsuite.errors import EvalsuiteError
from evalsuite.math.sphere import latlong_lookup
from evalsuite.reference import worker
from evalsuite.reference.integrators import TARGETS
from evalsuite.scene.model import SceneSource

# Those that the scene's own emitters light; what the environment is decomposed into has tests of its own.
LIT = [t.id for t in TARGETS.values() if not (t.id == "lookup" or t.within_room or t.decomposed)]

SENSOR = """<sensor type="perspective"><float name="fov" value="25"/>
  <transform name="to_world"><lookat origin="1,2,6" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>
"""


def write(tmp_path, shapes, emitter):
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene version="3.0.0">{SENSOR}{shapes}{emitter}</scene>')
    return SceneSource(path)


def write_map(path, texels):
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.ascontiguousarray(texels, np.float32)}) as file:
        file.write(str(path))


def sphere(bsdf='<bsdf type="diffuse" id="subject"/>'):
    return f'<shape type="sphere">{bsdf}</shape>'


CONSTANT = '<emitter type="constant"><rgb name="radiance" value="3,2,1"/></emitter>'
ENVMAP = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'


def inside(source):
    return worker.gbuffer(source).coverage == 1.0


def z_scores(state, expected, mask):
    return ((state.mean.astype(np.float64) - expected) / state.standard_error)[mask]


def sidak_t(comparisons, passes, level=0.01):
    """Two-sided critical value over many comparisons; Student's t, as each standard error comes from a few passes."""
    return stats.t.isf((1 - (1 - level) ** (1 / comparisons)) / 2, passes - 1)


@pytest.mark.parametrize("target", LIT)
def test_diffuse_furnace(tmp_path, target):
    source = write(tmp_path, sphere('<bsdf type="diffuse"><rgb name="reflectance" value="0.5,0.6,0.7"/></bsdf>'), CONSTANT)
    state, mask = worker.advance(source, target, None, 16), inside(source)
    assert mask.sum() > 150
    albedo_times_radiance = np.array([1.5, 1.2, 0.7])
    np.testing.assert_allclose(state.mean[mask].mean(0), albedo_times_radiance, rtol=1e-3)
    # Tessellation costs `direct` and `path` a little: shading normals see light the flat facet does not.
    assert np.abs(state.mean[mask] / albedo_times_radiance - 1).max() < 0.02
    assert np.array_equal(state.mean[:4, :4], np.broadcast_to([3, 2, 1], (4, 4, 3)))  # the background, exactly


@pytest.mark.parametrize("degrees", [20.0, 50.0])
def test_irradiance_of_a_uniform_cap(tmp_path, degrees):
    """A plane under a cap of radiance 2 about its normal: E = π L sin²θ, hence radiance ρ L sin²θ."""
    height, width = 1024, 8
    v = np.arange(height) / (height - 1)
    # +y pole: a row counts while its share of the bilinear ramp lies within the cap.
    cap = np.clip((degrees / 180 - v) * (height - 1) + 0.5, 0, 1)
    write_map(tmp_path / "map.exr", np.broadcast_to(2 * cap[:, None, None], (height, width, 3)))
    plane = '<shape type="rectangle"><bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>'
    plane += '<transform name="to_world"><scale value="20"/><rotate x="1" angle="-90"/></transform></shape>'
    source = write(tmp_path, plane, ENVMAP)
    for target in LIT:
        state, mask = worker.advance(source, target, None, 16), inside(source)
        assert mask.sum() > 900
        expected = 0.5 * 2 * np.sin(np.radians(degrees)) ** 2
        np.testing.assert_allclose(state.mean[mask].mean(), expected, rtol=2e-3)


BRDFS = {
    "diffuse": {"type": "diffuse", "reflectance": 0.7},
    "phong": {"type": "phong", "exponent": 12.0, "diffuse_reflectance": 0.2, "specular_reflectance": 0.6},
    "blinnphong": {"type": "blinnphong", "exponent": 20.0, "diffuse_reflectance": 0.2, "specular_reflectance": 0.6},
}


def brdf_cos(name, n, v, light):
    nl, nv = light @ n, v @ n
    above = nl > 0
    if name == "diffuse":
        return np.where(above, 0.7 / np.pi * nl, 0)
    if name == "phong":
        lobe = 13 / (2 * np.pi) * np.maximum(light @ (2 * nv * n - v), 0) ** 12
        return np.where(above, 0.2 / np.pi * nl + 0.6 * lobe, 0)
    half = (light + v) / np.maximum(np.linalg.norm(light + v, axis=-1, keepdims=True), 1e-12)
    return np.where(above, (0.2 + 0.6 * 28 / 8 * np.maximum(half @ n, 0) ** 20) / np.pi * nl, 0)


@pytest.mark.parametrize("name", list(BRDFS))
def test_unoccluded_is_the_plain_sum_over_directions(tmp_path, name):
    rng = np.random.default_rng(3)
    texels = (rng.random((9, 16, 3)) ** 3 * 4).astype(np.float32)
    write_map(tmp_path / "map.exr", texels)
    # A facet that faces askew; a camera so far that the view direction is one.
    shape = '<shape type="rectangle"><bsdf type="diffuse" id="subject"/>'
    shape += '<transform name="to_world"><rotate x="1" angle="-35"/><rotate y="1" angle="30"/></transform></shape>'
    source = replace(write(tmp_path, shape, ENVMAP), bindings={"subject": BRDFS[name]}, size=(8, 8))
    path = source.path
    path.write_text(
        path.read_text()
        .replace('origin="1,2,6"', 'origin="100,200,600"')
        .replace('name="fov" value="25"', 'name="fov" value="0.05"')
    )
    passes = 48
    state, mask = worker.advance(source, "unoccluded", None, passes), inside(source)
    assert mask.all()
    normal = worker.gbuffer(source).normal[4, 4].astype(np.float64)
    normal /= np.linalg.norm(normal)
    to_view = np.array([100.0, 200.0, 600.0]) / np.linalg.norm([100.0, 200.0, 600.0])

    count = 1200  # midpoint rule over θ and φ: converged to 1e-5 for lobes this wide
    theta = (np.arange(count) + 0.5) / count * np.pi
    phi = (np.arange(2 * count) + 0.5) / count * np.pi
    light = np.stack(
        [
            np.sin(theta)[:, None] * np.sin(phi),
            np.broadcast_to(np.cos(theta)[:, None], (count, 2 * count)),
            -np.sin(theta)[:, None] * np.cos(phi),
        ],
        -1,
    )
    weight = brdf_cos(name, normal, to_view, light) * np.sin(theta)[:, None] * (np.pi / count) ** 2
    expected = np.einsum("ij,ijc->c", weight, latlong_lookup(texels, light))

    z = z_scores(state, expected, mask)
    assert (state.standard_error[mask] / state.mean[mask]).max() < 0.02 and expected.min() > 0.05
    assert np.abs(z).max() < sidak_t(z.size, passes)
    # All pixels together: 64 times as sharp.
    mean, error = state.mean[mask].mean(0), np.sqrt((state.standard_error[mask].astype(float) ** 2).sum(0)) / mask.sum()
    assert np.abs((mean - expected) / error).max() < 4 and (error / mean).max() < 2e-3


def test_direct_is_unoccluded_on_a_convex_object_and_below_it_elsewhere(tmp_path):
    write_map(tmp_path / "map.exr", np.random.default_rng(3).random((9, 16, 3)) ** 2)
    cube = '<shape type="cube"><bsdf type="phong"><float name="exponent" value="5"/></bsdf></shape>'
    passes = 24
    source = write(tmp_path, cube, ENVMAP)
    free, seen = (worker.advance(source, target, None, passes, seed) for target, seed in (("unoccluded", 1), ("direct", 2)))
    mask = inside(source)
    error = np.hypot(free.standard_error, seen.standard_error)[mask]
    z = (free.mean - seen.mean)[mask] / error
    assert mask.sum() > 200 and np.abs(z).max() < sidak_t(z.size, passes)
    assert (error / free.mean[mask]).max() < 0.05

    floor = '<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="5"/>'
    floor += '<translate y="-1"/></transform></shape>'
    source = write(tmp_path, cube + floor, ENVMAP)
    free, seen, full = (worker.advance(source, target, None, 8) for target in ("unoccluded", "direct", "path"))
    mask = inside(source)
    assert seen.mean[mask].mean() < 0.97 * free.mean[mask].mean()
    assert full.mean[mask].mean() > 1.03 * seen.mean[mask].mean()


def test_mirrors_show_the_environment(tmp_path):
    texels = np.random.default_rng(3).random((5, 8, 3)).astype(np.float32)
    write_map(tmp_path / "map.exr", texels)
    for wrap in ("{}", '<bsdf type="twosided">{}</bsdf>'):
        source = replace(write(tmp_path, sphere(wrap.format('<bsdf type="conductor"/>')), ENVMAP), size=(64, 64))
        a, b = worker.advance(source, "unoccluded", None, 4), worker.advance(source, "direct", None, 4)
        mask = inside(source)
        buffer = worker.gbuffer(source, 1)
        eye = np.array([1.0, 2.0, 6.0])
        view = eye - buffer.position
        view /= np.linalg.norm(view, axis=-1, keepdims=True)
        n = buffer.normal
        reflected = 2 * (view * n).sum(-1, keepdims=True) * n - view
        facing = mask & ((view * n).sum(-1) > 0.8)  # elsewhere the pixel spreads over many texels
        assert facing.sum() > 100
        assert np.abs(a.mean - b.mean)[facing].max() < 1e-5  # the same rays
        assert np.abs(a.mean - latlong_lookup(texels, reflected))[facing].mean() < 0.01


def test_unknown_target(tmp_path):
    with pytest.raises(EvalsuiteError, match=r"unoccluded, .*, direct, path"):
        worker.advance(write(tmp_path, sphere(), CONSTANT), "indirect", None, 1)


def test_a_zero_map_is_black(tmp_path):
    write_map(tmp_path / "map.exr", np.zeros((8, 16, 3)))
    source = write(tmp_path, sphere(), ENVMAP)
    for target in LIT:
        state = worker.advance(source, target, None, 2)
        assert not state.mean.any() and not state.standard_error.any()
