"""How much of a disc polygons cover: against closed forms, quadrature, rays, and what no choice of frame may change."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from evalsuite.math import disc_coverage
from evalsuite.math.disc_coverage import coverage_of_triangles, half_plane, segment_area, segment_sliver, tangent_frame

UP = np.array([0.0, 1.0, 0.0])
#: Coordinates of points as an edge's ends have them, in units of the disc's radius. Below 10⁻⁶ they are 0: no scene is finer.
coordinate = st.floats(-8.0, 8.0).map(lambda x: 0.0 if abs(x) < 1e-6 else x)
point = st.tuples(coordinate, coordinate).map(np.array)


def unit(*vector: float) -> np.ndarray:
    return np.array(vector) / np.linalg.norm(vector)


def around(points: np.ndarray) -> float:
    """Area of the disc that a polygon (N, 2) covers, over the disc's: Σ S/π."""
    return segment_area(points, np.roll(points, -1, axis=0)).sum() / np.pi


def convex_polygon(random: np.random.Generator, spread: float = 1.5) -> np.ndarray:
    points = random.normal(size=(random.integers(3, 9), 2)) * random.uniform(0.3, 3.0) + random.uniform(-spread, spread, 2)
    return points[ConvexHull(points).vertices]  # counter-clockwise


NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)


def covered_by_quadrature(polygon: np.ndarray) -> float:
    """Part of the disc within a convex polygon: lengths of vertical lines in both, Gauss-Legendre between the places where
    either's outline bends."""
    breaks = np.unique(np.clip(np.concatenate([[-1.0, 1.0], polygon[:, 0]]), -1.0, 1.0))
    a, b = polygon, np.roll(polygon, -1, axis=0)
    total = 0.0
    for left, right in pairwise(breaks):
        # x = sin t: the rim's vertical ends would spoil the rule.
        first, last = np.arcsin([left, right])
        t = 0.5 * (first + last) + 0.5 * (last - first) * NODES
        x = np.sin(t)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            y = a[:, 1] + (x - a[:, 0]) / (b[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
        meets = (x - a[:, 0]) * (x - b[:, 0]) <= 0.0
        low, high = np.where(meets, y, np.inf).min(1), np.where(meets, y, -np.inf).max(1)
        rim = np.cos(t)
        length = np.maximum(np.minimum(high, rim) - np.maximum(low, -rim), 0.0)
        total += 0.5 * (last - first) * (WEIGHTS * length * np.cos(t)).sum()
    return total / np.pi


def solid(random: np.random.Generator, corners: int = 12) -> np.ndarray:
    """Triangles (F, 3, 3) of a random closed convex body about 0, counter-clockwise from outside."""
    vertices = random.normal(size=(corners, 3)) * random.uniform(0.3, 1.0, 3)
    hull = ConvexHull(vertices)
    triangles = vertices[hull.simplices]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = (normal * hull.equations[:, :3]).sum(1) < 0
    triangles[inward] = triangles[inward, ::-1]
    return triangles


def turn(random: np.random.Generator) -> np.ndarray:
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def board(height: float, edge: float, far: float = 1e5) -> np.ndarray:
    """Two triangles that hide x > edge at a height, seen from below: counter-clockwise from above."""
    a, b = np.array([edge, height, -far]), np.array([edge, height, far])
    c, d = np.array([far, height, far]), np.array([far, height, -far])
    return np.array([[a, b, c], [a, c, d]])


def test_half_plane_is_the_area_beside_the_line():
    x = np.linspace(-1.0, 1.0, 41)
    t = 0.5 * (np.arcsin(x)[:, None] - np.pi / 2) + 0.5 * (np.arcsin(x)[:, None] + np.pi / 2) * NODES
    area = 0.5 * (np.arcsin(x) + np.pi / 2) * (WEIGHTS * 2.0 * np.cos(t) ** 2).sum(-1)
    np.testing.assert_allclose(half_plane(x), area / np.pi, atol=1e-14)
    np.testing.assert_array_equal(half_plane([-7.0, -1.0, 0.0, 1.0, 1e9]), [0.0, 0.0, 0.5, 1.0, 1.0])


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_tangent_frame_is_right_handed(vector):
    assume(np.linalg.norm(vector) > 1e-3)
    d = unit(*vector)
    t, b = tangent_frame(d)
    np.testing.assert_allclose(np.stack([t, b, d]) @ np.stack([t, b, d]).T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.cross(t, b), d, atol=1e-14)


@given(st.floats(-1.2, 1.2), st.floats(-np.pi, np.pi))
def test_a_line_through_the_disc_leaves_the_half_plane(offset, azimuth):
    """A long edge at distance x from the centre, the centre on its left: between chord and rim lies 1 − V(x). With the centre
    on its right that part counts negative."""
    turned = np.array([[np.cos(azimuth), np.sin(azimuth)], [-np.sin(azimuth), np.cos(azimuth)]])
    a, b = np.array([offset, -9.0]) @ turned, np.array([offset, 9.0]) @ turned
    assume(abs(offset) > 1e-9)  # through the very centre neither side is left
    beyond = 1.0 - half_plane(abs(offset))
    assert segment_sliver(a, b) == pytest.approx(np.sign(offset) * beyond, abs=1e-7)  # √ at the rim halves the digits
    assert segment_sliver(b, a) == pytest.approx(-float(segment_sliver(a, b)), abs=1e-12)


@given(point, point, st.floats(0.0, 1.0), st.floats(-np.pi, np.pi))
def test_areas_seen_from_the_centre(a, b, part, azimuth):
    """S changes its sign with the edge's direction, adds up along it, turns with it, and is within both shapes."""
    s = float(segment_area(a, b))
    cross = a[0] * b[1] - a[1] * b[0]
    # An edge that all but passes through the centre is seen under ±π there, of which rounding decides the sign.
    assume(abs(cross) > 1e-9 * np.linalg.norm(b - a) or not np.linalg.norm(b - a))
    assert s == pytest.approx(-float(segment_area(b, a)), abs=1e-9)
    middle = a + part * (b - a)
    assert float(segment_area(a, middle) + segment_area(middle, b)) == pytest.approx(s, abs=1e-9)
    c, n = np.cos(azimuth), np.sin(azimuth)
    turned = np.array([[c, n], [-n, c]])
    assert float(segment_area(a @ turned, b @ turned)) == pytest.approx(s, abs=1e-9)
    angle = np.arctan2(cross, a @ b)
    assert abs(s) <= min(0.5 * abs(angle), 0.5 * abs(cross)) + 1e-9 and s * cross >= -1e-12


def test_areas_of_edges_within_and_outside():
    a, b = np.array([0.3, -0.2]), np.array([0.1, 0.5])
    assert segment_area(a, b) == pytest.approx(0.5 * (0.3 * 0.5 + 0.2 * 0.1), abs=1e-15)  # a triangle
    assert segment_area([2.0, -1.0], [2.0, 1.0]) == pytest.approx(np.arctan(0.5), abs=1e-15)  # a sector
    assert segment_area([0.0, 0.0], [3.0, 1.0]) == 0.0 and segment_area(a, a) == 0.0
    assert segment_sliver([2.0, -1.0], [2.0, 1.0]) == 0.0 and segment_sliver([1.0, -1.0], [1.0, 1.0]) == 0.0


def test_polygons_cover_what_quadrature_finds():
    random, partial = np.random.default_rng(1), 0
    for _ in range(200):
        polygon = convex_polygon(random)
        expected = covered_by_quadrature(polygon)
        partial += 1e-3 < expected < 1 - 1e-3
        # Where the polygon's sides cross the rim the rule meets a kink.
        assert around(polygon) == pytest.approx(expected, abs=2e-5)
        assert around(polygon[::-1]) == pytest.approx(-around(polygon), abs=1e-13)
    assert partial > 100


def test_hard_shadow_less_slivers_is_the_area():
    """Wedges: C = W₀ − Σ s, W₀ the winding about the centre, for any closed outline; it may cross itself."""
    random, both = np.random.default_rng(2), 0
    for _ in range(300):
        polygon = random.normal(size=(random.integers(3, 9), 2)) * random.uniform(0.3, 2.0) + random.uniform(-1, 1, 2)
        a, b = polygon, np.roll(polygon, -1, axis=0)
        # Winding by what crosses the ray along +x: independent of any angle.
        side = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        winding = ((a[:, 1] <= 0) & (b[:, 1] > 0) & (side > 0)).sum() - ((a[:, 1] > 0) & (b[:, 1] <= 0) & (side < 0)).sum()
        slivers = segment_sliver(a, b).sum()
        both += winding != 0 and abs(slivers) > 1e-3
        assert winding - slivers == pytest.approx(around(polygon), abs=1e-12)
    assert both > 50


@pytest.mark.parametrize("radius", np.radians([0.25, 4.0, 22.0, 60.0]))
def test_a_straight_edge_gives_the_half_plane(radius):
    """Seen from below a board whose edge runs over the light: also where the light stands low."""
    height, x = 1.3, np.linspace(-1.3, 1.3, 53)
    points = np.stack([-x * height * np.tan(radius), 0 * x, 0 * x], axis=1)
    visible = 1.0 - coverage_of_triangles(points, board(height, 0.0), UP, radius)
    np.testing.assert_allclose(visible, half_plane(-x)[::-1], atol=1e-7)  # √ at the rim; the board is 10⁵ wide
    turned = turn(np.random.default_rng(5))
    again = 1.0 - coverage_of_triangles(points @ turned.T, board(height, 0.0) @ turned.T, turned @ UP, radius)
    np.testing.assert_allclose(again, visible, atol=1e-7)


@pytest.mark.parametrize("elevation", [-9.0, -4.0, 0.0, 3.0, 8.0, 11.0])
def test_a_wall_hides_what_is_below_its_own_horizon(elevation):
    """A point on a body's flat side: the rest of the body covers the light as far as that side's plane cuts it."""
    radius, e = np.radians(10.0), np.radians(elevation)
    p = np.array([[s * x, 0.0, t * x] for s, t in ((-1, -1), (1, -1), (0, 1)) for x in (1e6,)])
    depth = np.array([0.0, -1e6, 0.0])
    top, bottom = p[[0, 2, 1]], p + depth  # a prism whose top is y = 0
    sides = [[p[i], p[j], p[j] + depth] for i, j in ((0, 1), (1, 2), (2, 0))]
    sides += [[p[i], p[j] + depth, p[i] + depth] for i, j in ((0, 1), (1, 2), (2, 0))]
    body = np.array([top, bottom, *sides])
    normal = np.cross(body[:, 1] - body[:, 0], body[:, 2] - body[:, 0])
    assert (np.einsum("fc,fc->f", normal, body[:, 0] - (p.mean(0) + 0.5 * depth)) > 0).all(), "the body is wound outward"
    to_light = np.array([np.cos(e), np.sin(e), 0.0])
    # The horizon is n·(D + tan α (x T + y B)) = 0, a line at a signed distance of n·D/|n − (n·D) D| over tan α from the centre.
    expected = half_plane(np.tan(e) / np.tan(radius))
    visible = 1.0 - coverage_of_triangles([[0.0, 0.0, 0.0]], body, to_light, radius)
    assert visible[0] == pytest.approx(float(expected), abs=1e-5)  # the sides end 10⁶ away


def test_umbra_is_one_and_outside_is_zero():
    random = np.random.default_rng(3)
    for _ in range(20):
        body = solid(random, 20)
        d = unit(*random.normal(size=3))
        inner = (-ConvexHull(body.reshape(-1, 3)).equations[:, 3]).min()  # radius of the ball about 0 within the body
        assert inner > 0.01
        outer = np.linalg.norm(body, axis=-1).max()
        distance = 3.0 * outer
        below = -distance * d
        t, _ = tangent_frame(d)
        deep = coverage_of_triangles([below], body, d, np.arctan(0.9 * inner / distance))
        assert deep[0] == pytest.approx(1.0, abs=1e-12)
        radius = np.arctan(0.5)
        beside = below + t * (1.01 * outer + 0.5 * (distance + outer))
        behind = [distance * d, distance * d + 0.3 * t, beside]
        np.testing.assert_allclose(coverage_of_triangles(behind, body, d, radius), 0.0, atol=1e-12)
        within = coverage_of_triangles([np.zeros(3)], body, d, radius)[0]
        assert within == pytest.approx(1.0, abs=1e-9)  # clipped corners are drawn at 10⁷


def test_against_rays():
    """Random convex bodies before, beside and behind the point, some across its horizon. Jittered rays err by less than
    independent ones: √(V(1 − V)/n)."""
    random, n, errors, visible = np.random.default_rng(4), 1024, [], []
    for _ in range(40):
        body = solid(random) + random.normal(size=3) * 0.2
        d, radius = unit(*random.normal(size=3)), random.uniform(0.03, 0.6)
        points = -d * random.uniform(0.5, 3.0, (12, 1)) + random.normal(size=(12, 3)) * 0.6
        ours = 1.0 - coverage_of_triangles(points, body, d, radius)
        rays = disc_coverage.visible_fraction_sampled(points, body, d, radius, n)
        errors.append(ours - rays)
        visible.append(ours)
    error, v = np.concatenate(errors), np.concatenate(visible)
    some = (v > 0.02) & (v < 0.98)
    assert some.sum() > 80
    z = error[some] / np.sqrt(v[some] * (1 - v[some]) / n)
    assert np.sqrt((z**2).mean()) < 1.0 and abs(error[some].mean()) < 1e-3
    # Where next to nothing or everything is seen, a few rays at the rim.
    assert np.abs(error[~some]).max() < 0.01


def test_only_what_is_seen_from_the_point_matters():
    """A body made larger about the point, or turned with point and light, covers the same."""
    random = np.random.default_rng(6)
    body, d, radius = solid(random), unit(0.3, 1.0, -0.2), 0.35
    points = -d * 1.5 + random.normal(size=(60, 3)) * 0.6
    covered = coverage_of_triangles(points, body, d, radius)
    assert ((covered > 0.01) & (covered < 0.99)).sum() > 15
    for p, c in zip(points, covered, strict=True):
        assert coverage_of_triangles([p], p + 7.3 * (body - p), d, radius)[0] == pytest.approx(c, abs=1e-10)
    q = turn(random)
    np.testing.assert_allclose(coverage_of_triangles(points @ q.T, body @ q.T, q @ d, radius), covered, atol=1e-10)
    shift = np.array([3.0, -1.0, 8.0])
    np.testing.assert_allclose(coverage_of_triangles(points + shift, body + shift, d, radius), covered, atol=1e-10)


def test_a_point_light_s_shadow_stays_when_the_caster_moves_along_it():
    random = np.random.default_rng(7)
    body, d = solid(random), unit(-0.4, 1.0, 0.5)
    points = -2.0 * d + random.normal(size=(300, 3)) * 0.5
    near, far = (coverage_of_triangles(points, body + s * d, d, 1e-7) for s in (0.0, 40.0))
    sharp = (np.abs(near - near.round()) < 1e-9) & (np.abs(far - far.round()) < 1e-9)
    assert sharp.mean() > 0.99 and 0.2 < near.mean() < 0.9
    np.testing.assert_allclose(far[sharp], near[sharp], atol=1e-9)


def test_layers_add_and_rays_see_their_union():
    lower, upper = board(1.0, 0.0), board(2.0, 0.0)
    points = np.stack([np.linspace(-0.5, 0.5, 21), np.zeros(21), np.zeros(21)], axis=1)
    radius = 0.2
    one, other = (coverage_of_triangles(points, t, UP, radius) for t in (lower, upper))
    both = coverage_of_triangles(points, np.concatenate([lower, upper]), UP, radius)
    np.testing.assert_allclose(both, one + other, atol=1e-14)
    assert both.max() == pytest.approx(2.0)
    seen = disc_coverage.visible_fraction_sampled(points, np.concatenate([lower, upper]), UP, radius, 4096)
    # An edge meets some 2 · 64 of the 64² cells, each of which is hit or not: five standard deviations.
    np.testing.assert_allclose(1.0 - seen, np.maximum(one, other), atol=5.0 * np.sqrt(2 * 64 / 4) / 64**2)


def test_open_sheets_and_slivers():
    """Only what turns away from the point counts; triangles without area, and none at all, cover nothing."""
    assert coverage_of_triangles([[5.0, 0.0, 0.0]], board(1.0, 0.0), UP, 0.3)[0] == pytest.approx(1.0)
    assert coverage_of_triangles([[5.0, 0.0, 0.0]], board(1.0, 0.0)[:, ::-1], UP, 0.3)[0] == 0.0
    assert disc_coverage.visible_fraction_sampled([[5.0, 0.0, 0.0]], board(1.0, 0.0)[:, ::-1], UP, 0.3)[0] == 0.0
    line = np.array([[[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 1.0, 0.0]]])
    for nothing in (line, np.zeros((0, 3, 3))):
        np.testing.assert_array_equal(coverage_of_triangles(np.zeros((4, 3)), nothing, UP, 0.3), 0.0)
        np.testing.assert_array_equal(disc_coverage.visible_fraction_sampled(np.zeros((4, 3)), nothing, UP, 0.3), 1.0)
    assert coverage_of_triangles(np.zeros((0, 3)), board(1.0, 0.0), UP, 0.3).shape == (0,)
    # The ground that a point lies on does not cover its light, however low.
    ground = board(0.0, -1e5)
    np.testing.assert_array_equal(coverage_of_triangles([[0.0, 0.0, 0.0], [9.0, 1e-7, 2.0]], ground, unit(1, 0.05, 0), 0.3), 0.0)


def test_batches_change_nothing(monkeypatch):
    random = np.random.default_rng(8)
    body, points = solid(random), random.normal(size=(37, 3)) - [0.0, 2.0, 0.0]
    whole = coverage_of_triangles(points, body, UP, 0.3)
    monkeypatch.setattr(disc_coverage, "_BATCH", 1)
    np.testing.assert_array_equal(coverage_of_triangles(points, body, UP, 0.3), whole)


@pytest.mark.parametrize("radius", [0.01, 0.3, 1.2])
def test_rays_fill_the_disc_evenly(radius):
    d = unit(0.2, -0.7, 0.4)
    rays = disc_coverage.disc_directions(d, radius, 4096)
    assert len(rays) == 4096
    t, b = tangent_frame(d)
    np.testing.assert_allclose(rays @ d, 1.0, atol=1e-12)
    x, y = rays @ t / np.tan(radius), rays @ b / np.tan(radius)
    assert np.hypot(x, y).max() <= 1.0
    # Moments of a uniform disc: ⟨x⟩ = ⟨xy⟩ = 0, ⟨x²⟩ = 1/4; 4096 jittered points err by less than 4096 random ones, σ < 0.5/64.
    np.testing.assert_allclose([x.mean(), y.mean(), (x * y).mean()], 0.0, atol=8e-3)
    np.testing.assert_allclose([(x * x).mean(), (y * y).mean()], 0.25, atol=8e-3)
