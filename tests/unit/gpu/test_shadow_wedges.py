"""Penumbra wedges against float64 coverage from each pixel's own position."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from evalsuite.gpu.passes import Stage
from evalsuite.gpu.shadow.wedges import Wedges, casters, layers_above
from evalsuite.gpu.techniques.base import Frame
from evalsuite.gpu.worker import gbuffer
from evalsuite.math import disc_coverage
from evalsuite.scene.model import Scene, TriangleMesh

from .helpers import FURNACE, camera, material, rotation, scene, sphere_mesh

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def flat(triangles: np.ndarray, name: str = "mesh") -> TriangleMesh:
    """Flat-shaded mesh of (T, 3, 3) triangles, unwelded as `scene.load` makes it."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal = np.repeat(normal / np.linalg.norm(normal, axis=1, keepdims=True), 3, axis=0)
    faces = np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3)
    return TriangleMesh(name, triangles.reshape(-1, 3).astype(np.float32), normal.astype(np.float32), faces, 0)


def box(size, place=(0.0, 0.0, 0.0), turn=None) -> TriangleMesh:
    """A box standing on y = 0, turned about its middle, then moved."""
    points = (CORNERS - [0.5, 0.0, 0.5]) * size
    if turn is not None:
        middle = np.array([0.0, 0.5 * size[1], 0.0])
        points = (points - middle) @ turn.T + middle
    points = points + place
    return flat(np.concatenate([[points[[a, b, c]], points[[a, c, d]]] for a, b, c, d in SIDES]), "box")


def quad(half: float, height: float = 0.0, up: bool = True) -> TriangleMesh:
    p = np.array([[-half, height, -half], [-half, height, half], [half, height, half], [half, height, -half]])
    triangles = np.array([p[[0, 1, 2]], p[[0, 2, 3]]])
    return flat(triangles if up else triangles[:, ::-1], "quad")


def direction(elevation: float, azimuth: float) -> np.ndarray:
    e, a = np.radians([elevation, azimuth])
    return np.array([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)])


class Drawn:
    """One pass: visibility (L, H, W), positions and the pixels that the lights reach at all."""

    def __init__(self, meshes, directions, radii_deg, centre=False, origin=(3.0, 4.0, 6.0), size=(128, 128)) -> None:
        self.scene: Scene = scene(FURNACE, material("diffuse", reflectance=(0.5,) * 3), meshes=meshes,
                                  view=camera(size, origin=origin, fov=45.0))  # fmt: skip
        self.directions, self.radii = np.atleast_2d(directions), np.radians(np.atleast_1d(radii_deg))
        self.wedges = Wedges(self.scene, self.directions, self.radii, centre)
        self.clip = Stage(self.scene).clip((0.5, 0.5))
        self.again()
        seen = np.frombuffer(self.wedges._seen.read(), np.float32).reshape(size[1], size[0], 4)[::-1].astype(np.float64)
        self.positions, self.hit = seen[..., :3], seen[..., 3] > 0
        self.normals = gbuffer(self.scene, 1).normal

    def again(self) -> None:
        self.wedges.before_pass(Frame(0, 1, 1, 0), self.clip)
        self.visibility = self.wedges.read()

    def lit(self, light: int = 0) -> np.ndarray:
        return self.hit & (self.normals @ self.directions[light] > 1e-3)


def covered(points: np.ndarray, meshes, to_light: np.ndarray, radius: float) -> np.ndarray:
    """Float64 sum of what closed meshes cover of the disc."""
    triangles = np.concatenate([m.positions[m.faces] for m in meshes]).astype(np.float64)
    return disc_coverage.coverage_of_triangles(points, triangles, to_light, radius)


def random_case(seed: int):
    random = np.random.default_rng(seed)
    size = random.uniform(0.3, 2.0, 3)
    turn = rotation(random.uniform(0, 180), random.normal(size=3) if seed % 3 == 0 else (0, 1, 0))
    lift = (0.0, random.uniform(0.0, 1.0))[seed % 2] + (1.0 if seed % 3 == 0 else 0.0)
    to_light = direction(random.uniform(15, 90), random.uniform(0, 360))
    view = np.append(6.0 * np.array([np.cos(a := random.uniform(0, 2 * np.pi)), np.sin(a)]), random.uniform(1, 6))[[0, 2, 1]]
    return box(size, (0.0, lift, 0.0), turn), to_light, random.uniform(1.7, 17.0), view


@pytest.mark.parametrize("seed", range(24))
def test_one_box_is_exact_in_every_pixel(seed):
    """Umbra, penumbra, on the ground and on the box itself; standing, floating or tumbling; camera in shadow or not."""
    caster, to_light, radius, view = random_case(seed)
    drawn = Drawn([quad(4.0), caster], to_light, radius, origin=tuple(view))
    mask = drawn.lit()
    assert mask.sum() > 1000
    expected = 1.0 - np.clip(covered(drawn.positions[mask], [caster], to_light, np.radians(radius)), 0.0, 1.0)
    error, ground = np.abs(drawn.visibility[0][mask] - expected), np.abs(drawn.positions[mask][:, 1]) < 1e-4
    assert np.median(error[ground]) < 1e-6 and error[ground].max() < 5e-4  # the largest where the box stands on the ground
    # The box's own faces end the light at their horizon, which an edge close by draws: float32 places the pixel 10⁻⁷ off the
    # face, and that over the distance to the edge is the horizon's error. On an edge it may take either face's.
    assert (error > 0.02).sum() <= 1
    assert (drawn.visibility[0][mask][expected == 0.0] == 0.0).all()


def test_penumbra_of_a_straight_edge():
    """A wide board with one edge over the ground: V = ½ + (x√(1−x²) + asin x)/π, x = offset over h tan α."""
    height, radius = 1.0, 12.0
    corners = np.array([[0, height, -40], [0, height, 40], [40, height, 40], [40, height, -40]])
    board = flat(np.array([corners[[0, 1, 2]], corners[[0, 2, 3]]]))
    drawn = Drawn([quad(3.0), board], (0.0, 1.0, 0.0), radius, origin=(-4.0, 0.9, 1.0))
    mask = drawn.lit() & (np.abs(drawn.positions[..., 1]) < 1e-4)
    x = -drawn.positions[mask][:, 0] / (height * np.tan(np.radians(radius)))
    assert ((x > -1) & (x < 1)).sum() > 300
    assert np.abs(drawn.visibility[0][mask] - disc_coverage.half_plane(x)).max() < 1e-5


@pytest.mark.parametrize("up", [True, False])
def test_an_open_sheet_casts_from_either_side(up):
    sheet = quad(0.7, 1.0, up)
    drawn = Drawn([quad(3.0), sheet], direction(60, 20), 8.0)
    mask = drawn.lit() & (np.abs(drawn.positions[..., 1]) < 1e-4)
    points = drawn.positions[mask]
    triangles = sheet.positions[sheet.faces].astype(np.float64)
    turned = triangles if up else triangles[:, ::-1]
    expected = 1.0 - disc_coverage.coverage_of_triangles(points, turned, direction(60, 20), np.radians(8.0))
    assert 200 < ((expected > 1e-6) & (expected < 1 - 1e-6)).sum()
    assert np.abs(drawn.visibility[0][mask] - np.clip(expected, 0, 1)).max() < 5e-6


def test_the_ground_does_not_cover_its_own_light():
    drawn = Drawn([quad(3.0)], direction(5, 30), 15.0)
    assert (drawn.visibility[0][drawn.lit()] == 1.0).all()


def test_overlapping_casters_add_up_and_are_clamped():
    first, second = box((0.8, 0.8, 0.8), (-0.3, 0.5, 0.0)), box((0.8, 0.8, 0.8), (0.2, 1.8, 0.1))
    to_light, radius = direction(75, 10), np.radians(10.0)
    drawn = Drawn([quad(4.0), first, second], to_light, 10.0)
    mask = drawn.lit() & (np.abs(drawn.positions[..., 1]) < 1e-4)
    points = drawn.positions[mask]
    parts = [covered(points, [m], to_light, radius) for m in (first, second)]
    assert ((parts[0] > 0.05) & (parts[1] > 0.05)).sum() > 100
    expected = 1.0 - np.clip(parts[0] + parts[1], 0.0, 1.0)
    assert np.abs(drawn.visibility[0][mask] - expected).max() < 1e-5
    # Never too light: the union covers at most the sum.
    triangles = np.concatenate([m.positions[m.faces] for m in (first, second)]).astype(np.float64)
    some = np.random.default_rng(0).choice(len(points), 300, replace=False)
    true = disc_coverage.visible_fraction_sampled(points[some], triangles, to_light, radius, 256)
    assert (drawn.visibility[0][mask][some] - true).max() < 3.0 / np.sqrt(256)


def test_a_round_caster_has_no_seams_at_its_wedges_joints():
    """A faceted ball of 1104 triangles: some 100 wedges meet, and no pixel stands out."""
    ball = sphere_mesh(48, 24, 0.8, (0.0, 1.3, 0.0))
    to_light = direction(65, 40)
    drawn = Drawn([quad(4.0), ball], to_light, 9.0, size=(160, 160))
    mask = drawn.lit() & (np.abs(drawn.positions[..., 1]) < 1e-4)
    expected = 1.0 - np.clip(covered(drawn.positions[mask], [ball], to_light, np.radians(9.0)), 0.0, 1.0)
    error = np.zeros(mask.shape)
    error[mask] = drawn.visibility[0][mask] - expected
    assert ((expected > 0.01) & (expected < 0.99)).sum() > 300
    assert ndimage.label(np.abs(error) > 0.05)[1] == 0 and np.abs(error).max() < 0.01


def test_each_light_has_its_own_layer():
    caster = box((0.8, 1.2, 0.8))
    directions, radii = np.array([direction(50, 0), direction(35, 140), direction(80, 250)]), [3.0, 8.0, 14.0]
    drawn = Drawn([quad(4.0), caster], directions, radii)
    for light in range(3):
        alone = Drawn([quad(4.0), caster], directions[light], radii[light])
        assert np.array_equal(alone.visibility[0], drawn.visibility[light]) and drawn.visibility[light].std() > 0.05


def test_silhouettes_from_the_centre_are_the_published_ones_and_cover_too_little():
    caster, to_light, radius = box((0.8, 1.2, 0.8), turn=rotation(30, (0, 1, 0))), direction(88, 10), 10.0
    exact, centre = (Drawn([quad(4.0), caster], to_light, radius, centre=c, origin=(-4.0, 4.0, -5.0)) for c in (False, True))
    mask = exact.lit() & (np.abs(exact.positions[..., 1]) < 1e-4)
    difference = (centre.visibility - exact.visibility)[0][mask]
    assert difference.max() > 0.05 and difference.min() > -1e-5


def test_a_moved_caster_s_shadow_is_that_of_a_scene_made_anew():
    here, there = box((0.8, 1.2, 0.8)), box((0.8, 1.5, 0.6), (0.7, 0.3, -0.4), rotation(25, (1, 2, 0)))
    drawn = Drawn([quad(4.0), here], direction(50, 20), 7.0)
    before = drawn.visibility.copy()
    fresh = Drawn([quad(4.0), there], direction(50, 20), 7.0)
    made, moved = casters(drawn.scene), casters(fresh.scene)
    # Vertices of the same topology, in the order of the first scene's welded list.
    places = np.array(
        [moved.raw.reshape(-1, 3)[np.flatnonzero((made.raw.reshape(-1, 3) == p).all(1))[0]] for p in made.positions]
    )
    drawn.wedges.move(places, moved.raw)
    drawn.again()
    assert np.abs(drawn.visibility - before).max() > 0.5
    ground = fresh.lit() & (np.abs(fresh.positions[..., 1]) < 1e-4)
    assert np.abs(drawn.visibility - fresh.visibility)[0][ground].max() < 5e-4


def test_the_same_bits_again():
    caster, to_light, radius, view = random_case(3)
    one, other = (Drawn([quad(4.0), caster], to_light, radius, origin=tuple(view)) for _ in range(2))
    assert np.array_equal(one.visibility, other.visibility)


def test_layers_above_a_point():
    triangles = box((1.0, 1.0, 1.0)).positions.astype(np.float64).reshape(-1, 3, 3)
    up = np.array([0.02, 1.0, 0.03])
    assert layers_above(np.array([0.1, -1.0, 0.2]), up, triangles) == (1, 1)
    assert layers_above(np.array([0.1, 0.5, 0.2]), up, triangles) == (1, 0)
    assert layers_above(np.array([0.1, 2.0, 0.2]), up, triangles) == (0, 0)
