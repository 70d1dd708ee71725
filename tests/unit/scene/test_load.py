"""Scenes from Mitsuba XML: paths, shapes, materials, emitters, cameras, and every failure in one line with its place."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.reference.variants import activate
from evalsuite.scene.environment import evaluate
from evalsuite.scene.load import load
from evalsuite.scene.model import SceneSource

mi = activate()
import drjit as dr  # noqa: E402 (after activate, which chooses the LLVM)

SENSOR = """<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film></sensor>
"""
BALL = '<shape type="sphere" id="ball"><bsdf type="diffuse" id="subject"/></shape>\n'
SKY = '<emitter type="constant"><float name="radiance" value="2"/></emitter>\n'


def write(folder, body, name="scene.xml"):
    path = Path(folder) / name
    path.write_text(f'<scene version="3.0.0">\n{body}</scene>\n', encoding="utf-8")
    return SceneSource(path)


def write_map(path, texels):
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.ascontiguousarray(texels, np.float32)}) as file:
        file.write(str(path))
    return path


def noise(height=8, width=16):
    return np.random.default_rng(0).random((height, width, 3), dtype=np.float32)


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n"


# ---- files ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("cwd", ["elsewhere", "beside"])
def test_files_beside_the_scene_in_folders_with_odd_names(tmp_path, monkeypatch, absolute, cwd):
    folder = tmp_path / "Szene mit Ärger №1 日本"
    (folder / "sub folder").mkdir(parents=True)
    (folder / "sub folder" / "tetra ö.ply").write_text(PLY)
    write_map(folder / "sub folder" / "hülle.exr", noise())
    prefix = f"{folder}/" if absolute else ""
    source = write(
        folder,
        SENSOR
        + f'<shape type="ply"><string name="filename" value="{prefix}sub folder/tetra ö.ply"/></shape>\n'
        + f'<emitter type="envmap"><string name="filename" value="{prefix}sub folder/hülle.exr"/></emitter>\n',
    )
    monkeypatch.chdir(folder if cwd == "beside" else tmp_path)
    scene = load(replace(source, path=Path(os.path.relpath(source.path)))).scene
    assert len(scene.meshes[0].faces) == 4
    assert np.array_equal(scene.environment.radiance, noise())


def test_an_included_file_is_found_beside_the_scene(tmp_path, monkeypatch):
    write(tmp_path, BALL, "part.xml")
    monkeypatch.chdir("/")
    assert load(write(tmp_path, SENSOR + SKY + '<include filename="part.xml"/>\n')).scene.meshes[0].name == "ball"


FAILURES = {
    "unknown BSDF": ('<shape type="sphere"><bsdf type="fong"/></shape>', r"line 2, col \d+.*fong.*spelling"),
    "unknown shape": ('<shape type="blob"/>', r"line 2.*blob"),
    "unknown property": ('<shape type="sphere"><float name="radios" value="2"/></shape>', r"line 2.*radios"),
    "missing mesh": ('<shape type="ply"><string name="filename" value="no.ply"/></shape>', r"line 2.*no file 'no\.ply'"),
    "missing map": ('<emitter type="envmap"><string name="filename" value="no.exr"/></emitter>', r"line 2.*no file 'no\.exr'"),
    "missing texture": (
        '<bsdf type="diffuse"><texture name="reflectance" type="bitmap">'
        '<string name="filename" value="no.png"/></texture></bsdf>',
        r"line 2.*no file 'no\.png'",
    ),
    "missing reference": ('<shape type="cube"><ref id="nobody"/></shape>', r"line 2.*nobody"),
    "bad number": ('<shape type="sphere"><float name="radius" value="wide"/></shape>', r"line 2.*wide"),
    "undefined parameter": ('<shape type="sphere"><float name="radius" value="$r"/></shape>', r"line 2.*\$r"),
    "default without value": ('<default name="r"/>', r"line 2.*value"),
    "bad XML": ('<shape type="sphere">', r"broken XML.*line"),
    "duplicate id": ('<bsdf type="diffuse" id="a"/><bsdf type="diffuse" id="a"/>', r'line 2.*duplicate.*"a"'),
    "negative exponent": ('<bsdf type="phong"><float name="exponent" value="-1"/></bsdf>', r"line 2.*exponent -1.*≥ 0"),
    "too bright": ('<bsdf type="phong"><rgb name="specular_reflectance" value="3"/></bsdf>', r"line 2.*\[0, 1\]"),
    "two environments": (SKY.strip(), r"second environment"),
    "scaled map": (
        '<emitter type="envmap"><string name="filename" value="no.exr"/>'
        '<transform name="to_world"><scale value="2"/></transform></emitter>',
        r"line 2.*scales",
    ),
}


@pytest.mark.parametrize("name", list(FAILURES))
def test_failures_name_file_and_line(tmp_path, name, capfd):
    body, pattern = FAILURES[name]
    rest = SENSOR + BALL + (SKY if name == "two environments" or "envmap" not in body else "")
    with pytest.raises(EvalsuiteError, match=pattern) as caught:
        load(write(tmp_path, body + "\n" + rest))
    message = str(caught.value)
    assert "scene.xml" in message and "\n" not in message and "expected" in message and len(message) < 500
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("content", "pattern"),
    [
        ("", "broken XML"),
        ("junk", "broken XML"),
        ('<shape version="3.0.0" type="cube"/>', "root"),
        ("<scene></scene>", "version"),
    ],
)
def test_not_a_scene(tmp_path, content, pattern):
    (tmp_path / "scene.xml").write_text(content)
    with pytest.raises(EvalsuiteError, match=pattern):
        load(SceneSource(tmp_path / "scene.xml"))


def test_no_file_no_sensor_no_shape(tmp_path):
    for source, pattern in (
        (SceneSource(tmp_path / "none.xml"), "no such file"),
        (SceneSource(tmp_path), "folder"),
        (write(tmp_path, BALL, "a.xml"), "no sensor"),
        (write(tmp_path, SENSOR, "b.xml"), "no shapes"),
    ):
        with pytest.raises(EvalsuiteError, match=pattern):
            load(source)


def test_a_truncated_mesh(tmp_path):
    head = PLY.split("end_header")[0].replace("ascii", "binary_little_endian")
    (tmp_path / "cut.ply").write_bytes((head + "end_header\n").encode() + b"\0" * 20)
    with pytest.raises(EvalsuiteError, match=r"line 2.*cut\.ply"):
        load(write(tmp_path, '<shape type="ply"><string name="filename" value="cut.ply"/></shape>\n' + SENSOR))


# ---- shapes ---------------------------------------------------------------------------------------------------------

TRANSFORMS = {
    "as it is": "",
    "moved": '<transform name="to_world"><scale value="0.5"/><rotate x="1" angle="70"/><translate x="1" z="2"/></transform>',
    "stretched": '<transform name="to_world"><scale x="0.5" y="1.5" z="1"/><rotate z="1" angle="20"/></transform>',
    "mirrored": '<transform name="to_world"><scale x="-1"/><rotate y="1" angle="20"/></transform>',
}


@pytest.mark.parametrize("transform", list(TRANSFORMS))
@pytest.mark.parametrize("flip", ["", '<boolean name="flip_normals" value="true"/>'])
@pytest.mark.parametrize("plugin", ["sphere", "disk", "cylinder", "cube", "rectangle", "ply", "obj"])
def test_normals_and_winding_are_mitsubas(tmp_path, plugin, transform, flip):
    if plugin == "sphere" and transform == "stretched":
        pytest.skip("Mitsuba's own sphere is not an ellipsoid; ours, shown to both renderers, is")
    (tmp_path / "m.ply").write_text(PLY)
    (tmp_path / "m.obj").write_text(OBJ)
    file = f'<string name="filename" value="m.{plugin}"/>' if plugin in ("ply", "obj") else ""
    source = write(tmp_path, SENSOR + SKY + f'<shape type="{plugin}">{file}{flip}{TRANSFORMS[transform]}</shape>\n')
    loaded = load(source)
    (mesh,) = loaded.scene.meshes
    assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 1e-5
    corners = mesh.positions.astype(np.float64)[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faces_along = np.einsum("ij,ij->i", cross, mesh.normals[mesh.faces].sum(1))
    assert faces_along.min() > 0  # counter-clockwise seen from where the normals point

    # Rays at the triangles' centres from both sides, into the untouched Mitsuba scene: same place, same shading normal.
    original = mi.load_file(str(source.path), optimize=False)
    pick = np.linspace(0, len(corners) - 1, 40).astype(int)
    centre = corners[pick].mean(1)
    normal = cross[pick] / np.linalg.norm(cross[pick], axis=1, keepdims=True)
    size = np.ptp(mesh.positions, axis=0).max()
    for side in (1.0, -1.0):
        origin = centre + 1e-2 * side * size * normal
        ray = mi.Ray3f(*(mi.Vector3f(np.ascontiguousarray(a.T.astype(np.float32))) for a in (origin, -side * normal)))
        si = original.ray_intersect(ray)
        valid = np.array(si.is_valid())
        assert valid.mean() > 0.9
        seen = np.array(si.sh_frame.n).T[valid]
        ours = mesh.normals[mesh.faces[pick]].mean(1)[valid]
        ours /= np.linalg.norm(ours, axis=1, keepdims=True)
        assert np.einsum("ij,ij->i", seen, ours).min() > 0.999


def test_flat_meshes_are_unwelded_and_smooth_ones_are_not(tmp_path):
    (tmp_path / "m.ply").write_text(PLY)
    flat = '<boolean name="face_normals" value="true"/>'
    for extra, vertices in ((flat, 12), ("", 4)):
        body = f'<shape type="ply"><string name="filename" value="m.ply"/>{extra}</shape>\n'
        mesh = load(write(tmp_path, SENSOR + body)).scene.meshes[0]
        assert len(mesh.positions) == len(mesh.normals) == vertices


def test_tessellated_sphere_has_exact_normals_and_lies_on_the_sphere(tmp_path):
    body = '<shape type="sphere"><point name="center" x="1" y="2" z="3"/><float name="radius" value="0.5"/></shape>\n'
    mesh = load(write(tmp_path, SENSOR + body)).scene.meshes[0]
    out = (mesh.positions - [1, 2, 3]) / 0.5
    assert np.abs(np.linalg.norm(out, axis=1) - 1).max() < 2e-6
    assert np.abs(out - mesh.normals).max() < 2e-6
    assert len(mesh.faces) == 2 * 128 * 63


def test_both_renderers_get_the_same_triangles(tmp_path):
    loaded = load(write(tmp_path, SENSOR + SKY + BALL + '<shape type="cube"/><shape type="disk"/>\n'))
    for mesh, shape in zip(loaded.scene.meshes, loaded.mitsuba.shapes(), strict=True):
        index = dr.arange(mi.UInt32, shape.vertex_count())
        assert np.array_equal(np.array(shape.vertex_position(index)).T, mesh.positions)
        assert shape.face_count() == len(mesh.faces)


# ---- materials ------------------------------------------------------------------------------------------------------


def material(tmp_path, bsdf, **kwargs):
    (only,) = load(replace(write(tmp_path, SENSOR + f'<shape type="cube">{bsdf}</shape>\n'), **kwargs)).scene.materials
    return only


def test_canonical_parameters(tmp_path):
    red = material(tmp_path, '<bsdf type="diffuse"><rgb name="reflectance" value="0.5,0.25,0.125"/></bsdf>')
    assert (red.plugin, dict(red.parameters), red.undrawable) == ("diffuse", {"reflectance": (0.5, 0.25, 0.125)}, None)
    assert "line" in red.location
    mirror = material(tmp_path, '<bsdf type="conductor"><string name="material" value="none"/></bsdf>')
    assert mirror.parameters == {"specular_reflectance": (1,) * 3, "eta": (0,) * 3, "k": (1,) * 3}
    gold = material(
        tmp_path, '<bsdf type="roughconductor"><string name="material" value="Au"/><float name="alpha" value="0.25"/></bsdf>'
    )
    assert gold.parameters["alpha"] == 0.25 and gold.parameters["distribution"] == "beckmann"
    assert gold.parameters["eta"] == pytest.approx((0.143, 0.375, 1.442), abs=0.01) and gold.undrawable is None
    glossy = material(
        tmp_path, '<bsdf type="twosided" id="s"><bsdf type="blinnphong"><float name="exponent" value="7"/></bsdf></bsdf>'
    )
    assert (glossy.id, glossy.plugin, glossy.two_sided, glossy.parameters["exponent"]) == ("s", "blinnphong", True, 7.0)
    assert glossy.parameters["diffuse_reflectance"] == (0,) * 3


def test_a_shape_without_a_bsdf_is_mitsubas_grey(tmp_path):
    grey = material(tmp_path, "")
    assert grey.plugin == "diffuse" and grey.parameters["reflectance"] == (0.5,) * 3 and grey.undrawable is None


@pytest.mark.parametrize(
    ("bsdf", "reason"),
    [
        ('<bsdf type="dielectric"/>', "no such BSDF"),
        ('<bsdf type="thindielectric"/>', "no such BSDF"),
        ('<bsdf type="principled"/>', "no such BSDF"),
        ('<bsdf type="mask"><bsdf type="diffuse"/></bsdf>', "no such BSDF"),
        ('<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf>', "textured reflectance"),
        ('<bsdf type="phong"><texture type="checkerboard" name="diffuse_reflectance"/></bsdf>', "textured diffuse_reflectance"),
        (
            '<bsdf type="roughconductor"><float name="alpha_u" value="0.1"/><float name="alpha_v" value="0.2"/></bsdf>',
            "anisotropic",
        ),
        ('<bsdf type="twosided"><bsdf type="diffuse"/><bsdf type="plastic"/></bsdf>', "sides differ"),
    ],
)
def test_undrawable_materials_say_why_and_still_render(tmp_path, bsdf, reason):
    loaded = load(write(tmp_path, SENSOR + SKY + f'<shape type="cube">{bsdf}</shape>\n'))
    assert reason in loaded.scene.materials[0].undrawable
    with pytest.raises(EvalsuiteError, match=rf"line \d+.*{reason}"):
        loaded.scene.require_drawable()
    assert np.array(mi.load_dict({"type": "direct"}).render(loaded.mitsuba, 0, spp=4)).max() > 0


def test_shared_bsdf_is_one_material(tmp_path):
    body = '<bsdf type="diffuse" id="m"/>\n<shape type="cube"><ref id="m"/></shape>\n<shape type="disk"><ref id="m"/></shape>\n'
    scene = load(write(tmp_path, SENSOR + body)).scene
    assert [m.id for m in scene.materials] == ["m"] and [m.material for m in scene.meshes] == [0, 0]


@pytest.mark.parametrize("wrapped", [False, True])
def test_bindings_replace_a_bsdf_in_both_renderers(tmp_path, wrapped):
    inner = '<bsdf type="diffuse" id="subject"/>'
    bsdf = f'<bsdf type="twosided">{inner}</bsdf>' if wrapped else inner
    plugin = {"type": "blinnphong", "exponent": 9, "specular_reflectance": (0.5, 0.25, 0.125)}
    source = replace(write(tmp_path, SENSOR + f'<shape type="cube">{bsdf}</shape>\n'), bindings={"subject": plugin})
    loaded = load(source)
    (bound,) = loaded.scene.materials
    assert (bound.id, bound.plugin, bound.two_sided) == ("subject", "blinnphong", wrapped)
    assert bound.parameters == {"specular_reflectance": (0.5, 0.25, 0.125), "diffuse_reflectance": (0,) * 3, "exponent": 9.0}
    assert "exponent=9" in str(loaded.mitsuba.shapes()[0].bsdf())


def test_bad_bindings(tmp_path):
    source = write(tmp_path, SENSOR + BALL)
    for bindings, pattern in (
        ({"nobody": {"type": "phong"}}, r"nobody.*subject"),
        ({"subject": {"exponent": 3}}, "type"),
        ({"subject": {"type": "phong", "exponent": object()}}, "exponent"),
        ({"subject": {"type": "fong"}}, "fong"),
        ({"subject": {"type": "phong", "shine": 3}}, "shine"),
    ):
        with pytest.raises(EvalsuiteError, match=pattern):
            load(replace(source, bindings=bindings))


# ---- emitters -------------------------------------------------------------------------------------------------------


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


# ---- cameras --------------------------------------------------------------------------------------------------------


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
