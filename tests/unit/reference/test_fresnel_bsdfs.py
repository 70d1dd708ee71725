"""`fresnelmirror` and `kautz`: sampling, values, energy; and textured reflectances of every plugin of ours."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.math import fresnel
from evalsuite.math.phong import phong_lobe
from evalsuite.reference import worker
from evalsuite.reference.variants import activate

mi = activate()
import drjit as dr  # noqa: E402 (after activate, which chooses the LLVM)

EXPONENTS, ANGLES = (0.0, 1.0, 7.5, 50.0, 1000.0), (0.0, 20.0, 60.0, 88.0)
# What the test's own quadrature cannot integrate is left out, as in test_bsdfs.
KAUTZ = [(n, a, k) for n in EXPONENTS for a in ANGLES for k in (0.0, 0.5) if n < 1000.0 or 0.0 < a < 88.0]
MIRROR = [(eta, a, combine) for eta in (1.0, 1.5, 5.0) for a in (0.0, 60.0, 88.0) for combine in ("add", "blend")]


def towards(degrees):
    return mi.Vector3f(math.sin(math.radians(degrees)), 0, math.cos(math.radians(degrees)))


def smooth_context():
    """All but the delta lobe, which has no density."""
    context = mi.BSDFContext()
    context.type_mask = mi.BSDFFlags.Smooth
    return context


def chi_square(plugin, degrees, count, uv=(0.5, 0.5)):
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain

    sample, pdf = BSDFAdapter(plugin["type"], plugin, wi=towards(degrees), uv=mi.Point2f(*uv), ctx=smooth_context())
    test = ChiSquareTest(SphericalDomain(), sample, pdf, sample_dim=3, sample_count=10**6, res=101, ires=32)
    return test.run(significance_level=0.01, test_count=count, quiet=True), test


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a failing chi-square test writes a file


@pytest.mark.parametrize(("exponent", "angle", "diffuse"), KAUTZ)
def test_kautz_sampling_follows_the_density(exponent, angle, diffuse):
    plugin = {"type": "kautz", "exponent": exponent, "diffuse_reflectance": diffuse, "fresnel_normal": 0.26}
    passed, test = chi_square(plugin, angle, len(KAUTZ))
    assert passed, test.messages


@pytest.mark.parametrize(("eta", "angle", "combine"), MIRROR)
def test_fresnelmirror_sampling_of_the_smooth_part_follows_the_density(eta, angle, combine):
    plugin = {"type": "fresnelmirror", "eta": eta, "combine": combine, "diffuse_reflectance": 0.5}
    passed, test = chi_square(plugin, angle, len(MIRROR))
    assert passed, test.messages


TEXELS = np.array([[[0.9, 0.8, 0.7], [0.0, 0.0, 0.0]], [[0.05, 0.1, 0.2], [0.3, 0.6, 0.1]]], np.float32)
TEXTURED = [
    ("phong", "specular_reflectance", {"diffuse_reflectance": 0.3}),
    ("phong", "diffuse_reflectance", {}),
    ("blinnphong", "specular_reflectance", {"diffuse_reflectance": 0.3}),
    ("blinnphong", "diffuse_reflectance", {}),
    ("kautz", "fresnel_normal", {"diffuse_reflectance": 0.3}),
    ("kautz", "diffuse_reflectance", {}),
    ("fresnelmirror", "diffuse_reflectance", {"combine": "blend"}),
]
POINTS = {(0.25, 0.25): (0, 0), (0.75, 0.75): (1, 1), (0.25, 0.75): (1, 0)}


def texture():
    """A tensor is consumed by the plugin made of it: a new one each time."""
    return {"type": "bitmap", "raw": True, "filter_type": "nearest", "data": mi.TensorXf(TEXELS)}


@pytest.mark.parametrize(("name", "parameter", "more"), TEXTURED)
@pytest.mark.parametrize("uv", POINTS)
def test_textured_sampling_follows_the_density_of_each_texel(name, parameter, more, uv):
    exponent = {} if name == "fresnelmirror" else {"exponent": 20.0}
    # The adapter makes the plugin anew at every call, and a tensor serves one alone: a file serves all.
    mi.Bitmap(TEXELS).write("texels.exr")
    bitmap = {"type": "bitmap", "raw": True, "filter_type": "nearest", "filename": "texels.exr"}
    passed, test = chi_square({"type": name, parameter: bitmap, **exponent, **more}, 40.0, 3 * len(TEXTURED), uv)
    assert passed, test.messages


@pytest.mark.parametrize(("name", "parameter", "more"), TEXTURED)
def test_a_textured_reflectance_is_that_of_its_texel(name, parameter, more):
    v, light = hemisphere(500, 1), hemisphere(500, 2)
    textured = mi.load_dict({"type": name, parameter: texture(), **more})
    values = {}
    for uv, texel in POINTS.items():
        flat = mi.load_dict({"type": name, parameter: {"type": "rgb", "value": [float(x) for x in TEXELS[texel]]}, **more})
        values[uv] = evaluate(textured, v, light, uv)
        np.testing.assert_allclose(values[uv], evaluate(flat, v, light), rtol=1e-5, atol=1e-7)
    assert not np.allclose(values[0.25, 0.25], values[0.75, 0.75])


def hemisphere(count, seed):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def vectors(rows):
    return mi.Vector3f(np.ascontiguousarray(rows.T.astype(np.float32)))


def interaction(v, uv=(0.5, 0.5)):
    si = dr.zeros(mi.SurfaceInteraction3f, len(v))
    si.wi, si.uv = vectors(v), mi.Point2f(*uv)
    return si


def evaluate(bsdf, v, light, uv=(0.5, 0.5)):
    return np.array(bsdf.eval(mi.BSDFContext(), interaction(v, uv), vectors(light))).T


@pytest.mark.parametrize("exponent", [0.0, 8.0, 300.0])
def test_kautz_is_equation_8(exponent):
    v, light = hemisphere(20000, 1), hemisphere(20000, 2)
    f = {"type": "rgb", "value": [0.03, 0.26, 0.9]}
    value = evaluate(
        mi.load_dict({"type": "kautz", "exponent": exponent, "fresnel_normal": f, "diffuse_reflectance": 0.4}), v, light
    )
    weight = fresnel.fresnel_schlick(v[:, 2:], [0.03, 0.26, 0.9])
    r_l = -v[:, 0] * light[:, 0] - v[:, 1] * light[:, 1] + v[:, 2] * light[:, 2]
    lobe = phong_lobe(exponent, r_l) if exponent else (r_l > 0) / (2 * np.pi)
    expected = (1 - weight) * 0.4 / np.pi * light[:, 2:] + weight * lobe[:, None]
    assert expected.max() > 0.15
    np.testing.assert_allclose(value, expected, rtol=2e-5 + 5e-7 * exponent, atol=2e-7)


@pytest.mark.parametrize("eta", [1.0, 1.5, 5.0, 200.0])
@pytest.mark.parametrize("combine", ["add", "blend"])
def test_fresnelmirrors_smooth_part_is_lambert(eta, combine):
    v, light = hemisphere(5000, 1), hemisphere(5000, 2)
    bsdf = mi.load_dict({"type": "fresnelmirror", "eta": eta, "combine": combine, "diffuse_reflectance": 0.4})
    weight = 1 - fresnel.fresnel_dielectric(v[:, 2:], eta) if combine == "blend" else 1.0
    expected = np.broadcast_to(weight * 0.4 / np.pi * light[:, 2:], (5000, 3))
    assert expected.max() > 1e-3
    np.testing.assert_allclose(evaluate(bsdf, v, light), expected, rtol=1e-4, atol=1e-6)


def test_mitsubas_own_fresnel_is_equation_13():
    cosine = np.linspace(0.001, 1, 500)
    for eta in (1.0, 1.33, 1.5, 5.0, 200.0):
        theirs = np.array(mi.fresnel(mi.Float(cosine), mi.Float(eta))[0])
        np.testing.assert_allclose(theirs, fresnel.fresnel_dielectric(cosine, eta), rtol=2e-4, atol=2e-6)


@pytest.mark.parametrize("name", ["kautz", "fresnelmirror"])
def test_below_the_horizon_is_black(name):
    v, light = hemisphere(1000, 1), hemisphere(1000, 2)
    bsdf, down = mi.load_dict({"type": name, "diffuse_reflectance": 0.3}), light * [1, 1, -1]
    for a, b in ((v, down), (v * [1, 1, -1], light), (v * [1, 1, -1], down)):
        assert not evaluate(bsdf, a, b).any()
        assert not np.array(bsdf.pdf(mi.BSDFContext(), interaction(a), vectors(b))).any()
    _, weight = bsdf.sample(mi.BSDFContext(), interaction(v * [1, 1, -1]), mi.Float(0.3), mi.Point2f(0.2, 0.7))
    assert not np.array(weight).any()
    assert evaluate(bsdf, v, light).all()


COSINES = [1.0, 0.5547001962252291, 0.1]  # the second is Brewster's angle of 1.5


@pytest.mark.parametrize("eta", [1.0, 1.5, 5.0, 200.0])
def test_furnace_of_the_delta_part(eta):
    """Alone, the mirror returns F itself; nothing at all for η = 1."""
    mean, _ = worker.albedo({"type": "fresnelmirror", "eta": eta}, COSINES, 2**12)
    expected = fresnel.fresnel_dielectric(COSINES, eta)
    np.testing.assert_allclose(mean, np.broadcast_to(expected[:, None], (3, 3)), rtol=1e-5, atol=1e-7)
    assert (mean == 0).all() if eta == 1 else (mean > 0.03).all()


@pytest.mark.parametrize("eta", [1.5, 5.0])
@pytest.mark.parametrize("combine", ["add", "blend"])
def test_energy_of_both_parts(eta, combine):
    k_d = np.array([0.8, 0.4, 0.0])
    plugin = {"type": "fresnelmirror", "eta": eta, "combine": combine, "diffuse_reflectance": tuple(k_d)}
    mean, error = worker.albedo(plugin, COSINES, 2**17)
    f = fresnel.fresnel_dielectric(COSINES, eta)[:, None]
    expected = f + (1 - f if combine == "blend" else 1.0) * k_d
    assert np.all(np.abs(mean - expected) < 5 * error + 1e-5) and error.max() < 0.005
    if combine == "blend":
        assert mean.max() <= 1 + 1e-5  # a coat over a base gives back no more than it gets


@pytest.mark.parametrize("exponent", [0.0, 4.0, 60.0, 1000.0])
def test_energy_of_kautz(exponent):
    """(1 − F) k_d + F times the unclipped part of the lobe, by quadrature."""
    k_d, f_normal = np.array([0.8, 0.4, 0.0]), np.array([0.05, 0.3, 1.0])
    plugin = {"type": "kautz", "exponent": exponent, "diffuse_reflectance": tuple(k_d), "fresnel_normal": tuple(f_normal)}
    mean, error = worker.albedo(plugin, COSINES, 2**17)
    nodes, weights = np.polynomial.legendre.leggauss(400)
    z, w, phi = (nodes + 1) / 2, weights / 2, (np.arange(800) + 0.5) / 800 * 2 * np.pi
    for k, cosine in enumerate(COSINES):
        r_l = np.sqrt(1 - z[:, None] ** 2) * math.sqrt(1 - cosine**2) * np.cos(phi) + z[:, None] * cosine
        lobe = float((np.where(r_l > 0, phong_lobe(exponent, r_l), 0.0) * w[:, None]).sum() * 2 * np.pi / 800)
        f = fresnel.fresnel_schlick(cosine, f_normal)
        expected = (1 - f) * k_d + f * lobe
        assert np.all(np.abs(mean[k] - expected) < 5 * error[k] + 1e-4), (mean[k], expected, error[k])
    assert error.max() < 0.005 and (mean - 5 * error).max() <= 1 + 1e-4


@pytest.mark.parametrize("plugin", [
    {"type": "kautz", "exponent": 30.0, "fresnel_normal": 0.2, "diffuse_reflectance": 0.3},
    {"type": "fresnelmirror", "eta": 1.5, "combine": "add", "diffuse_reflectance": 0.3},
    {"type": "fresnelmirror", "eta": 3.0, "combine": "blend", "diffuse_reflectance": 0.3},
], ids=lambda p: p["type"])  # fmt: skip
def test_sample_eval_and_pdf_agree(plugin):
    bsdf = mi.load_dict(plugin)
    si, context = interaction(hemisphere(5000, 6)), mi.BSDFContext()
    rng = mi.PCG32(size=5000)
    sample, weight = bsdf.sample(context, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
    smooth = ~np.array(mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)) & (np.array(sample.pdf) > 0)
    value, pdf = bsdf.eval_pdf(context, si, sample.wo)
    assert 0.1 < smooth.mean()
    np.testing.assert_allclose(np.array(sample.pdf)[smooth], np.array(pdf)[smooth], rtol=1e-5)
    ratio = np.array(value)[:, smooth] / np.array(pdf)[smooth]
    np.testing.assert_allclose(np.array(weight)[:, smooth], ratio, rtol=1e-4, atol=1e-7)


def test_the_context_chooses_the_lobe():
    bsdf, si = mi.load_dict({"type": "fresnelmirror", "diffuse_reflectance": 0.5}), interaction(hemisphere(2000, 3))
    rng = mi.PCG32(size=2000)
    for flag, delta in ((mi.BSDFFlags.DeltaReflection, True), (mi.BSDFFlags.DiffuseReflection, False)):
        context = mi.BSDFContext()
        context.type_mask = flag
        sample, weight = bsdf.sample(context, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
        assert (np.array(mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)) == delta).all()
        assert np.array(weight).all()
        assert bool(np.array(bsdf.eval(context, si, sample.wo)).any()) != delta


def test_traverse_changes_the_value():
    bsdf = mi.load_dict({"type": "fresnelmirror", "eta": 1.5})
    parameters = mi.traverse(bsdf)
    assert {"eta", "diffuse_reflectance.value"} <= set(parameters.keys())
    parameters["eta"] = 3.0
    parameters.update()
    v = np.array([[0.0, 0.0, 1.0]])
    _, weight = bsdf.sample(mi.BSDFContext(), interaction(v), mi.Float(0.0), mi.Point2f(0.5, 0.5))
    assert np.ravel(np.array(weight))[0] == pytest.approx(0.25, rel=1e-6)


@pytest.mark.parametrize(("plugin", "message"), [
    ({"type": "fresnelmirror", "eta": 0.0}, "refraction > 0"),
    ({"type": "fresnelmirror", "eta": float("nan")}, "refraction > 0"),
    ({"type": "fresnelmirror", "combine": "mix"}, "add or blend"),
    ({"type": "fresnelmirror", "diffuse_reflectance": 1.5}, "between 0 and 1"),
    ({"type": "kautz", "fresnel_normal": -0.1}, "between 0 and 1"),
    ({"type": "kautz", "exponent": -1.0}, "finite exponent"),
])  # fmt: skip
def test_bad_parameters(plugin, message):
    with pytest.raises((EvalsuiteError, RuntimeError), match=message):
        mi.load_dict(plugin)


def test_mitsubas_plastic_is_no_truth_for_dense_coats():
    """Why `fresnel-blend` refuses plastic beyond η = 2.5: Mitsuba's fit of the internal reflection, and its albedo, fail."""
    cosine = (np.arange(20000) + 0.5) / 20000

    def fit_and_quadrature(eta):
        text = str(mi.load_dict({"type": "plastic", "int_ior": eta, "ext_ior": 1.0}))
        fit = float(text.split("fdr_int = ")[1].split(",")[0])
        return fit, 2 * np.mean(cosine * fresnel.fresnel_dielectric(cosine, 1 / eta))

    for eta in (1.33, 1.5, 2.0, 2.5):
        fit, exact = fit_and_quadrature(eta)
        assert 1 - fit == pytest.approx(1 - exact, rel=0.045)
    fit, exact = fit_and_quadrature(4.0)
    assert fit > 1 > 0.97 > exact
    dense, _ = worker.albedo({"type": "plastic", "int_ior": 4.0, "ext_ior": 1.0}, [1.0], 2**14)
    assert dense.max() < 0
