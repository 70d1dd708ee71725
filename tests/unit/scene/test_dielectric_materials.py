"""The coated BSDFs as the scene model states them: from files, and bound in place of others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.reference.variants import activate
from evalsuite.scene.load import load
from evalsuite.scene.model import SceneSource, Texture

activate()

SCENE = """<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
  <shape type="sphere">{}</shape><emitter type="constant"><float name="radiance" value="2"/></emitter></scene>
"""
GREY = (0.5, 0.5, 0.5)


def read(tmp_path, bsdf, **bindings):
    path = tmp_path / "scene.xml"
    path.write_text(SCENE.format(bsdf), encoding="utf-8")
    scene = load(replace(SceneSource(path), bindings=bindings)).scene
    return scene.materials[scene.used_materials[0]]


CASES = {
    "plastic": ('<float name="int_ior" value="1.9"/><float name="ext_ior" value="1.0"/><boolean name="nonlinear" value="true"/>',
                {"eta": 1.9, "diffuse_reflectance": GREY, "specular_reflectance": (1, 1, 1), "nonlinear": True}),
    "roughplastic": ('<float name="int_ior" value="1.5"/><float name="ext_ior" value="1.0"/><float name="alpha" value="0.3"/>'
                     '<string name="distribution" value="ggx"/><rgb name="specular_reflectance" value="0.1,0.2,0.3"/>',
                     {"eta": 1.5, "diffuse_reflectance": GREY, "specular_reflectance": (0.1, 0.2, 0.3), "nonlinear": False,
                      "alpha": 0.3, "distribution": "ggx"}),
    "fresnelmirror": ('<float name="eta" value="5"/><string name="combine" value="blend"/>',
                      {"eta": 5.0, "diffuse_reflectance": (0, 0, 0), "combine": "blend"}),
    "kautz": ('<rgb name="fresnel_normal" value="0.03,0.1,0.4"/><float name="exponent" value="7"/>',
              {"fresnel_normal": (0.03, 0.1, 0.4), "diffuse_reflectance": (0, 0, 0), "exponent": 7.0}),
}  # fmt: skip


@pytest.mark.parametrize("plugin", CASES)
@pytest.mark.parametrize("wrap", ["{}", '<bsdf type="twosided">{}</bsdf>'])
def test_parameters_of_a_file(tmp_path, plugin, wrap):
    inside, expected = CASES[plugin]
    material = read(tmp_path, wrap.format(f'<bsdf type="{plugin}">{inside}</bsdf>'))
    assert material.plugin == plugin and material.undrawable is None and material.two_sided == (wrap != "{}")
    assert list(material.parameters) == list(expected)
    for name, value in expected.items():
        if isinstance(value, str | bool):
            assert material.parameters[name] is value or material.parameters[name] == value
            assert type(material.parameters[name]) is type(value)
        else:
            np.testing.assert_allclose(material.parameters[name], value, rtol=1e-3)  # 1.000277 is Mitsuba's air
            assert np.ndim(material.parameters[name]) == np.ndim(value)


def test_defaults(tmp_path):
    assert read(tmp_path, '<bsdf type="fresnelmirror"/>').parameters["combine"] == "add"
    plastic = read(tmp_path, '<bsdf type="plastic"/>').parameters
    assert plastic["eta"] == pytest.approx(1.49 / 1.000277) and plastic["nonlinear"] is False
    rough = read(tmp_path, '<bsdf type="roughplastic"/>').parameters
    assert rough["distribution"] == "beckmann" and rough["alpha"] == pytest.approx(0.1)


@pytest.mark.parametrize("plugin", CASES)
def test_a_bitmap_as_diffuse_reflectance(tmp_path, plugin):
    import mitsuba as mi

    mi.Bitmap(np.full((2, 2, 3), 0.25, np.float32)).write(str(tmp_path / "map.exr"))
    inside = CASES[plugin][0]
    texture = '<texture type="bitmap" name="diffuse_reflectance"><string name="filename" value="map.exr"/></texture>'
    material = read(tmp_path, f'<bsdf type="{plugin}">{inside}{texture}</bsdf>')
    assert material.undrawable is None
    found = material.parameters["diffuse_reflectance"]
    assert isinstance(found, Texture)
    np.testing.assert_allclose(found.texels, 0.25, rtol=1e-3)


def test_a_bitmap_as_f_lambda_is_mitsubas_alone(tmp_path):
    import mitsuba as mi

    mi.Bitmap(np.full((2, 2, 3), 0.25, np.float32)).write(str(tmp_path / "map.exr"))
    texture = '<texture type="bitmap" name="fresnel_normal"><string name="filename" value="map.exr"/></texture>'
    assert read(tmp_path, f'<bsdf type="kautz">{texture}</bsdf>').undrawable == "textured fresnel_normal"


@pytest.mark.parametrize(("name", "given"), [
    ("fresnel-mirror", {"eta": 5.0}), ("fresnel-add", {"eta": 200.0}), ("fresnel-blend", {}),
    ("fresnel-blend", {"bsdf": "plastic", "eta": 1.8}), ("kautz-combined", {"fresnel_normal": (0.1, 0.2, 0.3)}),
    ("kautz-combined", {"bsdf": "roughplastic", "exponent": 12.0}), ("mcguire-combined", {"exponent": 20.0}),
])  # fmt: skip
def test_targets_load_and_are_stood_for(tmp_path, name, given):
    """What a report binds to the subject is what the technique takes, with the values it was given."""
    technique = TECHNIQUES[name]
    bsdf = technique.target_bsdf(technique.defaults() | given)
    material = read(tmp_path, '<bsdf type="diffuse" id="subject"/>', subject=bsdf)
    assert material.plugin == bsdf["type"] and technique.reason_against(material) is None
    uniforms = technique.stands_for[material.plugin].uniforms(material, technique.defaults() | given | {"bias": 1.0})
    if "eta" in given:
        np.testing.assert_allclose(uniforms["eta"], given["eta"], rtol=1e-6)
    if name == "kautz-combined":
        np.testing.assert_allclose(uniforms["fresnel_normal"], given.get("fresnel_normal", 0.1), rtol=1e-5)
    if "diffuse_reflectance" in technique.defaults():
        np.testing.assert_allclose(uniforms["diffuse_reflectance"], GREY, rtol=1e-6)
