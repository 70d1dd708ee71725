"""Mirror and Lambert part through every target against closed forms: importance sampling with a delta lobe among others."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest

from evalsuite.math import fresnel
from evalsuite.reference import worker
from evalsuite.reference.integrators import TARGETS
from evalsuite.scene.model import SceneSource

# Those that the scene's own emitters light; what the environment is decomposed into has tests of its own.
LIT = [t.id for t in TARGETS.values() if not (t.id == "lookup" or t.within_room or t.decomposed)]
PASSES = 8
TILT = 35.0  # between the plane's normal and the view, hence the mirrored view too


def facing_plane(tmp_path, bsdf, emitter):
    """A plane whose normal is +y, seen from so far that the view direction is one. Its picture shows nothing else."""
    y, z = 600 * np.cos(np.radians(TILT)), 600 * np.sin(np.radians(TILT))
    sensor = f"""<sensor type="perspective"><float name="fov" value="0.05"/>
      <transform name="to_world"><lookat origin="0,{y},{z}" target="0,0,0" up="0,1,0"/></transform>
      <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>"""
    plane = f'<shape type="rectangle">{bsdf}<transform name="to_world"><rotate x="1" angle="-90"/></transform></shape>'
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene version="3.0.0">{sensor}{plane}{emitter}</scene>')
    return SceneSource(path)


def cap(tmp_path, degrees, radiance):
    """Environment of one radiance within an angle of +y and none beyond."""
    height, width = 256, 8
    v = np.arange(height) / (height - 1)
    share = np.clip((degrees / 180 - v) * (height - 1) + 0.5, 0, 1)  # a row counts as far as its ramp lies inside
    texels = np.ascontiguousarray(np.broadcast_to(radiance * share[:, None, None], (height, width, 3)), np.float32)
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": texels}) as file:
        file.write(str(tmp_path / "map.exr"))
    return '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'


@pytest.mark.parametrize("target", LIT)
@pytest.mark.parametrize("combine", ["add", "blend"])
@pytest.mark.parametrize("degrees", [20.0, 50.0])
def test_mirror_and_lambert_under_a_uniform_cap(tmp_path, target, combine, degrees):
    """E = π L sin²θ, and the mirror sees the cap or does not: L_o = F L [θ > tilt] + (1 − F or 1) k_d L sin²θ."""
    k_d, eta, radiance = np.array([0.6, 0.3, 0.0]), 2.5, 2.0
    bsdf = f"""<bsdf type="fresnelmirror"><float name="eta" value="{eta}"/><string name="combine" value="{combine}"/>
      <rgb name="diffuse_reflectance" value="{k_d[0]},{k_d[1]},{k_d[2]}"/></bsdf>"""
    source = facing_plane(tmp_path, bsdf, cap(tmp_path, degrees, radiance))
    state = worker.advance(source, target, None, PASSES)
    assert (worker.gbuffer(source).coverage == 1).all()
    f = fresnel.fresnel_dielectric(np.cos(np.radians(TILT)), eta)
    expected = f * radiance * (degrees > TILT)
    expected = expected + (1 - f if combine == "blend" else 1) * k_d * radiance * np.sin(np.radians(degrees)) ** 2
    mean = state.mean.mean((0, 1))
    error = np.sqrt((state.standard_error.astype(float) ** 2).sum((0, 1))) / state.mean[..., 0].size
    # 2e-4: the ramp of the cap's edge over one texel row.
    assert np.all(np.abs(mean - expected) < 5 * error + 2e-4 * radiance), (mean, expected, error)
    assert (error < 0.005 * radiance).all() and expected[0] > 0.05


@pytest.mark.parametrize("target", LIT)
@pytest.mark.parametrize("plugin", ["kautz", "fresnelmirror"])
def test_furnace(tmp_path, target, plugin):
    """In an environment of one radiance the picture is the albedo that Mitsuba's sampling gives, whatever the integrator."""
    own = {"diffuse_reflectance": 0.4} | ({"exponent": 12.0} if plugin == "kautz" else {"eta": 1.5})
    inside = "".join(f'<float name="{name}" value="{value}"/>' for name, value in own.items())
    constant = '<emitter type="constant"><rgb name="radiance" value="3,2,1"/></emitter>'
    source = facing_plane(tmp_path, f'<bsdf type="{plugin}">{inside}</bsdf>', constant)
    state = worker.advance(source, target, None, PASSES)
    albedo, albedo_error = worker.albedo({"type": plugin, **own}, [np.cos(np.radians(TILT))], 2**18)
    error = np.sqrt((state.standard_error.astype(float) ** 2).sum((0, 1))) / 64
    expected = albedo[0] * [3, 2, 1]
    assert np.all(np.abs(state.mean.mean((0, 1)) - expected) < 5 * np.hypot(error, albedo_error[0] * [3, 2, 1]) + 1e-4 * expected)
    assert expected.min() > 0.3 and (error / expected).max() < 0.01
