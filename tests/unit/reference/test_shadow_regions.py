"""The part of the area lights' light that arrives: against a half-plane's closed form, and lights that see or do not see."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.lights import decompose
from evalsuite.lights.model import Decomposition, DecompositionSettings, Light
from evalsuite.reference import worker
from evalsuite.scene.model import SceneSource

SETTINGS = DecompositionSettings()
FLOOR = """<shape type="rectangle"><bsdf type="diffuse"/>
  <transform name="to_world"><scale value="60"/><rotate x="1" angle="-90"/></transform></shape>"""
#: Covers x < 0 at height 1; the camera looks along under it.
ROOF = """<shape type="rectangle"><bsdf type="twosided"><bsdf type="diffuse"/></bsdf>
  <transform name="to_world"><scale value="50"/><rotate x="1" angle="90"/><translate x="-50" y="1"/></transform></shape>"""


def scene(tmp_path, shapes, emitter='<emitter type="constant"/>'):
    path = tmp_path / "scene.xml"
    path.write_text(f"""<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="30"/>
      <transform name="to_world"><lookat origin="0,0.6,1.5" target="0,0,0" up="0,1,0"/></transform>
      <film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="64"/></film></sensor>
      {shapes}{emitter}</scene>""")
    return SceneSource(path)


@pytest.fixture
def lit_by(monkeypatch):
    """lit_by(light, …): what every environment is taken apart into."""

    def into(*lights):
        found = Decomposition(lights, np.zeros((4, 8, 3), np.float32))
        monkeypatch.setattr(decompose, "of", lambda environment, settings: found)

    return into


def light(direction, degrees, irradiance=1.0):
    d = np.asarray(direction, float) / np.linalg.norm(direction)
    return Light(tuple(d), float(np.radians(degrees)), (irradiance,) * 3)


def test_half_plane(tmp_path, lit_by):
    """A disc at the zenith of tangent radius t, behind a half-plane at height h: V = ½ + (x √(1 − x²) + asin x)/π at the offset
    x h t from its edge. Its cap differs from its plane by less than 0.0013 at 9°."""
    lit_by(light((0, 1, 0), 9.0))
    source = scene(tmp_path, FLOOR + ROOF)
    visible, seen = worker.light_visibility(source, SETTINGS), worker.gbuffer(source, 4)
    x = np.clip(seen.position[..., 0] / np.tan(np.radians(9.0)), -1.0, 1.0)
    expected = 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi
    floor = (seen.coverage == 1) & (np.abs(seen.position[..., 1]) < 1e-4)
    between = floor & (np.abs(x) < 1)
    assert floor.sum() > 5000 and between.sum() > 1000
    # 256 Hammersley points know a polygon's coverage to 0.005 rms; a pixel's own width is small beside that.
    error = (visible - expected)[between]
    assert np.sqrt((error**2).mean()) < 0.008 and np.abs(error).max() < 0.02 and np.abs(error.mean()) < 0.002
    assert not visible[floor & (x <= -1)].any() and (visible[floor & (x >= 1)] == 1.0).all()


def test_lights_count_by_their_light_and_angle(tmp_path, lit_by):
    """Under the roof one light of two is hidden: E₁ (n·D₁) / (E₁ (n·D₁) + E₂ (n·D₂)) arrives."""
    slanted = np.array([3.0, 1.0, 0.0]) / np.sqrt(10.0)
    lit_by(light((0, 1, 0), 2.0, 5.0), light(slanted, 1.0, 4.0), light((0, -1, 0), 3.0, 100.0))
    source = scene(tmp_path, FLOOR + ROOF)
    visible, seen = worker.light_visibility(source, SETTINGS), worker.gbuffer(source, 4)
    x, floor = seen.position[..., 0], (seen.coverage == 1) & (np.abs(seen.position[..., 1]) < 1e-4)
    under = floor & (x < -0.1) & (x > -2.5)
    assert under.sum() > 1000
    np.testing.assert_allclose(visible[under], 4 * slanted[1] / (4 * slanted[1] + 5), rtol=1e-5)
    np.testing.assert_allclose(visible[floor & (x > 0.1)], 1.0, rtol=1e-6)


def test_lights_turn_with_their_environment(tmp_path, lit_by):
    """A light below the map's horizon, which the environment turns above the world's: (0, y, z) becomes (0, z, −y)."""
    import OpenEXR

    lit_by(light((0, -0.6, 0.8), 1.0))
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.ones((8, 16, 3), np.float32)}) as file:
        file.write(str(tmp_path / "map.exr"))
    turned = '<emitter type="envmap"><string name="filename" value="map.exr"/>{}</emitter>'
    upright = scene(tmp_path, FLOOR, turned.format(""))
    floor = worker.gbuffer(upright, 1).coverage == 1
    assert not worker.light_visibility(upright, SETTINGS)[floor].any()
    source = scene(tmp_path, FLOOR, turned.format('<transform name="to_world"><rotate x="1" angle="-90"/></transform>'))
    assert (worker.light_visibility(source, SETTINGS)[floor] == 1.0).all()


def test_what_faces_away_is_dark_unless_it_has_two_sides(tmp_path, lit_by):
    lit_by(light((0, 1, 0), 1.0))
    down = FLOOR.replace('angle="-90"', 'angle="90"')
    for bsdf, expected in (('<bsdf type="diffuse"/>', 0.0), ('<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>', 1.0)):
        folder = tmp_path / f"{expected}"
        folder.mkdir()
        source = scene(folder, down.replace('<bsdf type="diffuse"/>', bsdf))
        hit = worker.gbuffer(source, 1).coverage == 1
        assert hit.sum() > 1000 and (worker.light_visibility(source, SETTINGS)[hit] == expected).all()


def test_without_lights_there_is_no_answer(tmp_path):
    assert worker.light_visibility(scene(tmp_path, FLOOR), SETTINGS) is None
