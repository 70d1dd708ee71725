"""The G-buffer against geometry known in closed form."""

import numpy as np
import pytest

from evalsuite.math.pixel import subsamples
from evalsuite.reference import worker
from evalsuite.reference.gbuffer import ASIDE
from evalsuite.scene.environment import evaluate
from evalsuite.scene.model import SceneSource


def scene(tmp_path, shapes, film=""):
    path = tmp_path / "scene.xml"
    path.write_text(f"""<scene version="3.0.0">
      <sensor type="perspective"><float name="fov" value="40"/><float name="near_clip" value="0.5"/>
        <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/>{film}</film></sensor>
      {shapes}<emitter type="sunsky"><transform name="to_world"><rotate x="1" angle="-90"/></transform></emitter></scene>""")
    return SceneSource(path)


def test_sphere(tmp_path):
    source = scene(tmp_path, '<shape type="sphere" id="ball"/>')
    buffer = worker.gbuffer(source, 8)
    # Area of the silhouette cone's ellipse, here a circle of radius tan(asin 1/5) on the plane at distance 1.
    pixel = 2 * np.tan(np.radians(20)) / 64
    expected = np.pi * np.tan(np.arcsin(0.2)) ** 2 / pixel**2
    assert buffer.coverage.sum() == pytest.approx(expected, rel=2e-3)  # inscribed facets and 8 × 8 points
    inside = buffer.coverage == 1
    facing = inside & (buffer.normal[..., 2] > 0.5)  # nearer the silhouette a pixel averages over much depth
    radius = np.linalg.norm(buffer.position[facing], axis=-1)
    assert facing.sum() > 200 and 0.995 < radius.min() and radius.max() <= 1.0
    assert np.einsum("ij,ij->i", buffer.normal[facing], buffer.position[facing]).min() > 0.995
    np.testing.assert_allclose(buffer.depth[inside], 5 - buffer.position[inside][:, 2], atol=1e-5)  # from the eye, along the axis
    assert not buffer.normal[buffer.coverage == 0].any() and not buffer.depth[buffer.coverage == 0].any()
    assert buffer.material.shape[0] == 1 and np.array_equal(buffer.material[0], buffer.coverage)


def test_materials_of_several_shapes(tmp_path):
    left = '<shape type="cube"><bsdf type="diffuse" id="a"/>'
    left += '<transform name="to_world"><scale value="0.5"/><translate x="-1"/></transform></shape>'
    right = left.replace('"a"', '"b"').replace("-1", "1")
    refused = '<shape type="sphere"><bsdf type="null"/><medium name="interior" type="homogeneous"/></shape>'
    source = scene(tmp_path, left + right + refused)
    model, buffer = worker.load_model(source), worker.gbuffer(source, 2)
    assert [m.id for m in model.materials] == ["a", "b"]
    # Seen from +z, world +x is to the right.
    assert buffer.material[0][:, :28].sum() > 30 and buffer.material[1][:, 36:].sum() > 30
    assert not buffer.material[0][:, 36:].any() and not buffer.material[1][:, :28].any()
    assert (buffer.coverage - buffer.material.sum(0)).max() > 0.9  # the refused sphere is nobody's


@pytest.mark.parametrize("two_sided", [False, True])
def test_normals_turn_on_two_sided_back_faces_only(tmp_path, two_sided):
    bsdf = '<bsdf type="diffuse"/>'
    bsdf = f'<bsdf type="twosided">{bsdf}</bsdf>' if two_sided else bsdf
    turned = '<transform name="to_world"><rotate y="1" angle="180"/></transform>'
    buffer = worker.gbuffer(scene(tmp_path, f'<shape type="rectangle">{bsdf}{turned}</shape>'), 1)
    assert buffer.normal[24, 32] == pytest.approx([0, 0, 1 if two_sided else -1], abs=1e-6)


def test_background_is_the_environment_along_each_ray_and_crops_agree(tmp_path):
    source = scene(tmp_path, '<shape type="sphere"/>')
    whole = worker.gbuffer(source, 2)
    model = worker.load_model(source)
    tan = np.tan(np.radians(20))
    expected = np.zeros((48, 64, 3))
    for right, down in subsamples(2):
        x = ((np.arange(64) + right + ASIDE[0]) / 64 * 2 - 1) * tan
        y = (1 - (np.arange(48) + down + ASIDE[1]) / 48 * 2) * tan * 48 / 64
        d = np.stack([*np.meshgrid(x, y), np.full((48, 64), -1.0)], -1)
        expected += evaluate(model.environment, d) / 4
    assert expected.max() > 0.05
    # One of the sky's horizon texels is a step of 0.2: float32 directions move it by 1e-4 of a texel.
    np.testing.assert_allclose(whole.background, expected, atol=1e-4)
    crop = "".join(
        f'<integer name="crop_{k}" value="{v}"/>' for k, v in {"offset_x": 10, "offset_y": 6, "width": 30, "height": 20}.items()
    )
    part = worker.gbuffer(scene(tmp_path, '<shape type="sphere"/>', crop), 2)
    for name in ("coverage", "depth", "normal", "position", "background"):
        np.testing.assert_allclose(getattr(part, name), getattr(whole, name)[6:26, 10:40], atol=2e-5)
