"""Bitmaps and normal maps: what the shader sees at a pixel is what Mitsuba's own plugins evaluate there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import draw
from evalsuite.gpu.techniques import user_shader
from evalsuite.reference import render
from evalsuite.scene.model import OWN, SceneSource, own_name

SIZE = 192
SCENE = """<scene version="3.0.0">
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="{origin}" target="0, 0, 0" up="0, 1, 0"/></transform>
    <float name="fov" value="40"/>
    <film type="hdrfilm"><integer name="width" value="192"/><integer name="height" value="192"/></film>
  </sensor>
  <emitter type="constant"/>
  <bsdf type="twosided" id="both"><bsdf type="normalmap" id="bumps">
    <texture type="bitmap" name="normalmap"><string name="filename" value="normals.png"/><boolean name="raw" value="true"/>
      {options}</texture>
    <bsdf type="diffuse" id="subject">
      <texture type="bitmap" name="reflectance"><string name="filename" value="albedo.png"/>{options}</texture>
    </bsdf>
  </bsdf></bsdf>
  <shape type="{shape}">{flip}<ref id="both"/></shape>
</scene>"""
SHADERS = {
    "normal": "vec3 shade(Surface s) { return s.normal; }",
    "albedo": "vec3 shade(Surface s) { return diffuse_reflectance; }",
}
MIRRORED = (
    '<string name="wrap_mode" value="mirror"/><transform name="to_uv"><scale x="1.7" y="2.3"/><translate x="0.2"/></transform>'
)


def smooth(seed: int, low: int, high: int, size: int = 7) -> np.ndarray:
    """A few texels, each many pixels wide, so that no footprint matters."""
    rough = np.random.default_rng(seed).uniform(low, high, (5, 5, 3)).astype(np.uint8)
    rough[-1], rough[:, -1] = rough[0], rough[:, 0]  # periodic
    return np.array(Image.fromarray(rough).resize((size, size), Image.Resampling.BICUBIC))


def write_scene(folder: Path, shape: str, options: str = "", origin: str = "1.5, 2.1, 3.2", flip: str = "") -> Path:
    Image.fromarray(smooth(1, 40, 250)).save(folder / "albedo.png")
    normals = smooth(2, 70, 186)
    normals[..., 2] = 220
    Image.fromarray(normals).save(folder / "normals.png")
    path = folder / "scene.xml"
    path.write_text(SCENE.format(shape=shape, options=options, origin=origin, flip=flip))
    return path


def mitsuba_values(loaded) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At pixel centres: hit, world normal of the normal map's frame, albedo; (H W), (H W, 3), (H W, 3)."""
    import drjit as dr
    import mitsuba as mi

    index = dr.arange(mi.UInt32, SIZE * SIZE)
    film = mi.Point2f((mi.Float(index % SIZE) + 0.5) / SIZE, (mi.Float(index // SIZE) + 0.5) / SIZE)
    ray, _ = loaded.sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    si = loaded.mitsuba.ray_intersect(ray)
    folder = loaded.scene.path.parent
    material = loaded.scene.materials[0]
    textures = []
    for texture, name, raw in (
        (material.normal_map, "normals.png", True),
        (material.parameters["reflectance"], "albedo.png", False),
    ):
        to_uv = mi.ScalarTransform3f(texture.to_uv.tolist())
        textures.append(mi.load_dict({"type": "bitmap", "filename": str(folder / name), "raw": raw, "wrap_mode": texture.wrap,
                                      "filter_type": "nearest" if texture.nearest else "bilinear", "to_uv": to_uv}))  # fmt: skip
    local = mi.Vector3f(textures[0].eval(si)) * 2.0 - 1.0
    behind = si.wi.z < 0  # `twosided` mirrors z alone
    normal = dr.normalize(si.sh_frame.to_world(mi.Vector3f(local.x, local.y, dr.select(behind, -local.z, local.z))))
    return np.array(si.is_valid()), np.array(normal).T, np.array(textures[1].eval(si)).T


@pytest.mark.parametrize(("shape", "more"), [
    ("cube", {}),
    ("cube", {"options": MIRRORED}),
    ("cube", {"options": '<string name="wrap_mode" value="clamp"/><transform name="to_uv"><scale x="1.4"/></transform>'}),
    ("sphere", {}),
    ("rectangle", {"origin": "1.1, 0.6, -3.2"}),
], ids=["cube", "mirrored", "clamped", "sphere", "from-behind"])  # fmt: skip
def test_the_shader_sees_what_mitsuba_evaluates(tmp_path, shape, more):
    loaded = render.load_cached(SceneSource(write_scene(tmp_path, shape, **more)))
    material = loaded.scene.materials[0]
    assert material.id == "subject" and material.two_sided and not material.undrawable
    hit, normal, albedo = mitsuba_values(loaded)
    assert hit.sum() > 5000 and normal[hit].std(0).min() > 0.02 and albedo[hit].std(0).min() > 0.02
    for name, truth in (("normal", normal), ("albedo", albedo)):
        shader = tmp_path / f"{name}-{shape}.glsl"
        shader.write_text(SHADERS[name])
        picture = draw.draw(loaded.scene, user_shader.load(shader), {}, supersample=1)
        both = hit & (picture.scored.ravel() > 0)
        assert both.sum() > 0.97 * hit.sum()
        difference = np.abs(picture.image.reshape(-1, 3) - truth)[both].max(-1)
        # At mirrors, clamps and edges between triangles a footprint reaches what another pixel's centre does not.
        assert np.percentile(difference, 97) < 1e-4, (
            name,
            np.percentile(difference, [50, 90, 99, 100]),
        )


def test_another_lobe_keeps_the_bitmap_as_its_diffuse_part(tmp_path):
    """Both renderers, and what a cell binds: the scene's `reflectance` is the `diffuse_reflectance` of a Blinn-Phong BSDF."""
    path = write_scene(tmp_path, "cube")
    bound = {"type": "blinnphong", "exponent": 20.0, "specular_reflectance": (0.3, 0.3, 0.3), "diffuse_reflectance": OWN}
    plain, glossy = (render.load_cached(SceneSource(path, bindings=b)) for b in ({}, {"subject": bound}))
    before, after = plain.scene.materials[0], glossy.scene.materials[0]
    assert after.plugin == "blinnphong" and list(after.textures) == ["diffuse_reflectance"]
    np.testing.assert_array_equal(after.textures["diffuse_reflectance"].texels, before.textures["reflectance"].texels)
    assert "albedo.png" in str(glossy.bsdfs[0])
    shader = tmp_path / "albedo.glsl"
    shader.write_text(SHADERS["albedo"])
    pictures = [draw.draw(one.scene, user_shader.load(shader), {}, supersample=1).image for one in (plain, glossy)]
    np.testing.assert_array_equal(*pictures)
    assert own_name("diffuse_reflectance", {"reflectance"}) == "reflectance" and own_name("exponent", {"reflectance"}) is None


def test_nearest_texels(tmp_path):
    options = '<string name="filter_type" value="nearest"/>'
    loaded = render.load_cached(SceneSource(write_scene(tmp_path, "rectangle", options, origin="0, 0, 3")))
    hit, _, albedo = mitsuba_values(loaded)
    shader = tmp_path / "albedo.glsl"
    shader.write_text(SHADERS["albedo"])
    picture = draw.draw(loaded.scene, user_shader.load(shader), {}, supersample=1).image.reshape(-1, 3)
    assert (np.abs(picture - albedo)[hit].max(-1) < 1e-5).mean() > 0.99


def test_a_bitmap_without_texture_coordinates_is_refused(tmp_path):
    path = write_scene(tmp_path, "ply")
    vertices = "0 0 0\n1 0 0\n0 1 0\n"
    properties = "".join(f"property float {axis}\n" for axis in "xyz")
    (tmp_path / "bare.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 3\n{properties}element face 1\nproperty list uchar int vertex_indices\n"
        f"end_header\n{vertices}3 0 1 2\n"
    )
    path.write_text(
        path.read_text().replace('<shape type="ply">', '<shape type="ply"><string name="filename" value="bare.ply"/>')
    )
    scene = render.load_cached(SceneSource(path)).scene
    with pytest.raises(EvalsuiteError, match="no texture coordinates"):
        scene.require_drawable()


def test_other_textures_are_refused_by_name(tmp_path):
    path = write_scene(tmp_path, "cube")
    text = path.read_text().replace('<texture type="bitmap" name="reflectance"><string name="filename" value="albedo.png"/>',
                                    '<texture type="checkerboard" name="reflectance">')  # fmt: skip
    path.write_text(text)
    with pytest.raises(EvalsuiteError, match="textured reflectance"):
        render.load_cached(SceneSource(path)).scene.require_drawable()


def test_an_edited_bitmap_is_read_again(tmp_path):
    """In one process: a session of Python outlives many an edit."""
    source = SceneSource(write_scene(tmp_path, "cube"))
    before = render.load_cached(source)
    assert render.load_cached(source) is before
    Image.fromarray(smooth(9, 40, 250)).save(tmp_path / "albedo.png")
    after = render.load_cached(source)
    texels = [loaded.scene.materials[0].parameters["reflectance"].texels for loaded in (before, after)]
    assert np.abs(texels[0] - texels[1]).max() > 0.05
