"""Conversions between the four representations: energy, directions, layouts."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.image import environment_maps as maps
from evalsuite.math import cubemap, sh
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles

KINDS = list(maps.REPRESENTATIONS)
VIEW = (0.3, -0.2, 1.0)
COEFFICIENTS = np.random.default_rng(8).normal(size=(9, 3)) * 0.2
COEFFICIENTS[0] = 3.0
MEAN = COEFFICIENTS[0] / np.sqrt(4 * np.pi)
DIRECTIONS = np.random.default_rng(3).normal(size=(4000, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=-1, keepdims=True)


def smooth() -> maps.LatLong:
    return maps.LatLong((sh.basis(latlong_directions(128, 256)) @ COEFFICIENTS).astype(np.float32))


def noisy() -> maps.LatLong:
    return maps.LatLong(np.random.default_rng(2).gamma(0.3, size=(64, 128, 3)).astype(np.float32))


def away_from_the_rim(kind: str, angle: float = 15.0) -> np.ndarray:
    towards = DIRECTIONS @ (-np.array(VIEW) / np.linalg.norm(VIEW))
    return towards < np.cos(np.radians(angle)) if kind == "sphere" else np.ones(len(DIRECTIONS), bool)


@pytest.mark.parametrize("to", KINDS)
@pytest.mark.parametrize("origin", KINDS)
def test_every_conversion_keeps_energy_and_directions(origin, to):
    source = maps.convert(smooth(), origin, view=VIEW)
    made = maps.convert(source, to, view=VIEW)
    np.testing.assert_allclose(made.integral(), source.integral(), rtol=5e-5)
    np.testing.assert_allclose(made.integral() / (4 * np.pi), MEAN, rtol=2e-4)  # of the bilinear lat-long map itself
    where = away_from_the_rim(origin) & away_from_the_rim(to)
    exact = sh.basis(DIRECTIONS) @ COEFFICIENTS
    assert exact.std() > 0.1
    np.testing.assert_allclose(made.lookup(DIRECTIONS)[where] / MEAN, exact[where] / MEAN, rtol=0, atol=0.01)


@pytest.mark.parametrize("to", KINDS)
def test_energy_of_a_rough_map_at_any_size(to):
    source = noisy()
    for size in (8, 32, 200):
        residual = maps.convert(source, to, size=size, view=VIEW).integral() / source.integral() - 1
        # Texels that a paraboloid's circle cuts hold the mean of their whole footprint, which shows in a map of 8 × 8.
        assert np.abs(residual).max() < (5e-3 if size == 8 else 2e-3), size


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_read_back_as_they_were(kind):
    made = maps.convert(noisy(), kind, view=VIEW)
    picture, header = made.picture()
    assert maps.recognise(picture, header) == kind
    back = maps.REPRESENTATIONS[kind].from_picture(picture, header)
    np.testing.assert_array_equal(back.lookup(DIRECTIONS), made.lookup(DIRECTIONS))
    np.testing.assert_allclose(back.integral(), made.integral(), rtol=1e-12)


def test_layouts():
    """A light in one direction appears where the documentation says."""

    def brightest(to, direction, **more):
        d = np.asarray(direction) / np.linalg.norm(direction)
        lobe = np.exp(60 * (latlong_directions(64, 128) @ d - 1))[..., None] * np.ones(3)
        picture = maps.convert(maps.LatLong(lobe), to, **more).picture()[0][..., 0]
        row, column = np.unravel_index(picture.argmax(), picture.shape)
        return (column + 0.5) / picture.shape[1], (row + 0.5) / picture.shape[0]

    for face, axis in enumerate(cubemap.AXIS):
        assert brightest("cube", axis) == pytest.approx(((face + 0.5) / 6, 0.5), abs=0.03)
    assert brightest("cube", (0.0, 0.5, 1.0)) == pytest.approx((4.5 / 6, 0.25), abs=0.03)  # up is up on the side faces
    assert brightest("paraboloid", (0, 0, 1)) == pytest.approx((0.25, 0.5), abs=0.02)
    assert brightest("paraboloid", (0, 0, -1)) == pytest.approx((0.75, 0.5), abs=0.02)
    x, y = brightest("paraboloid", (0.5, 0.5, 0.7))
    assert 0.3 < x < 0.45 and 0.1 < y < 0.4  # right of and above the front map's middle
    assert brightest("sphere", VIEW, view=VIEW) == pytest.approx((0.5, 0.5), abs=0.03)
    x, y = brightest("sphere", (0.6, 0.6, 0.2))
    assert x > 0.65 and y < 0.35
    assert brightest("latlong", (0, 0.02, -1))[1] == pytest.approx(0.5, abs=0.03)


def test_default_sizes_hold_as_many_texels():
    source = maps.LatLong(np.ones((128, 256, 3), np.float32))
    cube = maps.convert(source, "cube")
    paraboloid, sphere = maps.convert(cube, "paraboloid"), maps.convert(cube, "sphere")
    assert cube.faces.shape == (6, 64, 64, 3)
    assert 2 * np.pi * paraboloid.radius**2 == pytest.approx(6 * 64**2)
    assert np.pi * sphere.radius**2 == pytest.approx(6 * 64**2)
    assert paraboloid.border >= 2 and sphere.border >= 1
    for made in (cube, paraboloid, sphere):
        assert maps.convert(made, "latlong").radiance.shape == (128, 256, 3)


def test_lat_long_texels_are_means_over_their_cells():
    one = np.zeros((6, 2, 2, 3))
    one[2] = 1.0  # the upper face
    made = maps.convert(maps.Cube(one), "latlong", size=64)
    assert made.radiance.shape == (32, 64, 3)
    omega = latlong_solid_angles(32, 64)
    assert (made.radiance[..., 0] * omega).sum() == pytest.approx(maps.Cube(one).integral()[0], rel=2e-3)
    np.testing.assert_allclose(made.radiance[0], np.broadcast_to(made.radiance[0, :1], (64, 3)), atol=1e-2)  # the pole


def test_recognition():
    assert maps.recognise(np.zeros((4, 24, 3)), {}) == "cube"
    assert maps.recognise(np.zeros((32, 64, 3)), {}) == maps.recognise(np.zeros((33, 64, 3)), {}) == "latlong"
    assert maps.recognise(np.zeros((1, 1, 3)), {}) == "latlong"
    assert maps.recognise(np.zeros((64, 64, 3)), {}) is None
    assert maps.recognise(np.zeros((32, 64, 3)), {maps.LAYOUT: "paraboloid"}) == "paraboloid"


@pytest.mark.parametrize(("kind", "shape", "header", "message"), [
    ("cube", (4, 20, 3), {}, "six square faces"), ("paraboloid", (4, 9, 3), {}, "two square maps"),
    ("sphere", (4, 5, 3), {}, "a square map"), ("sphere", (8, 8, 3), {maps.VIEW: "0 0 0"}, "evalsuite_view"),
    ("sphere", (8, 8, 3), {maps.VIEW: "up"}, "evalsuite_view"),
    ("paraboloid", (8, 16, 3), {maps.BORDER: "x"}, "evalsuite_border"),
    ("paraboloid", (8, 16, 3), {maps.BORDER: 4.0}, "from 0 to 2"),
])  # fmt: skip
def test_what_a_picture_cannot_be(kind, shape, header, message):
    with pytest.raises(EvalsuiteError, match=message):
        maps.REPRESENTATIONS[kind].from_picture(np.zeros(shape), header)
