"""Emitters and cameras of Mitsuba XML."""

from dataclasses import replace

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.reference.variants import activate
from evalsuite.scene.environment import evaluate
from evalsuite.scene.load import load
from tests.unit.scene.written import BALL, SENSOR, SKY, noise, write, write_map

mi = activate()
import drjit as dr  # noqa: E402 (after activate, which chooses the LLVM)


def test_envmap_scale_rotation_and_replacement(tmp_path):
    write_map(tmp_path / "a.exr", noise())
    write_map(tmp_path / "b.exr", noise(6, 12))
    turn = '<transform name="to_world"><rotate y="1" angle="30"/></transform>'
    body = f'<emitter type="envmap"><string name="filename" value="a.exr"/><float name="scale" value="3"/>{turn}</emitter>\n'
    source = write(tmp_path, SENSOR + BALL + body)
    loaded = load(source)
    environment = loaded.scene.environment
    assert np.array_equal(environment.radiance, noise() * np.float32(3))
    d = np.random.default_rng(1).normal(size=(500, 3))
    si = dr.zeros(mi.SurfaceInteraction3f, 500)
    si.wi = -mi.Vector3f(np.ascontiguousarray((d / np.linalg.norm(d, axis=1, keepdims=True)).T.astype(np.float32)))
    original = mi.load_file(str(source.path)).environment()
    np.testing.assert_allclose(evaluate(environment, d), np.array(original.eval(si)).T, atol=1e-5)

    replaced = load(replace(source, environment=tmp_path / "b.exr")).scene.environment
    assert np.array_equal(replaced.radiance, noise(6, 12)) and np.array_equal(replaced.to_world, environment.to_world)
    (tmp_path / "a.exr").unlink()  # and the scene's own map is not even read
    assert load(replace(source, environment=tmp_path / "b.exr"))


def test_constant_is_one_texel_and_stays_constant(tmp_path):
    loaded = load(write(tmp_path, SENSOR + BALL + '<emitter type="constant"><rgb name="radiance" value="1,2,3"/></emitter>\n'))
    assert loaded.scene.environment.radiance.tolist() == [[[1, 2, 3]]]
    assert loaded.environment.class_name().startswith("Constant")


def test_sunsky_is_baked_with_the_suns_energy(tmp_path):
    source = write(tmp_path, SENSOR + BALL + '<emitter type="sunsky"/>\n')
    first, second = load(source).scene.environment, load(source).scene.environment
    assert np.array_equal(first.radiance, second.radiance) and "baked" in first.remarks[0]
    height, width = first.radiance.shape[:2]
    radiance, omega = first.radiance.astype(np.float64), latlong_solid_angles(height, width)
    bright = radiance.max(2) > 50
    baked_sun = (radiance * (omega * bright)[..., None]).sum((0, 1))
    # The sun's cap, sampled densely around its centre, by Mitsuba's own emitter.
    emitter = mi.load_dict({"type": "sunsky"})
    directions = latlong_directions(height, width) @ first.to_world.T
    centre = (directions * (omega * radiance.sum(2) * bright)[..., None]).sum((0, 1))
    centre /= np.linalg.norm(centre)
    half_angle = np.radians(0.5)
    rng = np.random.default_rng(3)
    cosine = 1 - rng.random(400000) * (1 - np.cos(half_angle))
    phi = rng.random(400000) * 2 * np.pi
    s = np.array(mi.coordinate_system(mi.Vector3f(*centre.tolist()))).reshape(2, 3)
    sine = np.sqrt(1 - cosine**2)
    d = sine[:, None] * (np.cos(phi)[:, None] * s[0] + np.sin(phi)[:, None] * s[1]) + cosine[:, None] * centre
    si = dr.zeros(mi.SurfaceInteraction3f, len(d))
    si.wi = -mi.Vector3f(np.ascontiguousarray(d.T.astype(np.float32)))
    true_sun = np.array(emitter.eval(si), np.float64).T.mean(0) * 2 * np.pi * (1 - np.cos(half_angle))
    assert true_sun.min() > 0.1
    # 64 jittered samples in each of a dozen texels on the sun's rim: about 1 % by measurement, 2.5 % at worst.
    np.testing.assert_allclose(baked_sun, true_sun, rtol=0.025)
    # Away from sun and horizon, the map is the sky.
    d = np.random.default_rng(4).normal(size=(4000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d = d[(d[:, 2] > 0.05) & (d @ centre < 0.99)]
    si = dr.zeros(mi.SurfaceInteraction3f, len(d))
    si.wi = -mi.Vector3f(np.ascontiguousarray(d.T.astype(np.float32)))
    np.testing.assert_allclose(evaluate(first, d), np.array(emitter.eval(si)).T, rtol=2e-3)


def test_area_lights_are_for_mitsuba_only(tmp_path):
    light = '<emitter type="area"><rgb name="radiance" value="5"/></emitter>'
    lit = f'<shape type="sphere">{light}<transform name="to_world"><translate y="2"/></transform></shape>\n'
    loaded = load(write(tmp_path, SENSOR + BALL + lit + f'<shape type="rectangle">{light}</shape>\n'))
    scene = loaded.scene
    assert scene.environment is None and len(scene.mitsuba_only) == 2 and "line" in scene.mitsuba_only[0]
    assert len(scene.meshes) == 3 and len(loaded.mitsuba.emitters()) == 2
    with pytest.raises(EvalsuiteError, match="no envmap"):
        scene.require_drawable()
    assert np.array(mi.load_dict({"type": "direct"}).render(loaded.mitsuba, 0, spp=4)).max() > 1


@pytest.mark.parametrize(
    "element",
    [
        '<emitter type="point"><point name="position" x="0" y="3" z="0"/></emitter>',
        '<emitter type="directional"/>',
        '<shape type="shapegroup" id="g"><shape type="cube"/></shape><shape type="instance"><ref id="g"/></shape>',
        '<shape type="sphere"><medium name="interior" type="homogeneous"/><bsdf type="null"/></shape>',
        '<shape type="heightfield"><string name="filename" value="h.exr"/></shape>',
    ],
)
def test_what_cannot_be_drawn_alike_is_refused_by_name_and_line(tmp_path, element):
    write_map(tmp_path / "h.exr", noise())
    try:
        loaded = load(write(tmp_path, SENSOR + SKY + BALL + element + "\n"))
    except EvalsuiteError as error:  # plugins that this Mitsuba does not have
        assert "unknown shape plugin" in str(error)
        return
    assert len(loaded.scene.refused) == 1 and "line" in loaded.scene.refused[0]
    with pytest.raises(EvalsuiteError, match="line"):
        loaded.scene.require_drawable()
    assert np.isfinite(np.array(mi.load_dict({"type": "direct"}).render(loaded.mitsuba, 0, spp=4))).all()


@pytest.mark.parametrize("plugin", ["thinlens", "orthographic"])
def test_other_cameras_are_refused(tmp_path, plugin):
    extra = {"thinlens": '<float name="aperture_radius" value="0.1"/><float name="focus_distance" value="5"/>'}.get(plugin, "")
    sensor = SENSOR.replace("perspective", plugin).replace('<float name="fov" value="40"/>', extra)
    scene = load(write(tmp_path, sensor + SKY + BALL)).scene
    assert len(scene.refused) == 1 and plugin in scene.refused[0]


@pytest.mark.parametrize("axis", ["x", "y", "smaller", "larger", "diagonal"])
@pytest.mark.parametrize("size", [None, (20, 50)])
def test_camera_projects_as_mitsubas(tmp_path, axis, size):
    """Points seen through Mitsuba's own rays land at the pixel they came from."""
    film = (
        '<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="40"/>'
        '<integer name="crop_offset_x" value="8"/><integer name="crop_offset_y" value="4"/>'
        '<integer name="crop_width" value="32"/><integer name="crop_height" value="20"/><rfilter type="gaussian"/></film>'
    )
    sensor = f"""<sensor type="perspective"><float name="fov" value="50"/><string name="fov_axis" value="{axis}"/>
      <float name="principal_point_offset_x" value="0.1"/><float name="principal_point_offset_y" value="-0.2"/>
      <float name="near_clip" value="0.1"/><float name="far_clip" value="50"/>
      <transform name="to_world"><lookat origin="1,2,5" target="0,0,0" up="0,1,0"/></transform>{film}</sensor>\n"""
    loaded = load(replace(write(tmp_path, sensor + SKY + BALL), size=size))
    camera = loaded.scene.camera
    assert camera.film == (size or (64, 40)) and (camera.near, camera.far) == pytest.approx((0.1, 50))
    assert camera.crop == ((8, 4, 32, 20) if size is None else (2, 5, 10, 25))
    width, height = camera.size
    assert tuple(np.array(loaded.sensor.film().crop_size())) == (width, height)
    assert "Box" in str(loaded.sensor.film().rfilter())

    pixel = np.random.default_rng(0).random((50, 2))
    ray, _ = loaded.sensor.sample_ray(0.0, 0.5, mi.Point2f(np.ascontiguousarray(pixel.T.astype(np.float32))), mi.Point2f(0.5))
    point = np.array(ray.o + 3.0 * ray.d, np.float64).T
    local = (np.c_[point, np.ones(50)] @ np.linalg.inv(camera.to_world).T)[:, :3]
    c = 1 / np.tan(np.radians(camera.fov_x_deg) / 2)
    aspect = camera.film[0] / camera.film[1]
    x, y, z = local.T
    on_film = np.stack([0.5 * z - 0.5 * c * x, 0.5 * z - 0.5 * c * aspect * y], 1) / z[:, None]
    crop, offset = np.array(camera.crop[2:]), np.array(camera.crop[:2])
    found = (on_film * camera.film - offset) / crop - np.array(camera.principal_point) * camera.film / crop
    assert np.abs(found - pixel).max() < 1e-4


def test_default_film_is_mitsubas(tmp_path):
    assert load(write(tmp_path, '<sensor type="perspective"/>\n' + SKY + BALL)).scene.camera.size == (768, 576)
