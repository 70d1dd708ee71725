"""Techniques that weigh parts by a Fresnel term or add them: closed forms, limits, and one technique against another."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import context, programs, worker
from evalsuite.gpu.plan import cannot_stand_for
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.math import fresnel, phong
from evalsuite.scene.model import Texture

from .helpers import FURNACE, camera, material, noise, scene, sphere_mesh, visible

ALBEDO = (0.5, 0.6, 0.7)
LIGHT = FURNACE.radiance[0, 0].astype(np.float64)

_SHADER = """layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer In { vec2 query[]; };
layout(std430, binding = 1) writeonly buffer Out { vec2 answer[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    vec2 q = query[i];
    answer[i] = vec2(fresnel_dielectric(q.x, q.y), fresnel_schlick(q.x, vec3(q.y)).g);
}
"""


def in_glsl(cosine, value) -> np.ndarray:
    """(N, 2): Eq 13 and Schlick's term of each (cosine, η or f_λ), by the GPU."""
    gl = context.get()
    shader = programs.compute((programs.part("library/dielectric.glsl"), programs.Part("query", _SHADER, own=True)))
    query = np.stack(np.broadcast_arrays(cosine, value), -1).astype(np.float32)
    source, out = gl.buffer(query.tobytes()), gl.buffer(reserve=query.nbytes)
    source.bind_to_storage_buffer(0)
    out.bind_to_storage_buffer(1)
    shader.run(len(query))
    gl.memory_barrier()
    return np.frombuffer(out.read(), np.float32).reshape(-1, 2).astype(np.float64)


@pytest.mark.parametrize("eta", [1.0001, 1.33, 1.5, 5.0, 200.0])
def test_glsl_fresnel_at_normal_incidence_brewsters_angle_and_89_degrees(eta):
    brewster = 1 / np.sqrt(1 + eta * eta)
    grazing = np.cos(np.radians(89.0))
    found = in_glsl([1.0, brewster, grazing], eta)[:, 0]
    t = np.sqrt(1 - (1 - grazing**2) / eta**2)
    at_89 = 0.5 * (((grazing - eta * t) / (grazing + eta * t)) ** 2 + ((eta * grazing - t) / (eta * grazing + t)) ** 2)
    closed = [((eta - 1) / (eta + 1)) ** 2, 0.5 * ((eta**2 - 1) / (eta**2 + 1)) ** 2, at_89]
    # float32: η² − 1 near η = 1 keeps 2⁻²⁴/(η − 1) of η's digits, squared.
    np.testing.assert_allclose(found, closed, rtol=1e-5 + 2.0**-21 / (eta - 1))


def test_glsl_fresnel_is_math_fresnel_over_all_angles():
    cosine, eta = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 101), [0.6, 1.0, 1.2, 1.5, 2.4, 5.0, 200.0]))
    found = in_glsl(cosine, eta)[:, 0]
    exact = fresnel.fresnel_dielectric(np.float32(cosine), np.float32(eta))
    # Total reflection sets in with a vertical tangent: float32 of g² there is worth √2⁻²³ of F.
    critical = (eta < 1) & (np.abs(eta**2 + cosine**2 - 1) < 1e-3)
    assert critical.sum() < 3
    np.testing.assert_allclose(found[~critical], exact[~critical], rtol=2e-5, atol=2e-7)
    assert not found[eta == 1.0].any()


def test_glsl_schlick():
    cosine, f = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 51), [0.0, 0.03, 0.42, 1.0]))
    np.testing.assert_allclose(in_glsl(cosine, f)[:, 1], fresnel.fresnel_schlick(cosine, f), rtol=2e-5, atol=1e-7)


def picture(env, subject, technique, **given):
    """Pixels (P, 3) of the object that face the viewer, and their n·v (P, 1)."""
    s = scene(env, subject)
    image = worker.render(s, technique, given, supersample=1).image.astype(np.float64)
    mask, normal, to_view = visible(s)
    cosine = (normal * to_view).sum(-1)
    front = cosine > 0.02
    assert front.sum() > 500
    return image[mask][front], cosine[front][:, None]


@pytest.mark.parametrize("eta", [1.5, 5.0, 200.0])
def test_furnace_of_the_fresnel_family(eta):
    """F L, (F + k_d) L and (F + (1 − F) k_d) L under one radiance."""
    own = {"eta": eta, "diffuse_reflectance": ALBEDO}
    for name, subject, diffuse in (
        ("fresnel-mirror", material("fresnelmirror", eta=eta, combine="add"), lambda f: 0 * f),
        ("fresnel-add", material("fresnelmirror", combine="add", **own), lambda f: 1 + 0 * f),
        ("fresnel-blend", material("fresnelmirror", combine="blend", **own), lambda f: 1 - f),
        ("fresnel-blend", material("plastic", **{**own, "eta": min(eta, 2.4)}), lambda f: 1 - f),
        ("fresnel-blend", material("fresnelmirror", combine="add", **own), lambda f: 1 + 0 * f),
    ):
        found, cosine = picture(FURNACE, subject, name)
        f = fresnel.fresnel_dielectric(cosine, subject.parameters["eta"])
        # 2e-3: what projecting a 16² cube on nine harmonics leaves of a constant.
        np.testing.assert_allclose(found, (f + diffuse(f) * ALBEDO) * LIGHT, rtol=2e-3, err_msg=f"{name} {subject.plugin}")


def test_equal_indices_leave_the_lambert_part_alone():
    own = {"eta": 1.0, "diffuse_reflectance": ALBEDO}
    env = noise()
    matte, _ = picture(env, material("diffuse", reflectance=ALBEDO), "diffuse-sh9")
    for combine, name in (("add", "fresnel-add"), ("blend", "fresnel-blend")):
        both, _ = picture(env, material("fresnelmirror", combine=combine, **own), name)
        np.testing.assert_allclose(both, matte, rtol=1e-6)
    nothing, _ = picture(env, material("fresnelmirror", eta=1.0, combine="add"), "fresnel-mirror")
    assert not nothing.any()


def test_a_dense_dielectric_is_a_mirror():
    env = noise()
    mirror, _ = picture(env, material("conductor", eta=0.0, k=1.0), "mirror-cube")
    dense, cosine = picture(env, material("fresnelmirror", eta=1e4, combine="add"), "fresnel-mirror")
    # 1 − F = 2/(η c) + 2c/η to first order, one term a polarisation.
    expected = 1 - (2 / cosine + 2 * cosine) / 1e4
    np.testing.assert_allclose(dense / mirror, np.broadcast_to(expected, dense.shape), atol=2e-4)


def test_the_parts_of_the_fresnel_family_add_up():
    env, eta = noise(), 1.8
    mirror, cosine = picture(env, material("fresnelmirror", eta=eta, combine="add"), "fresnel-mirror")
    matte, _ = picture(env, material("diffuse", reflectance=ALBEDO), "diffuse-sh9")
    own = {"eta": eta, "diffuse_reflectance": ALBEDO}
    added, _ = picture(env, material("fresnelmirror", combine="add", **own), "fresnel-add")
    blended, _ = picture(env, material("fresnelmirror", combine="blend", **own), "fresnel-blend")
    np.testing.assert_allclose(added, mirror + matte, rtol=1e-5)
    np.testing.assert_allclose(blended, mirror + (1 - fresnel.fresnel_dielectric(cosine, eta)) * matte, rtol=1e-4, atol=1e-5)


def test_a_plastics_specular_reflectance_scales_its_mirror_alone():
    env = noise()
    black = {"eta": 1.5, "diffuse_reflectance": 0.0}
    whole, _ = picture(env, material("plastic", **black), "fresnel-blend")
    half, _ = picture(env, material("plastic", specular_reflectance=0.5, **black), "fresnel-blend")
    assert whole.mean() > 0.01
    np.testing.assert_allclose(half, 0.5 * whole, rtol=1e-6)


# kautz-combined


@pytest.mark.parametrize("f_normal", [0.03, 0.42])
def test_furnace_of_kautz(f_normal):
    own = {"fresnel_normal": f_normal, "diffuse_reflectance": ALBEDO, "exponent": 30.0}
    found, cosine = picture(FURNACE, material("kautz", **own), "kautz-combined")
    f = fresnel.fresnel_schlick(cosine, f_normal)
    np.testing.assert_allclose(found, (f + (1 - f) * ALBEDO) * LIGHT, rtol=2e-3)


def test_kautz_with_full_reflectance_is_glossy_boxmip():
    env = noise(65, 128)
    glossy, _ = picture(env, material("phong", exponent=30.0), "glossy-boxmip")
    subject = material("kautz", fresnel_normal=1.0, diffuse_reflectance=0.5, exponent=30.0)
    both, _ = picture(env, subject, "kautz-combined")
    np.testing.assert_allclose(both, glossy, rtol=1e-5)


def test_kautz_of_a_colour():
    """f_λ is the colour of reflected white light: each channel has its own F."""
    found, cosine = picture(FURNACE, material("kautz", fresnel_normal=(0.1, 0.4, 0.9), exponent=30.0), "kautz-combined")
    np.testing.assert_allclose(found, fresnel.fresnel_schlick(cosine, [0.1, 0.4, 0.9]) * LIGHT, rtol=1e-4)


def test_a_roughplastic_says_its_exponent():
    subject = material("roughplastic", alpha=0.2, eta=1.5, diffuse_reflectance=0.3, distribution="ggx")
    exponent = (2 / 0.2**2 - 2) / 4
    s = scene(noise(65, 128), subject)
    settings = worker.resolve(s, "kautz-combined", {})
    assert settings["exponent"] == pytest.approx(exponent)
    own = {"fresnel_normal": 0.04, "diffuse_reflectance": 0.3, "exponent": exponent}
    same = worker.resolve(scene(noise(65, 128), material("kautz", **own)), "kautz-combined", {})
    assert settings["bias"] == pytest.approx(same["bias"], abs=1e-6)
    rough, _ = picture(noise(65, 128), subject, "kautz-combined")
    plain, _ = picture(noise(65, 128), material("kautz", **own), "kautz-combined")
    np.testing.assert_allclose(rough, plain, rtol=1e-5)
    assert worker.resolve(s, "kautz-combined", {"exponent": 9.0})["exponent"] == 9.0


def test_kautz_bias_gives_an_exponent_and_the_reverse():
    s = scene(noise(65, 128), material("kautz", exponent=40.0, fresnel_normal=0.2))
    filled = worker.resolve(s, "kautz-combined", {})
    back = worker.resolve(s, "kautz-combined", {"bias": filled["bias"]})
    assert filled["exponent"] == 40 and back["exponent"] == pytest.approx(40, rel=1e-5)
    assert filled["fresnel_normal"] == (0.2, 0.2, 0.2)


def test_kautz_targets():
    target = TECHNIQUES["kautz-combined"].target_bsdf
    own = {"fresnel_normal": (0.04, 0.04, 0.04), "diffuse_reflectance": (0.3, 0.3, 0.3), "exponent": 12.0}
    assert target({"bsdf": "kautz", **own}) == {"type": "kautz", **own}
    rough = target({"bsdf": "roughplastic", **own})
    assert rough["type"] == "roughplastic" and rough["int_ior"] == pytest.approx(1.5)
    assert phong.half_vector_to_phong_exponent(phong.alpha_to_exponent(rough["alpha"])) == pytest.approx(12.0)
    for bad in ((0.04, 0.05, 0.04), 0.0, 0.95):
        with pytest.raises(EvalsuiteError, match="one number"):
            target({"bsdf": "roughplastic", **own, "fresnel_normal": bad})


def test_a_narrow_half_vector_lobe_is_a_phong_lobe_of_a_quarter_of_the_exponent():
    s, theta = 4000.0, np.linspace(0, 0.05, 50)
    np.testing.assert_allclose(np.cos(theta / 2) ** s, np.cos(theta) ** phong.half_vector_to_phong_exponent(s), rtol=2e-3)
    assert phong.phong_to_half_vector_exponent(phong.half_vector_to_phong_exponent(s)) == s


@pytest.mark.parametrize(("exponent", "expected"), [(20, -0.27), (100, -0.05), (500, -0.003)])
def test_what_fresnel_outside_the_integral_leaves_out(exponent, expected):
    """Mean of F(h·v) over the lobe above the horizon against F(n·v), at n·v = 0.15 and f_λ = 0.03, as the assumption says."""
    c = 0.15
    s = np.sqrt(1 - c * c)
    cos_theta = ((np.arange(400) + 0.5) / 400)[:, None, None] ** (1 / (exponent + 1))
    phi = ((np.arange(180) + 0.5) / 90 * np.pi)[:, None]
    around = np.cos(phi) * [c, 0, s] + np.sin(phi) * [0, 1, 0]
    light = cos_theta * [-s, 0, c] + np.sqrt(1 - cos_theta**2) * around
    to_view = np.array([s, 0, c])
    half_vector = light + to_view
    half_vector /= np.linalg.norm(half_vector, axis=-1, keepdims=True)
    inside = fresnel.fresnel_schlick(half_vector @ to_view, 0.03)[light[..., 2] > 0].mean()
    assert inside / fresnel.fresnel_schlick(c, 0.03) - 1 == pytest.approx(expected, abs=0.006)


# mcguire-combined


@pytest.mark.parametrize("plugin", ["blinnphong", "phong"])
def test_mcguire_combined_is_the_sum_of_both_terms(plugin):
    env, own = noise(), {"exponent": 25.0, "specular_reflectance": (0.2, 0.4, 0.6)}
    both, _ = picture(env, material(plugin, diffuse_reflectance=ALBEDO, **own), "mcguire-combined")
    glossy, _ = picture(env, material(plugin, **own), "glossy-mcguire")
    matte, _ = picture(env, material("diffuse", reflectance=ALBEDO), "diffuse-topmip")
    np.testing.assert_allclose(both, glossy + matte, rtol=1e-5)


# Materials


def test_who_stands_for_which_combination():
    def reason(name, subject):
        return cannot_stand_for(TECHNIQUES[name], scene(FURNACE, subject))

    add = material("fresnelmirror", eta=1.5, combine="add", diffuse_reflectance=0.3)
    blend = material("fresnelmirror", eta=1.5, combine="blend", diffuse_reflectance=0.3)
    bare = material("fresnelmirror", eta=1.5, combine="blend", diffuse_reflectance=0.0)
    assert reason("fresnel-add", add) is None and "combine = blend" in reason("fresnel-add", blend)
    assert reason("fresnel-blend", blend) is None
    assert "diffuse part" in reason("fresnel-mirror", blend) and reason("fresnel-mirror", bare) is None
    assert reason("fresnel-add", bare) is None
    assert "fit of the reflection" in reason("fresnel-blend", material("plastic", eta=4.0))
    assert reason("fresnel-blend", material("plastic", eta=2.42)) is None
    assert "not for plastic" in reason("fresnel-add", material("plastic", eta=1.5))


@pytest.mark.parametrize("other", [
    material("fresnelmirror", eta=1.6, combine="add", diffuse_reflectance=0.2, name="other"),
    material("plastic", eta=1.6, diffuse_reflectance=0.2, name="other"),
    material("kautz", fresnel_normal=0.1, diffuse_reflectance=0.2, exponent=20.0, name="other"),
    material("roughplastic", eta=1.6, alpha=0.2, diffuse_reflectance=0.2, name="other"),
], ids=lambda m: m.plugin)  # fmt: skip
def test_companions_draw_them_beside_a_subject(other):
    meshes = [sphere_mesh(radius=0.8, centre=(-1, 0, 0)), sphere_mesh(radius=0.8, centre=(1, 0, 0), material=1)]
    s = scene(FURNACE, material("diffuse", name="subject"), other, meshes=meshes, subject=("subject",),
              view=camera((48, 32), fov=50.0))  # fmt: skip
    drawing = worker.render(s, "diffuse-sh9", {}, 2)
    whole = worker.gbuffer(s, 2).material[1] == 1
    assert not drawing.scored[whole].any() and whole.sum() > 100
    albedo = np.median(drawing.image[whole], axis=0) / LIGHT
    assert 0.2 < albedo.min() and albedo.max() < 0.4  # F + about (1 − F) k_d
    assert [m["technique"] for m in drawing.mapping][1] in ("fresnel-blend", "kautz-combined")


@pytest.mark.parametrize(("plugin", "name", "own"), [
    ("fresnelmirror", "fresnel-add", {"eta": 1.5, "combine": "add"}),
    ("fresnelmirror", "fresnel-blend", {"eta": 1.5, "combine": "blend"}),
    ("kautz", "kautz-combined", {"fresnel_normal": 0.1, "exponent": 20.0}),
    ("blinnphong", "mcguire-combined", {"exponent": 20.0, "specular_reflectance": 0.3}),
])  # fmt: skip
def test_a_bitmap_of_one_colour_is_that_colour(plugin, name, own):
    texels = np.broadcast_to(np.float32(ALBEDO), (2, 2, 3)).copy()
    env = noise()
    mapped, _ = picture(env, material(plugin, diffuse_reflectance=Texture(texels, np.eye(3)), **own), name)
    plain, _ = picture(env, material(plugin, diffuse_reflectance=ALBEDO, **own), name)
    assert plain.mean() > 0.05
    np.testing.assert_allclose(mapped, plain, rtol=1e-5)


@pytest.mark.parametrize(("name", "given", "message"), [
    ("fresnel-blend", {"eta": 0.0}, "0.01"), ("fresnel-blend", {"bsdf": "glass"}, "fresnelmirror or plastic"),
    ("kautz-combined", {"fresnel_normal": 1.2}, "between 0 and 1"), ("kautz-combined", {"exponent": -2}, "≥ 0"),
])  # fmt: skip
def test_bad_parameters_are_named(name, given, message):
    with pytest.raises(EvalsuiteError, match=message):
        TECHNIQUES[name].parse(given)
