"""`phong` and `blinnphong`: sampling by chi-square, values against the formulas, energy against quadrature."""

import math

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.reference import worker
from evalsuite.reference.variants import activate

mi = activate()
import drjit as dr  # noqa: E402 (after activate, which chooses the LLVM)


def phong(v, light, exponent, specular=1.0, diffuse=0.0):
    """BRDF × cos, float64, for directions (..., 3) in the shading frame."""
    r_dot_l = -v[..., 0] * light[..., 0] - v[..., 1] * light[..., 1] + v[..., 2] * light[..., 2]
    lobe = np.where(r_dot_l > 0, np.maximum(r_dot_l, 1e-300) ** exponent, 0.0)
    return diffuse / np.pi * light[..., 2] + specular * (exponent + 1) / (2 * np.pi) * lobe


def blinnphong(v, light, exponent, specular=1.0, diffuse=0.0):
    half = v + light
    cosine = half[..., 2] / np.linalg.norm(half, axis=-1)
    return (diffuse + specular * (exponent + 8) / 8 * cosine**exponent) / np.pi * light[..., 2]


FORMULA = {"phong": phong, "blinnphong": blinnphong}


def hemisphere(count, seed):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def interaction(v):
    si = dr.zeros(mi.SurfaceInteraction3f, len(v))
    si.wi = vectors(v)
    return si


def vectors(rows):
    return mi.Vector3f(np.ascontiguousarray(rows.T.astype(np.float32)))


def evaluate(plugin, v, light):
    bsdf = mi.load_dict(plugin)
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), interaction(v), vectors(light))
    return np.array(value).T, np.array(pdf)


CHI2 = [
    (name, exponent, angle, diffuse)
    for name in FORMULA
    for exponent in (0.0, 1.0, 7.5, 50.0, 1000.0)
    for angle in (0.0, 20.0, 60.0, 88.0)
    for diffuse in (0.0, 0.5)
    # The test's own quadrature, regular in azimuth and cosine, cannot integrate lobes this narrow about the pole, nor ones
    # squeezed in azimuth at grazing angles; 1000 at 20° and 60° covers the sampling of narrow lobes.
    if exponent < 1000.0 or 0.0 < angle < 88.0
]


@pytest.mark.parametrize(("name", "exponent", "angle", "diffuse"), CHI2)
def test_sampling_follows_the_density(name, exponent, angle, diffuse, tmp_path, monkeypatch):
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain

    monkeypatch.chdir(tmp_path)  # a failing test writes a file
    theta = math.radians(angle)
    sample, pdf = BSDFAdapter(
        name,
        f'<float name="exponent" value="{exponent}"/><float name="diffuse_reflectance" value="{diffuse}"/>',
        wi=mi.Vector3f(math.sin(theta), 0, math.cos(theta)),
    )
    test = ChiSquareTest(SphericalDomain(), sample, pdf, sample_dim=3, sample_count=10**6, res=101, ires=32)
    assert test.run(significance_level=0.01, test_count=len(CHI2), quiet=True), test.messages


def test_chi_square_rejects_a_density_three_percent_off():
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain

    sample, pdf = BSDFAdapter("phong", '<float name="exponent" value="20"/>', wi=mi.Vector3f(0, 0, 1))
    test = ChiSquareTest(SphericalDomain(), sample, lambda d: 1.03 * pdf(d), sample_dim=3, sample_count=10**6, res=101, ires=32)
    assert not test.run(significance_level=0.01, quiet=True)


@pytest.mark.parametrize("name", list(FORMULA))
@pytest.mark.parametrize("exponent", [0.0, 0.5, 8.0, 300.0])
def test_values_are_the_formula(name, exponent):
    v, light = hemisphere(20000, 1), hemisphere(20000, 2)
    value, _ = evaluate({"type": name, "exponent": exponent, "specular_reflectance": 0.7, "diffuse_reflectance": 0.2}, v, light)
    expected = FORMULA[name](v, light, exponent, 0.7, 0.2)
    assert expected.max() > 0.15
    # float32: the cosine carries 2^-22, its power exponent times as much.
    np.testing.assert_allclose(value[:, 0], expected, rtol=1e-5 + 5e-7 * exponent, atol=1e-7)


@pytest.mark.parametrize("name", list(FORMULA))
def test_below_the_horizon_is_black(name):
    v, light = hemisphere(1000, 1), hemisphere(1000, 2)
    down = light * [1, 1, -1]
    for a, b in ((v, down), (v * [1, 1, -1], light), (v * [1, 1, -1], down)):
        value, pdf = evaluate({"type": name, "exponent": 2.0, "diffuse_reflectance": 0.3}, a, b)
        assert not value.any() and not pdf.any()
    value, pdf = evaluate({"type": name, "exponent": 2.0, "diffuse_reflectance": 0.3}, v, light)
    assert value.all() and pdf.all()


@pytest.mark.parametrize("exponent", [0.0, 3.0, 80.0])
def test_blinnphong_is_reciprocal_and_phong_symmetric_with_the_cosine(exponent):
    v, light = hemisphere(20000, 3), hemisphere(20000, 4)
    for name in FORMULA:
        plugin = {"type": name, "exponent": exponent, "specular_reflectance": 0.6}
        there, back = evaluate(plugin, v, light)[0][:, 0], evaluate(plugin, light, v)[0][:, 0]
        assert (there > 1e-6).mean() > 0.05
        if name == "blinnphong":  # f itself: divide the cosine out
            there, back = there / light[:, 2], back / v[:, 2]
        np.testing.assert_allclose(there, back, rtol=1e-5 + 5e-7 * exponent, atol=1e-6)
    if exponent > 0:  # and Phong's f is not reciprocal, because of its 1/(n·l)
        there = evaluate({"type": "phong", "exponent": exponent}, v, light)[0][:, 0] / light[:, 2]
        back = evaluate({"type": "phong", "exponent": exponent}, light, v)[0][:, 0] / v[:, 2]
        assert np.abs(there - back).max() > 0.1


def quadrature_albedo(name, cosine, exponent):
    """∫ f cos dl by Gauss-Legendre in cos θ and a regular rule in azimuth."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    z, w = (nodes + 1) / 2, weights / 2
    phi = (np.arange(800) + 0.5) / 800 * 2 * np.pi
    s = np.sqrt(1 - z**2)
    light = np.stack([s[:, None] * np.cos(phi), s[:, None] * np.sin(phi), np.broadcast_to(z[:, None], (400, 800))], -1)
    v = np.array([math.sqrt(1 - cosine**2), 0.0, cosine])
    return float((FORMULA[name](v, light, exponent) * w[:, None]).sum() * 2 * np.pi / 800)


@pytest.mark.parametrize("name", list(FORMULA))
@pytest.mark.parametrize("exponent", [0.0, 4.0, 60.0, 1000.0])
def test_albedo(name, exponent):
    cosines = [1.0, 0.5, 0.1]
    plugin = {"type": name, "exponent": exponent, "specular_reflectance": (0.6, 0.3, 0.0), "diffuse_reflectance": 0.2}
    mean, error = worker.albedo(plugin, cosines, 2**17)
    for k, cosine in enumerate(cosines):
        lobe = quadrature_albedo(name, cosine, exponent)
        expected = [0.2 + ks * lobe for ks in (0.6, 0.3, 0.0)]
        # 5 sigma of 36 comparisons; 1e-4 for the float32 power at exponent 1000.
        assert np.all(np.abs(mean[k] - expected) < 5 * error[k] + 1e-4), (mean[k], expected, error[k])
        assert np.all(error[k] < 0.005)


def test_phong_keeps_its_specular_reflectance_at_normal_incidence():
    for exponent in (0.0, 5.0, 500.0):
        mean, _ = worker.albedo({"type": "phong", "exponent": exponent, "specular_reflectance": 0.8}, [1.0])
        assert mean[0] == pytest.approx([0.8] * 3, rel=1e-4)


@pytest.mark.parametrize("name", list(FORMULA))
@pytest.mark.parametrize("exponent", [0.0, 20.0, 1000.0])
def test_sample_eval_and_pdf_agree(name, exponent):
    bsdf = mi.load_dict({"type": name, "exponent": exponent, "diffuse_reflectance": 0.3, "specular_reflectance": 0.5})
    si, context = interaction(hemisphere(5000, 6)), mi.BSDFContext()
    rng = mi.PCG32(size=5000)
    sample, weight = bsdf.sample(context, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
    value, pdf = bsdf.eval_pdf(context, si, sample.wo)
    assert np.array_equal(np.array(value), np.array(bsdf.eval(context, si, sample.wo)))
    assert np.array_equal(np.array(pdf), np.array(bsdf.pdf(context, si, sample.wo)))
    taken = np.array(sample.pdf) > 0
    assert taken.mean() > 0.5
    np.testing.assert_allclose(np.array(sample.pdf)[taken], np.array(pdf)[taken], rtol=1e-6)
    ratio = np.array(value)[:, taken] / np.array(pdf)[taken]
    np.testing.assert_allclose(np.array(weight)[:, taken], ratio, rtol=1e-4, atol=1e-7)


def test_textured_reflectance_and_twosided():
    def texture():  # a tensor is consumed by the plugin that is made of it
        return {"type": "bitmap", "raw": True, "data": mi.TensorXf(np.full((2, 2, 3), [0.1, 0.2, 0.3], np.float32))}

    v = light = np.array([[0.0, 0.6, 0.8]])
    flat, _ = evaluate(
        {"type": "blinnphong", "exponent": 3.0, "specular_reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}, v, light
    )
    textured, _ = evaluate({"type": "blinnphong", "exponent": 3.0, "specular_reflectance": texture()}, v, light)
    below, _ = evaluate(
        {"type": "twosided", "bsdf": {"type": "blinnphong", "exponent": 3.0, "specular_reflectance": texture()}}, -v, -light
    )
    assert flat.min() > 0.01
    np.testing.assert_allclose(textured, flat, rtol=1e-6)
    np.testing.assert_allclose(below, flat, rtol=1e-6)


def test_traverse_changes_the_value():
    bsdf = mi.load_dict({"type": "phong", "exponent": 2.0})
    parameters = mi.traverse(bsdf)
    assert {"exponent", "specular_reflectance.value", "diffuse_reflectance.value"} <= set(parameters.keys())
    parameters["exponent"] = 10.0
    parameters.update()
    v = np.array([[0.0, 0.0, 1.0]])
    value = bsdf.eval(mi.BSDFContext(), interaction(v), vectors(v))
    assert np.ravel(np.array(value))[0] == pytest.approx(11 / (2 * np.pi), rel=1e-6)


@pytest.mark.parametrize("exponent", [-1.0, float("nan"), float("inf")])
def test_bad_exponent(exponent):
    with pytest.raises((EvalsuiteError, RuntimeError), match="finite exponent"):
        mi.load_dict({"type": "phong", "exponent": exponent})


@pytest.mark.parametrize("name", ["specular_reflectance", "diffuse_reflectance"])
@pytest.mark.parametrize("value", [-0.1, 1.5])
def test_bad_reflectance(name, value):
    with pytest.raises((EvalsuiteError, RuntimeError), match="between 0 and 1"):
        mi.load_dict({"type": "blinnphong", name: value})
