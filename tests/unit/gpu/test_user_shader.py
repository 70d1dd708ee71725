"""Every name that docs/adding-a-technique.md promises a user's shader, held to what it says it is."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.gpu import camera, draw
from evalsuite.gpu.prefilter import brdf_table
from evalsuite.gpu.techniques import common, user_shader
from evalsuite.math import phong, sh
from evalsuite.math.sphere import latlong_lookup

from .helpers import material, noise, rotation, scene, visible

SUBJECT = material("phong", exponent=12.0, specular_reflectance=(0.2, 0.4, 0.6), diffuse_reflectance=(0.3, 0.2, 0.1))
ENVIRONMENT = noise(to_world=rotation())


def promised(n, v, s):
    alpha = float(phong.exponent_to_alpha(12.0))
    cube = common.twin_cube(s.environment, 32)
    table = brdf_table.lookup((n * v).sum(-1), alpha)
    one = np.ones_like(n)
    return {
        "s.normal": n,
        "s.to_view": v,
        "textureLod(env_cube, s.normal, 1.0).rgb": cube.bilinear(n, 1),
        "vec3(env_face_size, env_max_level, time)": one * (32, 5, 2.5),
        "env_radiance(s.normal)": latlong_lookup(s.environment.radiance, n @ s.environment.to_world),
        "irradiance(s.normal)": sh.irradiance(common.twin_sh9(s.environment, 32), n),
        "vec3(textureLod(brdf_table, vec2(dot(s.normal, s.to_view), sqrt(alpha)), 0.0).rg, alpha)": np.column_stack(
            [table, np.full(len(n), alpha)]
        ),
        "diffuse_reflectance": one * (0.3, 0.2, 0.1),
        "specular_reflectance * fresnel_conductor(0.5, eta, k)": one * (0.2, 0.4, 0.6),
        "vec3(exponent, gain, float(steps))": one * (12, 0.25, 3),
        "camera_position": one * camera.position(s.camera),
        "camera_axis": one * camera.viewing_axis(s.camera),
    }


@pytest.mark.parametrize("number", range(12))
def test_a_promised_name_is_what_the_page_says(number, tmp_path):
    s = scene(ENVIRONMENT, SUBJECT, size=(32, 32))
    mask, normal, to_view = visible(s)
    front = (normal * to_view).sum(-1) > 0.05
    name, expected = list(promised(normal, to_view, s).items())[number]
    file = tmp_path / "mine.glsl"
    file.write_text(f"uniform float gain = 1.0;\nuniform int steps = 3;  // of it\nvec3 shade(Surface s) {{ return {name}; }}\n")
    technique = user_shader.load(file)
    picture = draw.draw(s, technique, technique.parse({"face_size": 32, "time": 2.5, "gain": 0.25}), supersample=1).image
    assert front.sum() > 200
    np.testing.assert_allclose(picture[mask][front], expected[front], atol=1e-3 * np.abs(expected).max())


def test_holes_that_a_shader_leaves_count(tmp_path):
    """What discards shows the background and is scored all the same: a hole is an error, not a silhouette."""
    s = scene(ENVIRONMENT, SUBJECT, size=(32, 32))
    mask, normal, _ = visible(s)
    pictures = {}
    for name, code in (("whole", ""), ("holed", "if (s.normal.x > 0.0) discard; ")):
        file = tmp_path / f"{name}.glsl"
        file.write_text(f"vec3 shade(Surface s) {{ {code}return vec3(7.0); }}\n")
        pictures[name] = draw.draw(s, user_shader.load(file), {}, supersample=2)
    whole, holed = pictures.values()
    np.testing.assert_array_equal(whole.scored, holed.scored)
    assert (holed.scored[mask] > 0).all() and holed.scored[~mask].max() < 1
    hole = np.zeros(mask.shape, bool)
    hole[mask] = normal[:, 0] > 0.1
    hole &= whole.scored == 1
    assert hole.sum() > 50 and (holed.image[hole] != 7.0).all() and (whole.image[hole] == 7.0).all()
