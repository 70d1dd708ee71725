"""Lat-long conventions: closed forms, exact integrals, and Mitsuba's own envmap as the oracle."""

import numpy as np
import pytest

from evalsuite.math.sphere import (
    direction_to_latlong,
    latlong_directions,
    latlong_lookup,
    latlong_solid_angles,
    latlong_to_direction,
)


def random_directions(count, seed=1):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("direction", "uv"),
    [((0, 0, -1), (0, 0.5)), ((1, 0, 0), (0.25, 0.5)), ((0, 0, 1), (0.5, 0.5)), ((-1, 0, 0), (0.75, 0.5)), ((0, 5, 0), (0.5, 0))],
)
def test_axes(direction, uv):
    u, v = direction_to_latlong(direction)
    assert v == pytest.approx(uv[1])
    if direction[1] == 0:  # u is arbitrary at a pole
        assert u == pytest.approx(uv[0])


def test_round_trip():
    d = random_directions(10000)
    u, v = direction_to_latlong(d)
    assert u.min() >= 0 and u.max() < 1
    assert np.abs(latlong_to_direction(u, v) - d).max() < 1e-14


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (2, 3), (3, 2), (17, 31), (256, 512)])
def test_solid_angles_sum_to_the_sphere(shape):
    omega = latlong_solid_angles(*shape)
    assert omega.shape == shape and omega.min() > 0
    assert omega.sum() == pytest.approx(4 * np.pi, rel=1e-14)


@pytest.mark.parametrize("shape", [(2, 3), (5, 4), (9, 7)])
def test_solid_angles_integrate_the_interpolant_exactly(shape):
    texels = np.random.default_rng(3).random((*shape, 1)) + 0.1
    height, width = shape
    # Gauss-Legendre within each cell, over which the interpolant is smooth: exact to rounding.
    nodes, weights = np.polynomial.legendre.leggauss(12)
    v = ((np.arange(height - 1)[:, None] + (nodes + 1) / 2) / (height - 1)).ravel()
    u = ((np.arange(width)[:, None] + (nodes + 1) / 2 + 0.5) / width).ravel()
    wv = np.tile(weights / 2 / (height - 1), height - 1) * np.pi * np.sin(np.pi * v)
    wu = np.tile(weights / 2 / width, width) * 2 * np.pi
    values = latlong_lookup(texels, latlong_to_direction(u[None, :], v[:, None]))[..., 0]
    integral = wv @ values @ wu
    assert (texels[..., 0] * latlong_solid_angles(*shape)).sum() == pytest.approx(integral, rel=1e-12)


def test_texel_directions_return_their_texels():
    texels = np.random.default_rng(4).random((8, 10, 3))
    assert np.abs(latlong_lookup(texels, latlong_directions(8, 10))[1:-1] - texels[1:-1]).max() < 1e-12


def maps():
    ramp = np.zeros((17, 31, 3), np.float32)
    ramp[..., 0] = np.arange(31)
    ramp[..., 1] = np.arange(17)[:, None]
    one = np.zeros((17, 31, 3), np.float32)
    one[5, 7] = 100
    corner = np.zeros((9, 8, 3), np.float32)
    corner[0, 0], corner[8, 7] = 1, 2  # pole rows are texels like others
    noise = np.random.default_rng(5).random((33, 64, 3)).astype(np.float32)
    return {"ramp": ramp, "one texel": one, "poles": corner, "noise": noise}


@pytest.mark.parametrize("name", list(maps()))
@pytest.mark.parametrize("turned", [False, True])
def test_lookup_is_mitsubas(name, turned):
    from evalsuite.reference.variants import activate
    from evalsuite.scene.environment import evaluate
    from evalsuite.scene.load import environment_plugin
    from evalsuite.scene.model import Environment

    mi = activate()
    import drjit as dr

    to_world = np.eye(3)
    if turned:  # a rotation and a reflection
        matrix = mi.ScalarTransform4f().rotate([1, 2, 3], 40).matrix
        to_world = np.linalg.qr(np.array(matrix, np.float64)[:3, :3])[0] @ np.diag([1.0, 1.0, -1.0])
    environment = Environment(maps()[name], to_world, name)
    directions = random_directions(20000)
    si = dr.zeros(mi.SurfaceInteraction3f, len(directions))
    si.wi = -mi.Vector3f(np.ascontiguousarray(directions.T.astype(np.float32)))
    theirs = np.array(environment_plugin(environment).eval(si)).T
    ours = evaluate(environment, directions)
    peak = float(environment.radiance.max())
    assert theirs.max() > 0.2 * peak  # the comparison sees the map's bright part
    # float32 directions and rotation: some 5e-7 of the circle, times 64 texels around, times full steps in u and in v.
    assert np.abs(ours - theirs).max() < 1e-4 * peak
