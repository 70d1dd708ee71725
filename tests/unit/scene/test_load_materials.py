"""Materials of Mitsuba XML: what they are called, what is refused, what replaces them."""

from dataclasses import replace

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.reference.variants import activate
from evalsuite.scene.load import load
from tests.unit.scene.written import BALL, SENSOR, SKY, write

mi = activate()


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
