"""Assumptions given up one by one: what each technique's rungs are, where they vanish, and that a fault shows in its own."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from evalsuite.gpu import context, worker
from evalsuite.gpu.draw import draw
from evalsuite.gpu.lifted import lifted
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.gpu.techniques.base import ARITHMETIC, KERNEL, LOOKUP, REPRESENTATION
from evalsuite.scene import builtin
from evalsuite.scene.environment import read_environment
from evalsuite.scene.model import Material

from .helpers import FURNACE, scene

LIFTED = [t for t in TECHNIQUES.values() if t.lifted(t.defaults())]
SMALL = {
    "glossy-warped": {"face_size": 32, "map_size": 16},
    "glossy-isotropic-3d": {"face_size": 32, "map_size": 16, "slices": 4},
    "split-sum": {"face_size": 32, "map_size": 32, "samples": 16},
    "glossy-hierarchical": {"map_size": 128},
}


@cache
def named(name: str):
    return read_environment(builtin.environment_path(name))


def sphere(technique, env, **more):
    parameters = dict(technique.target_bsdf(technique.defaults() | more))
    plugin = str(parameters.pop("type"))
    if parameters.pop("material", None) == "none":
        parameters |= {"eta": 0.0, "k": 1.0}
    return scene(env, Material("subject", plugin, parameters), subject=("subject",), size=(40, 40))


def pictures(technique, env, **given):
    s = sphere(technique, env)
    drawing = worker.render(s, technique.id, {**SMALL.get(technique.id, {}), **given}, supersample=2)
    found = worker.lifted(s, technique.id, drawing.parameters, supersample=2)
    return drawing.image.astype(np.float64), found, drawing.scored == 1


def off(a, b, mask) -> float:
    """Root mean square difference over the mean."""
    return float(np.sqrt(((a - b)[mask] ** 2).mean()) / b[mask].mean())


def test_every_technique_that_draws_light_at_a_point_says_how_it_is_lifted():
    without = {t.id for t in TECHNIQUES.values() if not t.lifted(t.defaults()) and t.target != LOOKUP}
    assert without == {"acquire", "brute-force", "shadow-wedges", "shadow-sampled", "shadow-pcss"}
    for technique in LIFTED:
        causes = [lift.cause for lift in technique.lifted(technique.defaults())]
        assert len(set(causes)) == len(causes) and technique.left not in causes


@pytest.mark.parametrize("technique", LIFTED, ids=lambda t: t.id)
def test_the_first_rung_is_the_shader_s_arithmetic(technique):
    image, found, mask = pictures(technique, named("office"))
    assert mask.sum() > 300 and found.images[0].shape == image.shape
    # Hardware's own λ belongs to the shader's side: llvmpipe's log₂ is up to 0.043 levels short.
    own_lod = technique.id in ("glossy-boxmip", "kautz-combined")
    bound = 0.05 if own_lod or not context.is_software(context.get()) else 2e-3
    assert off(image, found.images[0], mask) < bound
    assert (found.images[0][~mask] == 0).all()


@pytest.mark.parametrize("technique", [t for t in LIFTED if t.id != "glossy-warped"], ids=lambda t: t.id)
def test_in_a_furnace_no_texels_and_no_filter_matter(technique):
    _, found, mask = pictures(technique, FURNACE)
    for before, after in zip(found.images, found.images[1:], strict=False):
        assert off(after, before, mask) < 2e-4
    if found.swapped is not None:
        assert off(found.swapped, found.images[-1], mask) < 2e-4


def test_a_band_limit_costs_nothing_below_it():
    _, found, mask = pictures(TECHNIQUES["diffuse-sh9"], named("sh2"), face_size=128)
    assert found.causes == (ARITHMETIC, REPRESENTATION, KERNEL)
    assert off(found.images[1], found.images[2], mask) < 1e-3
    _, office, mask = pictures(TECHNIQUES["diffuse-sh9"], named("office"), face_size=128)
    assert off(office.images[1], office.images[2], mask) > 0.01


def test_fewer_texels_cost_more_in_their_own_rung():
    def costs(size):
        _, found, mask = pictures(TECHNIQUES["mirror-cube"], named("office"), face_size=size)
        return off(found.images[0], found.images[1], mask)

    assert costs(16) > 2 * costs(64) > 4 * costs(512)


def test_another_order_ends_at_the_same_picture_s_cost():
    _, found, mask = pictures(TECHNIQUES["glossy-mcguire"], named("office"), face_size=8, exponent=20)
    formula, finer, lobe = found.images
    assert off(found.swapped, lobe, mask) > 1e-3, "eight texels a face are coarse"
    # Both ways round from the formula to the exact lobe.
    one = (finer - formula) + (lobe - finer)
    other = (found.swapped - formula) + (lobe - found.swapped)
    np.testing.assert_allclose(one, other, atol=1e-12)


#: A constant level, one face looked up in the place of its opposite, a missing 1 − F.
FAULTS = {
    "glossy-mcguire": ("float level = exponent_to_lod(exponent, env_face_size) + lod_offset;", "float level = 1.0;"),
    "mirror-cube": (
        "vec3 r = reflect(-s.to_view, s.normal);",
        "vec3 r = reflect(-s.to_view, s.normal);\n    if (r.x > max(abs(r.y), abs(r.z))) r.x = -r.x;",
    ),
    "fresnel-blend": ("(1.0 - coat * fresnel)", "1.0"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_in_a_shader_shows_in_the_first_rung_alone(name, tmp_path):
    """The picture leaves its formula; the formula's own rungs stay where they are."""
    technique, settings = TECHNIQUES[name], {"face_size": 32}
    s = sphere(technique, named("office"))
    right = draw(s, technique, settings, 2)
    text, (sound, faulty) = technique.shader.read_text(), FAULTS[name]
    assert sound in text
    (tmp_path / technique.shader.name).write_text(text.replace(sound, faulty))
    wrong = draw(s, replace(technique, shader=tmp_path / technique.shader.name), settings, 2)
    found, mask = lifted(s, technique, right.parameters, 2), right.scored == 1
    assert off(right.image.astype(float), found.images[0], mask) < 2e-3
    assert off(wrong.image.astype(float), found.images[0], mask) > 0.05


def test_bitmaps_leave_the_technique_as_one_rung():
    from evalsuite.reference import worker as reference
    from evalsuite.scene.model import SceneSource

    model = reference.load_model(SceneSource(builtin.scene_path("crate"), None, (32, 32), {}, False, {}))
    technique = TECHNIQUES["diffuse-sh9"]
    found = lifted(model, technique, technique.resolved(model, {"face_size": 16}), 1)
    assert found.images == () and "bitmap" in found.note
