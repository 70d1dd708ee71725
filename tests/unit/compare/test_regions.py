"""Regions against areas and angles known in closed form; planted errors must show where they are, and nowhere else."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evalsuite.compare import compare, regions, where
from evalsuite.compare.blob import largest_blob
from evalsuite.compare.comparison import noisy_picture
from evalsuite.compare.regions import Surfaces, face_angles, masks
from evalsuite.compare.statistics import Noisy
from evalsuite.image.color import luminance

SIZE, RADIUS = 240, 110.0


def plane(normal, size=48, height=0.0):
    """A plane through (0, 0, height), seen from far above, a unit a pixel."""
    n = np.asarray(normal, float) / np.linalg.norm(normal)
    y, x = np.indices((size, size)) - (size - 1) / 2.0
    z = height - (n[0] * x - n[1] * y) / n[2]
    return np.broadcast_to(n, (size, size, 3)).astype(np.float32), np.stack([x, -y, z], -1).astype(np.float32)


def surfaces(normal, position, about_normal=False, visible=None, material=None):
    shape = normal.shape[:2]
    about = None if about_normal is None else np.full(shape, about_normal)
    material = np.zeros(shape, np.int32) if material is None else material
    return Surfaces(normal, position, material, np.array([0.0, 0.0, 1e6]), about, visible)


def sphere(**options):
    """(surfaces, mask) of a unit sphere seen from +z without perspective."""
    y, x = (np.indices((SIZE, SIZE)) - (SIZE - 1) / 2.0) / RADIUS
    inside = x**2 + y**2 < 1
    n = np.stack([x, -y, np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))], -1)
    n = np.where(inside[..., None], n, 0.0).astype(np.float32)
    return surfaces(n, n.copy(), **options), inside


def noisy(mean, relative=0.02, seed=0):
    """A reference of independent noise, and its truth's own standard error."""
    rng = np.random.default_rng(seed)
    sigma = relative * np.ones_like(mean)
    a, b = (mean + np.sqrt(2) * sigma * rng.standard_normal((*mean.shape[:2], 1)) for _ in range(2))
    return Noisy((a + b) / 2, sigma, (a - b) / 2, measured=True)


def exact(mean):
    return noisy_picture(np.asarray(mean, float), None, 0)


@pytest.mark.parametrize(
    ("direction", "expected"),
    [
        ((1, 0, 0), (0.0, 45.0, 54.7356103)),
        ((0, -3, 0), (0.0, 45.0, 54.7356103)),
        ((1, 1, 1), (54.7356103, 0.0, 0.0)),
        ((-2, 2, -2), (54.7356103, 0.0, 0.0)),
        ((0, 1, -1), (45.0, 0.0, 35.2643897)),
    ],
)
def test_angles_at_centres_edges_and_corners(direction, expected):
    np.testing.assert_allclose(face_angles(direction), expected, atol=2e-6)


def test_angles_are_those_to_the_nearest_point_of_a_cube():
    d = np.random.default_rng(0).standard_normal((200, 3))
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    t = np.linspace(-1, 1, 4001)
    edges = [np.roll(np.stack([t, 0 * t + i, 0 * t + j], -1), k, -1) for i in (-1, 1) for j in (-1, 1) for k in range(3)]
    edges = np.concatenate(edges)
    edges /= np.linalg.norm(edges, axis=-1, keepdims=True)
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / np.sqrt(3)
    centres = np.concatenate([np.eye(3), -np.eye(3)])
    for got, points in zip(face_angles(d), (centres, edges, corners), strict=True):
        np.testing.assert_allclose(got, np.degrees(np.arccos(np.clip((d @ points.T).max(1), -1, 1))), atol=2e-2)


def test_parts_of_all_directions():
    """Caps about 6 centres and 8 corners: n (1 − cos r)/2; and the stated 15 % about the edges."""
    d = np.random.default_rng(1).standard_normal((400_000, 3))
    centre, edge, corner = face_angles(d)
    assert (centre < regions.CENTRE_DEG).mean() == pytest.approx(3 * (1 - np.cos(np.radians(15))), rel=0.02)
    assert (corner < regions.CORNER_DEG).mean() == pytest.approx(4 * (1 - np.cos(np.radians(10))), rel=0.02)
    assert ((edge < regions.EDGE_DEG) & (corner >= regions.CORNER_DEG)).mean() == pytest.approx(0.15, abs=0.006)


def test_areas_on_a_sphere():
    """Without perspective n·v < c covers c² of a sphere's disc; n within an angle of +z, sin² of it."""
    seen, inside = sphere(about_normal=True)
    found = masks(seen, inside, inside * 1.0)
    assert found["grazing"].sum() / inside.sum() == pytest.approx(0.09, rel=0.02)
    middle = found["face-centre"] & (seen.normal[..., 2] > 0.5)
    assert middle.sum() / inside.sum() == pytest.approx(np.sin(np.radians(15)) ** 2, rel=0.02)
    assert not (found["face-edge"] & found["face-corner"]).any()
    assert "highlight" not in found and "umbra" not in found  # a flat picture has none, nor has one without lights


def test_what_is_looked_up_is_the_normal_or_the_mirror_direction():
    """A mirror direction turns twice as fast: r meets the cube's edge where n is 22.5° off the view."""
    for about_normal, degrees in ((True, 45.0), (False, 22.5)):
        seen, inside = sphere(about_normal=about_normal)
        edge = masks(seen, inside, inside * 1.0)["face-edge"]
        row = edge[SIZE // 2] & (np.arange(SIZE) > SIZE / 2)
        first = np.flatnonzero(row & (np.arange(SIZE) < SIZE / 2 + 0.9 * RADIUS))
        first = first[first - first[0] == np.arange(len(first))]
        middle = (first.mean() - (SIZE - 1) / 2) / RADIUS
        half = regions.EDGE_DEG * (1.0 if about_normal else 0.5)
        ends = np.sin(np.radians([degrees - half, degrees + half]))
        assert middle == pytest.approx(ends.mean(), abs=1.0 / RADIUS)
        assert len(first) == pytest.approx(np.ptp(ends) * RADIUS, abs=2)


def test_a_map_that_belongs_to_the_viewer_has_no_cube_faces():
    seen, inside = sphere(about_normal=None)
    assert not [name for name in masks(seen, inside, inside * 1.0) if name.startswith("face")]
    assert where.looked_up_at(seen, inside) is None
    assert set(where.curves(exact(np.ones((SIZE, SIZE, 3))), exact(np.ones((SIZE, SIZE, 3))), inside, seen)) == {"n_dot_v"}


def test_silhouette_of_a_sphere_is_a_ring():
    seen, inside = sphere()
    found = masks(seen, inside, inside * 1.0)["silhouette"]
    y, x = np.indices((SIZE, SIZE)) - (SIZE - 1) / 2.0
    from_border = RADIUS - np.hypot(x, y)
    assert found[inside & (from_border < 1.5)].all()
    assert not found[from_border > 4.0].any()


def test_silhouette_between_surfaces_but_not_on_a_slope():
    everywhere = np.ones((48, 48), bool)
    for slope in ((0, 0, 1), (3, 1, 1)):
        assert not regions.silhouette(surfaces(*plane(slope)), everywhere).any()
    floor, right = plane((0, 0, 1)), np.arange(48) >= 24
    step, crease = plane((0, 0, 1), height=8.0), plane((1, 0, 1))
    edge = np.zeros((48, 48), bool)
    edge[:, 21:27] = True
    for other in (step, crease):
        both = [np.where(right[:, None], b, a) for a, b in zip(floor, other, strict=True)]
        np.testing.assert_array_equal(regions.silhouette(surfaces(*both), everywhere), edge)
    material = np.broadcast_to(right.astype(np.int32), (48, 48))
    np.testing.assert_array_equal(regions.silhouette(surfaces(*floor, material=material), everywhere), edge)


def test_highlight_is_the_brightest_hundredth():
    seen, inside = sphere()
    brightness = np.random.default_rng(2).permutation(SIZE * SIZE).reshape(SIZE, SIZE)
    found = masks(seen, inside, brightness)["highlight"]
    assert found.sum() == pytest.approx(0.01 * inside.sum(), abs=1)
    assert brightness[found].min() > brightness[inside & ~found].max()
    flat = np.minimum(brightness, np.median(brightness))  # half of it at the limit: no hundredth of it stands out
    assert "highlight" not in masks(seen, inside, flat)
    flat[120, 120] += 1
    assert masks(seen, inside, flat)["highlight"].sum() == 1


def test_light_that_arrives():
    visible = np.zeros((SIZE, SIZE), np.float32)
    visible[:, 100:], visible[:, 140:] = 0.5, 1.0
    seen, inside = sphere(visible=visible)
    found = masks(seen, inside, inside * 1.0)
    for name, value in (("umbra", 0.0), ("penumbra", 0.5), ("unshadowed", 1.0)):
        np.testing.assert_array_equal(found[name], inside & (visible == value))


def planted(value=0.2):
    visible = np.zeros((SIZE, SIZE), np.float32)
    visible[:, 100:], visible[:, 140:] = 0.5, 1.0
    seen, inside = sphere(visible=visible)
    truth = np.broadcast_to(0.5 + 0.5 * seen.normal[..., 2:], (SIZE, SIZE, 3)).astype(float)
    image = truth * (1 + value * (visible == 0.5)[..., None])
    return seen, inside, truth, image


def test_a_planted_error_shows_in_its_region_alone():
    seen, inside, truth, image = planted()
    meta, sets = where.located(exact(image), exact(truth), inside, seen)
    numbers = regions.first(sets)
    found = meta["regions"]
    assert found["penumbra"]["metrics"]["rel_bias"]["value"] == pytest.approx(0.2)
    assert found["penumbra"]["share"] == {"value": pytest.approx(1.0), "ci95": [pytest.approx(1.0)] * 2}
    for name in ("umbra", "unshadowed"):
        assert {found[name]["metrics"][metric]["value"] for metric in ("mse", "rel_rmse", "mae", "bias")} == {0.0}
        assert found[name]["share"]["value"] == 0.0
    assert numbers[~inside].max() == 0.0
    assert set(np.unique(numbers)) <= set(range(regions.OUTLINE + 1)) and regions.OUTLINE in numbers
    json.dumps(meta, allow_nan=False)


def test_a_picture_of_regions_holds_all_that_a_pixel_is_in():
    on = np.array([[True, True, False, False]])
    off = ~on
    found = {"silhouette": on, "grazing": np.array([[True, False, True, False]]), "unshadowed": off}
    blob = np.zeros((5, 5), bool)
    blob[1:4, 1:4] = True
    sets = regions.picture(found, None, on.shape)
    number = {name: k for k, name in enumerate(regions.ORDER, 1)}
    expected = [[2 ** (number[a] - 1) + (2 ** (number[b] - 1) if b else 0) for a, b in
                 (("silhouette", "grazing"), ("silhouette", None), ("grazing", "unshadowed"), ("unshadowed", None))]]  # fmt: skip
    np.testing.assert_array_equal(sets, expected)
    np.testing.assert_array_equal(
        regions.first(sets), [[number[n] for n in ("silhouette", "silhouette", "grazing", "unshadowed")]]
    )
    outlined = regions.first(regions.picture({"silhouette": np.ones((5, 5), bool)}, blob, (5, 5)))
    assert (outlined == regions.OUTLINE).sum() == 8 and outlined[2, 2] == outlined[0, 0] == number["silhouette"]


def test_scores_of_a_region_are_those_of_compare_on_it():
    seen, inside, truth, image = planted()
    reference = noisy(truth)
    found = masks(seen, inside, luminance(reference.plus))
    got = where.scores(exact(image), reference, inside, found)
    halves = (reference.mean + reference.noise, reference.mean - reference.noise)
    for name in set(found) - {"highlight"}:
        expected = compare(image, reference.mean, reference.standard_error, halves, found[name]).metrics
        for metric, value in got[name]["metrics"].items():
            assert value["value"] == pytest.approx(expected[metric].value, rel=1e-9), (name, metric)
            assert value["ci95"] == pytest.approx(expected[metric].ci95, rel=1e-9, abs=1e-15), (name, metric)
        assert got[name]["pixels"] == found[name].sum()


def test_curves_show_an_error_at_its_angle():
    seen, inside = sphere(about_normal=True)
    truth = np.ones((SIZE, SIZE, 3))
    far = face_angles(seen.looked_up)[0] >= 45.0
    found = where.curves(exact(truth * (1 + 0.1 * far[..., None])), exact(truth), inside, seen)
    bins = found["face_angle"]["bins"]
    assert bins[0]["edges"] == [0.0, 5.0] and bins[-1]["edges"] == [50.0, pytest.approx(54.7356103)]
    for curve in found.values():
        assert sum(b["pixels"] for b in curve["bins"]) == inside.sum()
    for b in bins:
        assert b["rel_rmse"]["value"] == pytest.approx(0.1 * (b["edges"][0] >= 45.0))
        assert b["rel_bias"]["value"] == pytest.approx(0.1 * (b["edges"][0] >= 45.0))
    first = found["n_dot_v"]["bins"][0]
    assert first["edges"] == [0.0, 0.1] and first["pixels"] / inside.sum() == pytest.approx(0.01, rel=0.1)


def test_intervals_of_regions_hold_the_truth():
    """Over many realisations of the reference's noise; the highlight's too, whose pixels the noise helps to choose. A flat
    reference is the worst case: without two halves its highlight would be nothing but the brightest noise."""
    seen, inside = sphere(about_normal=True)
    rows = slice(60, 100)  # a band is enough
    cut = Surfaces(*(v[rows] for v in (seen.normal, seen.position, seen.material)), seen.eye, seen.about_normal[rows])
    inside, truth = inside[rows], np.ones((40, SIZE, 3))
    grazing = (cut.n_dot_v < 0.3)[..., None]
    image, trials, held = truth * (1.02 + 0.03 * grazing), 120, {}
    for seed in range(trials):
        reference = noisy(truth, 0.05, seed)
        found = masks(cut, inside, luminance(reference.plus))
        scored = where.located(exact(image), reference, inside, cut)[0]["regions"]
        for name in ("grazing", "face-edge", "highlight"):
            true = (image - truth)[found[name]]
            for metric, value in (("rel_bias", true.mean()), ("rel_rmse", np.sqrt((true**2).mean()))):
                lo, hi = scored[name]["metrics"][metric]["ci95"]
                held.setdefault((name, metric), []).append(lo <= value <= hi)
        square = ((image - truth) ** 2).mean(-1)
        lo, hi = scored["grazing"]["share"]["ci95"]
        held.setdefault("share", []).append(lo <= square[found["grazing"]].sum() / square[inside].sum() <= hi)
    for what, hits in held.items():
        assert sum(hits) >= 107, (what, sum(hits))  # 120 trials at 95 % fall below with probability 0.4 %


class TestBlob:
    def flat(self, size=60):
        return np.zeros((size, size)), np.ones((size, size), bool)

    def test_size_box_and_height(self):
        difference, inside = self.flat()
        difference[10:20, 5:12] = 0.2
        difference[20, 12] = 0.5  # touches by a corner
        difference[40:43, 40:43] = 0.9
        found, where_it_is = largest_blob(difference, np.full((60, 60), 0.01), inside, 1.0)
        assert found["pixels"] == 71 == where_it_is.sum() and found["box"] == [5, 10, 8, 11]
        assert found["threshold"] == 0.05 and found["share"] == 71 / 3600
        assert found["peak"]["value"] == 0.5 and found["mean_error"]["value"] == pytest.approx((70 * 0.2 + 0.5) / 71)
        lo, hi = found["mean_error"]["ci95"]
        assert hi - lo == pytest.approx(2 * 1.96 * 0.01 / np.sqrt(71), rel=1e-3)

    def test_signs_do_not_join_and_the_mask_cuts(self):
        difference, inside = self.flat()
        difference[10:20, 10:20], difference[10:20, 20:40] = 0.2, -0.2
        found, _ = largest_blob(difference, np.zeros((60, 60)), inside, 1.0)
        assert found["pixels"] == 200 and found["peak"]["value"] == -0.2
        inside[:, 24:] = False
        found, _ = largest_blob(difference, np.zeros((60, 60)), inside, 1.0)
        assert found["pixels"] == 100 and found["peak"]["value"] == 0.2

    def test_noise_and_small_errors_are_none(self):
        difference, inside = self.flat(256)
        assert largest_blob(difference + 0.049, np.zeros((256, 256)), inside, 1.0) is None
        noise = 0.2 * np.random.default_rng(0).standard_normal((256, 256))
        found = largest_blob(noise, np.full((256, 256), 0.2), inside, 1.0)
        assert found is None or found[0]["pixels"] <= 3
