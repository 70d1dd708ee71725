"""Free parameters: what they say in shader and twin, and that their defaults change nothing."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import context, worker
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.headroom import free_parameters

from .helpers import material, noise, scene, visible

ALBEDO = (0.5, 0.6, 0.7)
DIFFUSE = material("diffuse", reflectance=ALBEDO)
PHONG = material("phong", exponent=30.0, specular_reflectance=ALBEDO)
BLINN = material("blinnphong", exponent=30.0, specular_reflectance=ALBEDO)
BOTH = material("blinnphong", exponent=30.0, specular_reflectance=ALBEDO, diffuse_reflectance=(0.3, 0.2, 0.1))
CASES = [
    ("glossy-mcguire", BLINN, {"lod_offset": 0.7}),
    ("glossy-mcguire", BLINN, {"lod_offset": -1.3}),
    ("glossy-boxmip-lod", PHONG, {"lod_offset": 0.7}),
    ("glossy-boxmip-seamless", PHONG, {"lod_offset": 0.7}),
    ("mcguire-combined", BOTH, {"lod_offset": 0.7, "below_top": 1.4}),
    ("diffuse-topmip", DIFFUSE, {"below_top": 1.4}),
    ("diffuse-sh9", DIFFUSE, {"bands": 0}),
    ("diffuse-sh9", DIFFUSE, {"bands": 1}),
]


def drawn(name, subject, given):
    """Picture, twin's value and picture with no parameter given, at pixels that face the camera, (P, 3)."""
    env = noise(33, 64)
    s = scene(env, subject)
    settings = {"face_size": 32, **given}
    picture = worker.render(s, name, settings, supersample=1)
    mask, normal, to_view = visible(s)
    twin = TECHNIQUES[name].twin(env, normal, to_view, subject.parameters, picture.parameters)
    front = (normal * to_view).sum(-1) > 1e-3
    plain = worker.render(s, name, {"face_size": 32}, supersample=1).image[mask][front]
    return picture.image[mask][front], twin[front], plain


@pytest.mark.parametrize(("name", "subject", "given"), CASES, ids=lambda x: x if isinstance(x, str) else "")
def test_the_shader_is_its_twin_at_other_values_too(name, subject, given):
    picture, twin, plain = drawn(name, subject, given)
    bound = 1e-3 if context.is_software(context.get()) else 0.05
    assert np.abs(picture - twin).max() < bound * twin.mean()
    assert np.abs(picture - plain).max() > 0.02 * twin.mean()


@pytest.mark.parametrize(("name", "subject"), [("glossy-mcguire", BLINN), ("glossy-boxmip-lod", PHONG)])
def test_an_offset_of_one_level_is_a_quarter_of_the_exponent(name, subject):
    """m(s) + 1 = m(s′) with s′ + 1 = (s + 1)/4."""
    env = noise(33, 64)
    other = material(subject.plugin, exponent=31.0 / 4.0 - 1.0, specular_reflectance=ALBEDO)
    shifted = worker.render(scene(env, subject), name, {"lod_offset": 1.0}, supersample=1).image
    wider = worker.render(scene(env, other), name, {}, supersample=1).image
    np.testing.assert_allclose(shifted, wider, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("technique", [t for t in TECHNIQUES.values() if t.free], ids=lambda t: t.id)
def test_declarations(technique):
    for free in technique.free:
        (parameter,) = (p for p in technique.parameters if p.name == free.name)
        assert parameter.kind == "technique" and free.low < free.high and free.step > 0 and free.unit and free.published
        for value in (free.low, free.high, free.step):
            kind = int if free.whole else float
            if parameter.default is not None:
                assert parameter.parse(kind(value)) == value
        if parameter.default is not None:
            assert free.low <= parameter.default <= free.high
            picture = technique.parse({free.name: parameter.default})
            assert picture[free.name] == technique.defaults()[free.name]


def test_what_decides_the_truth_is_not_searched():
    wedges = TECHNIQUES["shadow-wedges"]
    assert [f.name for f in free_parameters(wedges, "direct")] == ["max_lights"]
    assert free_parameters(wedges, "discs") == [] and free_parameters(TECHNIQUES["mirror-cube"], "unoccluded") == []


def test_bands_are_whole():
    with pytest.raises(EvalsuiteError, match="0, 1 or 2"):
        TECHNIQUES["diffuse-sh9"].parse({"bands": 1.5})
