"""Each technique against its float64 twin, closed forms, and quadrature."""

from __future__ import annotations

from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import context, worker
from evalsuite.gpu.plan import cannot_stand_for
from evalsuite.gpu.reflection import reflection
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.gpu.techniques.glossy_boxmip import fit_exponent
from evalsuite.math import cubemap, phong, sh
from evalsuite.math.sphere import latlong_directions
from evalsuite.scene.model import TriangleMesh

from .helpers import FURNACE, camera, material, noise, ramp, rotation, scene, sphere_mesh, visible
from .helpers import environment as environment_of

ALBEDO = (0.5, 0.6, 0.7)
GOLD = {"eta": (0.2, 0.9, 1.1), "k": (3.9, 2.4, 2.2)}
CASES = [
    ("diffuse-sh9", material("diffuse", reflectance=ALBEDO), {}),
    ("diffuse-sh9", material("diffuse", reflectance=ALBEDO), {"sh_face_size": 8}),
    ("diffuse-topmip", material("diffuse", reflectance=ALBEDO), {}),
    ("glossy-mcguire", material("blinnphong", exponent=30.0, specular_reflectance=ALBEDO), {}),
    ("glossy-mcguire", material("phong", exponent=1.0, specular_reflectance=ALBEDO), {"face_size": 32}),
    ("glossy-mcguire", material("roughconductor", alpha=0.2, specular_reflectance=ALBEDO, **GOLD), {}),
    ("glossy-boxmip", material("phong", exponent=30.0, specular_reflectance=ALBEDO), {}),
    ("mirror-cube", material("conductor", specular_reflectance=ALBEDO, **GOLD), {}),
    ("mirror-cube", material("conductor", eta=0.0, k=1.0), {"face_size": 16}),
]


@pytest.mark.parametrize("make", [lambda: FURNACE, ramp, lambda: noise(to_world=rotation())], ids=["furnace", "ramp", "noise"])
@pytest.mark.parametrize(("name", "subject", "given"), CASES, ids=lambda x: x if isinstance(x, str) else "")
def test_shader_is_its_twin(name, subject, given, make):
    env = make()
    s = scene(env, subject)
    settings = worker.resolve(s, name, given)
    picture = worker.render(s, name, settings, supersample=1).image
    mask, normal, to_view = visible(s)
    if name == "glossy-boxmip":
        settings = {**settings, "lambda": reflection(s, settings["face_size"], frozenset({0}))[1][mask]}
    twin = TECHNIQUES[name].twin(env, normal, to_view, subject.parameters, settings)
    front = (normal * to_view).sum(-1) > 0
    assert front.sum() > 500 and twin[front].mean() > 0.05
    difference = np.abs(picture[mask] - twin)[front] / twin[front].mean()
    if name == "glossy-boxmip":
        # llvmpipe's log₂ for λ is up to 0.043 short: that much of the step between two MIP levels of the map. GPUs take
        # more of the latitude that OpenGL leaves (8.14.1): any footprint between the longer side and the sum of both.
        exact = context.is_software(context.get())
        bound = 1e-5 if env is FURNACE else (0.15 if exact else 0.4)
        assert difference.mean() < (0.01 if exact else 0.04)
    elif context.is_software(context.get()):
        bound = 2e-4  # float32 coordinates of r and of the resampled map, against white noise
    else:
        bound = 0.05  # GPUs round filter weights to 8 bits
    assert difference.max() < bound
    if not (mask.all()):
        assert picture[~mask].max() > 0  # the background


@pytest.mark.parametrize(("name", "subject", "tolerance"), [
    ("diffuse-sh9", material("diffuse", reflectance=ALBEDO), 2e-3),
    ("diffuse-topmip", material("diffuse", reflectance=ALBEDO), 2e-3),
    ("glossy-mcguire", material("blinnphong", exponent=12.0, specular_reflectance=ALBEDO), 1e-5),
    ("glossy-boxmip", material("phong", exponent=12.0, specular_reflectance=ALBEDO), 1e-5),
    ("mirror-cube", material("conductor", eta=0.0, k=1.0, specular_reflectance=ALBEDO), 1e-5),
])  # fmt: skip
def test_furnace(name, subject, tolerance):
    drawing = worker.render(scene(FURNACE, subject), name, {}, supersample=2)
    whole = drawing.scored == 1
    expected = np.array(ALBEDO) * FURNACE.radiance[0, 0]
    lit = whole & (drawing.image[..., 0] > 0.9 * expected[0])  # the rim's last normals face away: black, as in Mitsuba
    assert lit.sum() > 0.97 * whole.sum() > 500
    np.testing.assert_allclose(drawing.image[lit], np.broadcast_to(expected, (lit.sum(), 3)), rtol=tolerance)
    sky = drawing.scored == 0
    np.testing.assert_allclose(drawing.image[sky & (sky.cumsum(0) > 0)][0], FURNACE.radiance[0, 0], rtol=1e-6)


def test_sh9_is_exact_under_a_degree_2_map():
    coefficients = np.random.default_rng(8).normal(size=(9, 3)) * 0.1
    coefficients[0] = 3.0
    env = environment_of(sh.basis(latlong_directions(128, 256)) @ coefficients)
    s = scene(env, material("diffuse", reflectance=ALBEDO))
    picture = worker.render(s, "diffuse-sh9", {}, supersample=1).image
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0
    exact = np.array(ALBEDO) / np.pi * sh.irradiance(coefficients, normal)
    # What is left is the map's own: bilinear interpolation between 1.4° texels, δ²/8 · 6 ≈ 5e-4 of degree 2.
    np.testing.assert_allclose(picture[mask][front], exact[front], rtol=1e-3)


def test_sh9_per_vertex_is_close_to_per_pixel():
    s = scene(noise(), material("diffuse", reflectance=ALBEDO))
    pixel, vertex = (worker.render(s, "diffuse-sh9", {"per": per}, 1).image for per in ("pixel", "vertex"))
    assert not np.array_equal(pixel, vertex)
    np.testing.assert_allclose(vertex, pixel, rtol=0.05, atol=0.02)


def test_mcguire_reads_the_level_of_the_formula():
    """A map that is 1 on one cube face alone, exponent so low that the level is 1 × 1: look-ups blend six face means."""
    cube = np.zeros((6, 16, 16, 3))
    cube[4] = 1
    assert phong.exponent_to_lod(0.0, 16) == pytest.approx(np.log2(16 * np.sqrt(3)))
    s = scene(noise(), material("blinnphong", exponent=0.0))
    top = worker.render(s, "glossy-mcguire", {}, 1).image
    finest = worker.render(scene(noise(), material("blinnphong", exponent=1e6)), "glossy-mcguire", {}, 1).image
    mask, *_ = visible(s)
    assert top[mask].std() < 0.5 * finest[mask].std()


@pytest.mark.parametrize("subject", [
    material("diffuse", reflectance=ALBEDO),
    material("phong", exponent=20.0, specular_reflectance=ALBEDO, diffuse_reflectance=0.2),
    material("blinnphong", exponent=20.0, specular_reflectance=ALBEDO, diffuse_reflectance=0.2),
], ids=lambda m: m.plugin)  # fmt: skip
@pytest.mark.parametrize("make", [ramp, lambda: noise(9, 16, to_world=rotation())], ids=["ramp", "noise"])
def test_brute_force_is_the_integral(subject, make):
    """Z-test against midpoint quadrature over the map, Šidák-corrected over pixels and channels."""
    env = make()
    s = scene(env, subject, size=(14, 14))
    drawing = worker.render(s, "brute-force", {"samples": 8192}, supersample=1)
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0.02
    parameters = {**subject.parameters, "plugin": subject.plugin}
    truth = TECHNIQUES["brute-force"].twin(env, normal[front], to_view[front], parameters, {"cells": 6})
    error = drawing.standard_error[mask][front].astype(np.float64)
    relative = error / truth
    assert 1e-4 < relative.mean() < 0.03
    z = (drawing.image[mask][front] - truth) / error
    assert z.size > 200
    bound = NormalDist().inv_cdf(1 - 0.5 * (1 - 0.99 ** (1 / z.size)))
    # Sharp horizons leave the quadrature short by up to 0.1 % of the integral.
    assert np.abs(z).max() < bound + 1e-3 * (truth / error).max()
    assert 0.85 < z.std() < 1.15  # the standard error is neither too large nor too small
    assert abs(z.mean()) < 5 / np.sqrt(len(z))  # channels share their directions


def test_brute_force_standard_error_falls_with_samples():
    s = scene(noise(), material("diffuse", reflectance=ALBEDO), size=(16, 16))
    few, many = (worker.render(s, "brute-force", {"samples": n}, 2) for n in (256, 4096))
    whole = few.scored == 1
    assert few.standard_error[whole].mean() / many.standard_error[whole].mean() == pytest.approx(4, rel=0.1)
    assert (few.standard_error[few.scored == 0] == 0).all()


def test_brute_force_counts_every_sample_of_a_long_run():
    """llvmpipe leaves a shader's loops after 65535 turns in all, unsaid: the error would be divided by samples never taken."""
    s = scene(noise(), material("diffuse", reflectance=ALBEDO), size=(8, 8))
    few, many = (worker.render(s, "brute-force", {"samples": n}, 1) for n in (4096, 65536))
    whole = few.scored == 1
    assert few.standard_error[whole].mean() / many.standard_error[whole].mean() == pytest.approx(4, rel=0.1)


def test_brute_force_needs_two_pairs_a_sub_sample():
    with pytest.raises(EvalsuiteError, match="at least 64"):
        worker.render(scene(FURNACE, material("diffuse")), "brute-force", {"samples": 32}, 4)


def test_brute_force_under_no_light_is_black():
    s = scene(environment_of(np.zeros((4, 8, 3))), material("phong", exponent=5.0), size=(8, 8))
    drawing = worker.render(s, "brute-force", {"samples": 64}, 2)
    assert not drawing.image.any() and not drawing.standard_error.any()


def test_pictures_are_bit_identical_and_seeds_differ():
    s = scene(noise(), material("phong", exponent=20.0), size=(32, 32))
    for name, given in (("glossy-boxmip", {}), ("brute-force", {"samples": 64})):
        a, b = (worker.render(s, name, given, 2) for _ in range(2))
        assert a.image.tobytes() == b.image.tobytes() and a.scored.tobytes() == b.scored.tobytes()
    c = worker.render(s, "brute-force", {"samples": 64}, 2, seed=1)
    assert c.image.tobytes() != b.image.tobytes()


# glossy-boxmip: λ, bias and exponent


def test_lambda_is_that_of_the_reflected_directions():
    # One triangle over the whole picture: helper pixels of a quad then belong to the same normals.
    normals = np.array([[-0.5, -0.4, 1], [0.9, -0.3, 1], [0.1, 0.8, 1]], np.float32)
    corners = np.array([[-9, -6, 0], [9, -6, 0], [0, 9, 0]], np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    triangle = TriangleMesh("triangle", corners, normals, np.array([[0, 1, 2]], np.uint32), 0)
    s = scene(FURNACE, material("phong", exponent=20.0, two_sided=True), size=(64, 64), meshes=[triangle])
    direction, lod, mask = reflection(s, 32, frozenset({0}))
    assert mask.all() and lod.std() > 0.05
    # OpenGL's rows run upwards and derivatives are those of 2 × 2 quads: compare at each quad's first pixel.
    expected = cubemap.reflection_lod(direction[::-1], 32)[::2, ::2]
    np.testing.assert_allclose(lod[::-1][::2, ::2], expected, atol=1e-3)  # float32 differences of r


def test_bias_and_exponent_are_each_others_inverse():
    s = scene(noise(65, 128), material("phong", exponent=40.0))
    filled = worker.resolve(s, "glossy-boxmip", {})
    assert filled["exponent"] == 40 and filled["face_size"] == 32
    _, lod, mask = reflection(s, 32, frozenset({0}))
    assert lod[mask].mean() + filled["bias"] == pytest.approx(float(phong.exponent_to_lod(40.0, 32)), abs=1e-5)
    back = worker.resolve(s, "glossy-boxmip", {"bias": filled["bias"]})
    assert back["exponent"] == pytest.approx(40, rel=1e-5)
    assert worker.resolve(s, "glossy-boxmip", {"bias": 1.0, "exponent": 7.0})["exponent"] == 7.0
    assert worker.resolve(s, "glossy-boxmip", filled) == filled


def test_resolve_looks_at_the_subject_whatever_its_bsdf():
    plain = scene(noise(65, 128), material("diffuse", name="subject"), subject=("subject",))
    shiny = scene(noise(65, 128), material("phong", name="subject", exponent=9.0), subject=("subject",))
    given = {"exponent": 9.0}
    assert worker.resolve(plain, "glossy-boxmip", given)["bias"] == worker.resolve(shiny, "glossy-boxmip", {})["bias"]


def test_fit_finds_the_exponent_of_a_true_lobe():
    level = np.random.default_rng(9).gamma(0.5, size=(6, 16, 16, 3))
    directions, omega = cubemap.texel_directions(16).reshape(-1, 3), np.tile(cubemap.texel_solid_angles(16).ravel(), 6)
    r = cubemap.texel_directions(8).reshape(-1, 3)
    lobe = np.maximum(r @ directions.T, 0) ** 23.0 * omega
    truth = lobe @ level.reshape(-1, 3) / lobe.sum(1, keepdims=True)
    found = fit_exponent(cubemap.SeamlessCube(cubemap.box_mips(level)), r, truth)
    assert found["exponent"] == pytest.approx(23, rel=0.02) and found["rel_rmse"] < 0.01


def test_boxmip_reports_its_best_exponent():
    drawing = worker.render(scene(noise(65, 128), material("phong", exponent=40.0)), "glossy-boxmip", {}, 1)
    assert 4 < drawing.fit["exponent"] < 400 and 0 < drawing.fit["rel_rmse"] < 1
    assert worker.render(scene(FURNACE, material("phong", exponent=40.0)), "glossy-boxmip", {}, 1).fit is None


# What stands for what


def test_companions_draw_what_the_technique_cannot_and_are_not_scored():
    left, right = sphere_mesh(radius=0.8, centre=(-1, 0, 0)), sphere_mesh(radius=0.8, centre=(1, 0, 0), material=1)
    s = scene(noise(), material("diffuse", reflectance=ALBEDO), material("phong", exponent=10.0, diffuse_reflectance=0.1),
              meshes=[left, right], view=camera((48, 32), fov=50.0))  # fmt: skip
    drawing = worker.render(s, "diffuse-sh9", {}, 2)
    g = worker.gbuffer(s, 2)
    np.testing.assert_array_equal(drawing.scored, g.material[0])
    assert [(m["material"], m["technique"], m["scored"]) for m in drawing.mapping] == [
        ("diffuse", "diffuse-sh9", True), ("phong", "glossy-mcguire", False)]  # fmt: skip
    assert any("glossy-mcguire and not scored" in note and "diffuse part" in note for note in drawing.notes)
    assert drawing.image[g.material[1] == 1].mean() > 0.01


def test_only_the_subject_is_scored():
    meshes = [sphere_mesh(radius=0.8, centre=(-1, 0, 0)), sphere_mesh(radius=0.8, centre=(1, 0, 0), material=1)]
    s = scene(FURNACE, material("diffuse"), material("diffuse", name="subject"), meshes=meshes, subject=("subject",))
    np.testing.assert_array_equal(worker.render(s, "diffuse-topmip", {}, 2).scored, worker.gbuffer(s, 2).material[1])


def test_a_technique_that_stands_for_nothing_here_says_why():
    s = scene(FURNACE, material("conductor", eta=0.0, k=1.0))
    assert "not for conductor" in cannot_stand_for(TECHNIQUES["diffuse-sh9"], s)
    assert cannot_stand_for(TECHNIQUES["mirror-cube"], s) is None
    with pytest.raises(EvalsuiteError, match=r"test\.xml: got conductor: .* stands for \(diffuse\)"):
        worker.render(s, "diffuse-sh9", {})
    mixed = scene(FURNACE, material("phong", exponent=5.0, diffuse_reflectance=0.2))
    assert "diffuse part" in cannot_stand_for(TECHNIQUES["glossy-boxmip"], mixed)


def test_backs_of_one_sided_materials_are_black():
    for two_sided in (False, True):
        s = scene(FURNACE, material("diffuse", two_sided=two_sided, reflectance=0.5), origin=(0, 0, 0.1))
        image = worker.render(s, "diffuse-topmip", {}, 1).image
        assert image.any() == two_sided
        if two_sided:
            np.testing.assert_allclose(image[24, 24], 0.5 * FURNACE.radiance[0, 0], rtol=1e-5)


# Bad input


@pytest.mark.parametrize(("given", "message"), [
    ({"nonsense": 1}, "parameter 'nonsense'"), ({"face_size": 100}, "power of two"), ({"face_size": "big"}, "power of two"),
    ({"per": "face"}, "pixel or vertex"), ({"reflectance": "red"}, "colour"),
])  # fmt: skip
def test_bad_parameters_are_named(given, message):
    with pytest.raises(EvalsuiteError, match=message):
        worker.resolve(scene(FURNACE, material("diffuse")), "diffuse-sh9", given)


def test_unknown_technique():
    with pytest.raises(EvalsuiteError, match="diffuse-sh9"):
        worker.resolve(scene(FURNACE, material("diffuse")), "difuse", {})


def test_compile_errors_point_at_the_users_line(tmp_path, monkeypatch):
    file = tmp_path / "mein glanz.glsl"
    file.write_text(
        "// mine\n\nvec3 shade(Surface s) {\n    float x = 1.0;\n    return undefined_thing * x;\n}\n", encoding="utf-8"
    )
    broken = replace(TECHNIQUES["diffuse-topmip"], shader=file)
    monkeypatch.setitem(TECHNIQUES, "diffuse-topmip", broken)
    s = scene(FURNACE, material("diffuse"))
    with pytest.raises(EvalsuiteError) as caught:
        worker.render(s, "diffuse-topmip", {})
    assert caught.value.where == f"{file}:5"
    assert "undefined_thing" in caught.value.got and "`return undefined_thing * x;`" in caught.value.got
    file.write_text("vec3 colour(Surface s) { return vec3(1.0); }\n", encoding="utf-8")
    with pytest.raises(EvalsuiteError, match="no function `shade`"):
        worker.render(s, "diffuse-topmip", {})
    file.write_text("vec3 shade(Surface s) { return vec3(0.25); }\n", encoding="utf-8")
    assert worker.render(s, "diffuse-topmip", {}, 1).image[24, 24, 0] == 0.25


def test_silhouettes_are_shaded_and_the_inside_of_a_one_sided_sphere_is_black():
    """A coarse sphere has smooth normals that turn away from the viewer on triangles that face him; an engine shades them."""
    clay = material("diffuse", reflectance=0.5)
    outside = scene(FURNACE, clay, meshes=[sphere_mesh(segments=24, rings=12)], size=(96, 96))
    drawing = worker.render(outside, "diffuse-sh9", {})
    whole = drawing.scored >= 1
    expected = 0.5 * FURNACE.radiance[0, 0]
    assert whole.sum() > 3000 and np.abs(drawing.image[whole] / expected - 1).max() < 2e-3
    around = scene(FURNACE, clay, meshes=[sphere_mesh(radius=30.0)], size=(32, 32))
    assert not worker.render(around, "diffuse-sh9", {}).image.any()
