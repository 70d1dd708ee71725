"""The `npr` BSDF and the target `lookup`: the maps of math.npr, exactly, by Mitsuba's own geometry."""

import numpy as np
import pytest
from scipy import ndimage

from evalsuite.errors import EvalsuiteError
from evalsuite.math import npr
from evalsuite.reference import worker
from evalsuite.reference.variants import activate
from evalsuite.scene.model import SceneSource

FOV, SIZE = 20.0, 64
PARAMETERS = {"cool": npr.COOL, "warm": npr.WARM, "width": 3.0, "strokes": 17.0}


BESIDE = (
    '<shape type="sphere"><point name="center" x="1.2" y="0" z="2"/><float name="radius" value="0.5"/><ref id="map"/></shape>'
)


def write(tmp_path, bsdf, shapes='<shape type="sphere"><ref id="subject"/></shape>', origin="1,2,7"):
    sensor = f"""<sensor type="perspective"><float name="fov" value="{FOV}"/>
      <transform name="to_world"><lookat origin="{origin}" target="0,0,0" up="0,1,0"/></transform>
      <film type="hdrfilm"><integer name="width" value="{SIZE}"/><integer name="height" value="{SIZE}"/></film></sensor>"""
    black = '<emitter type="constant"><rgb name="radiance" value="0,0,0"/></emitter>'
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene version="3.0.0">{sensor}{black}{bsdf}{shapes}</scene>')
    return SceneSource(path)


def bsdf(style, viewer="distant", wrap="{}"):
    inner = f"""<string name="style" value="{style}"/><string name="viewer" value="{viewer}"/>
      <float name="width" value="{PARAMETERS["width"]}"/><float name="strokes" value="{PARAMETERS["strokes"]}"/>"""
    if wrap == "{}":
        return f'<bsdf type="npr" id="subject">{inner}</bsdf>'
    return f'<bsdf type="twosided" id="subject"><bsdf type="npr">{inner}</bsdf></bsdf>'


@pytest.mark.parametrize("style", npr.STYLES)
def test_the_plugin_is_its_numpy_twin(style):
    mi = activate()
    plugin = mi.load_dict({"type": "npr", "style": style, "width": PARAMETERS["width"], "strokes": PARAMETERS["strokes"]})
    rng = np.random.default_rng(1)
    p, footprint = rng.uniform(-1, 1, (20000, 2)), rng.uniform(0, 0.1, 20000)
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(p))
    si.uv, si.duv_dx = mi.Point2f(p.T), mi.Vector2f(mi.Float(footprint), 0.0)
    value = np.array(plugin.eval_attribute_3("npr_map", si)).T
    truth = npr.colour(style, p, PARAMETERS, footprint)
    close = np.abs(value - truth).max(-1) < 2e-6
    assert truth.std() > 0.1
    assert close.mean() > (0.9995 if style != "cool-warm" else 1 - 1e-9)  # float32 puts few points over an edge


@pytest.mark.parametrize("viewer", npr.VIEWERS)
@pytest.mark.parametrize("style", ["cool-warm", "sketch"])
def test_the_picture_is_the_map_at_mitsubas_normals(tmp_path, style, viewer):
    """Sub-sample by sub-sample: the same rays as the geometry buffer's, one in the middle of each of its cells."""
    source = write(tmp_path, bsdf(style, viewer))
    state, seen = worker.advance(source, "lookup", None, 4), worker.gbuffer(source, 1)
    mask = seen.coverage > 0
    to_world = worker.load_model(source).camera.to_world
    frame = to_world[:3, :3].T * [[-1], [1], [-1]]
    to_view = to_world[:3, 3] - seen.position[mask]
    to_view /= np.linalg.norm(to_view, axis=-1, keepdims=True)
    p = npr.coordinates(seen.normal[mask], to_view, frame, viewer)
    truth, value = npr.colour(style, p, PARAMETERS), state.mean[mask]
    assert mask.sum() > 1000
    if style == "cool-warm":  # a pixel's mean against its middle: second derivatives over a pixel
        inner = (p**2).sum(-1) < 0.9
        assert np.abs(value - truth)[inner].max() < 0.02
    else:
        certain = np.isin(value[:, 0], (0, 1))  # pixels without an edge
        assert certain.mean() > 0.5 and (value[:, 0][certain] == truth[:, 0][certain]).mean() > 0.995


@pytest.mark.parametrize("radius", [0.08, 0.3, 0.9])
def test_the_ring_is_its_width_in_pixels(tmp_path, radius):
    shape = f'<shape type="sphere"><float name="radius" value="{radius}"/><ref id="subject"/></shape>'
    source = write(tmp_path, bsdf("silhouette", "local"), shape, origin="0,0,6")
    white = worker.advance(source, "lookup", None, 8).mean[..., 0].sum()
    disc = worker.gbuffer(source, 8).coverage.sum()
    outer, inner = np.sqrt(disc / np.pi), np.sqrt(white / np.pi)
    expected = min(PARAMETERS["width"], outer)
    assert outer - inner == pytest.approx(expected, abs=0.06), (outer, inner)


def test_two_sided_maps_show_on_both_sides_and_others_on_one(tmp_path):
    plane = '<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="{}"/></transform><ref id="subject"/></shape>'
    for angle, wrap, sees in ((0, "{}", True), (180, "{}", False), (0, "two", True), (180, "two", True)):
        source = write(tmp_path, bsdf("cool-warm", wrap=wrap), plane.format(angle), origin="0,0,7")
        centre = worker.advance(source, "lookup", None, 1).mean[SIZE // 2, SIZE // 2]
        assert (centre > 0).all() == sees, (angle, wrap)


def test_npr_reflects_no_light_and_lookup_shows_no_other_material_but_wants_one(tmp_path):
    lit = write(tmp_path, bsdf("cool-warm"))
    lit.path.write_text(lit.path.read_text().replace('value="0,0,0"', 'value="1,1,1"'))
    inside = ndimage.binary_erosion(worker.gbuffer(lit).coverage == 1)
    assert inside.sum() > 1000
    for target in ("unoccluded", "direct", "path"):
        assert not worker.advance(lit, target, None, 1).mean[inside].any()
    (tmp_path / "other").mkdir()
    clay = write(tmp_path / "other", '<bsdf type="diffuse" id="subject"/>')
    with pytest.raises(EvalsuiteError, match="without an `npr` material"):
        worker.advance(clay, "lookup", None, 1)
    both = write(tmp_path / "other", '<bsdf type="diffuse" id="subject"/>' + bsdf("cool-warm").replace("subject", "map"))
    both.path.write_text(both.path.read_text().replace("</scene>", BESIDE + "</scene>"))
    seen, mean = worker.gbuffer(both, 4), worker.advance(both, "lookup", None, 1).mean
    clay_only, map_only = (ndimage.binary_erosion(seen.material[i] == 1) for i in (0, 1))
    assert clay_only.sum() > 300 and not mean[clay_only].any()
    assert map_only.sum() > 300 and (mean[map_only] > 0).all()


@pytest.mark.parametrize("bad", [{"style": "oil"}, {"viewer": "near"}, {"width": -1.0}, {"strokes": float("nan")}])
def test_bad_parameters_are_refused(bad):
    mi = activate()
    with pytest.raises((EvalsuiteError, RuntimeError), match="npr"):
        mi.load_dict({"type": "npr", **bad})
