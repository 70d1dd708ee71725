"""The non-photorealistic maps: coordinates, pictures, and the MIP hierarchy whose ring keeps its width."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from evalsuite.math import npr
from evalsuite.math.phong import reflect
from evalsuite.math.sphere_map import direction_to_disc

PARAMETERS = {"cool": npr.COOL, "warm": npr.WARM, "width": 2.0, "strokes": 28.0}
FRAME = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
FRAME[0] *= np.linalg.det(FRAME)  # right × up = towards the viewer


def directions(count, seed=3):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def facing(count=4000, seed=3):
    """Unit normals and view directions with n·v > 0 and the view within 25° of v₀."""
    n, wobble = directions(count, seed), directions(count, seed + 1)
    v = FRAME[2] + np.tan(np.radians(25)) * np.random.default_rng(seed).uniform(0, 0.7, (count, 1)) * wobble
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where((n * v).sum(-1, keepdims=True) < 0, -n, n), v


def test_seen_along_the_axis_both_viewers_read_the_normal():
    n, _ = facing()
    n = np.where((n @ FRAME[2])[:, None] < 0, -n, n)
    v = np.broadcast_to(FRAME[2], n.shape)
    for viewer in npr.VIEWERS:
        np.testing.assert_allclose(npr.coordinates(n, v, FRAME, viewer), n @ FRAME[:2].T, atol=1e-7)


def test_distant_viewer_is_the_sphere_map_of_the_reflected_direction():
    n, v = facing()
    p = npr.coordinates(n, v, FRAME, "distant")
    h = FRAME[2] + reflect(v, n)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    np.testing.assert_allclose(p, h @ FRAME[:2].T, atol=1e-6)
    np.testing.assert_allclose(p, np.stack(direction_to_disc(reflect(v, n) @ FRAME.T), -1))


def test_silhouettes_lie_on_the_rim_for_a_local_viewer_and_short_of_it_for_a_distant_one():
    _, v = facing(500)
    n = np.cross(v, directions(500, 9))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    np.testing.assert_allclose(np.linalg.norm(npr.coordinates(n, v, FRAME, "local"), axis=-1), 1, atol=1e-12)
    off_axis = np.arccos(np.clip(v @ FRAME[2], -1, 1))
    assert off_axis.max() > 0.2
    np.testing.assert_allclose(np.linalg.norm(npr.coordinates(n, v, FRAME), axis=-1), np.cos(off_axis / 2), atol=1e-9)


def test_the_blurred_circle_is_the_convolution():
    sigma, rho = npr.BLUR, npr.CIRCLE_RADIUS
    for distance in (0.0, 0.1, 0.2, 0.35, 0.6):
        truth, _ = dblquad(
            lambda a, r, d=distance: (
                r * np.exp(-(r * r + d * d - 2 * r * d * np.cos(a)) / (2 * sigma**2)) / (2 * np.pi * sigma**2)
            ),
            0, rho, 0, 2 * np.pi,
        )  # fmt: skip
        assert npr.blurred_disc(np.array(distance)) == pytest.approx(truth, abs=1e-6)


def test_cool_and_warm_far_from_the_seam_and_no_colour_beyond_them_and_white():
    light = np.array(npr.LIGHT)
    colours = npr.cool_warm(np.stack([-0.9 * light, 0.9 * light, npr.CIRCLE * light]), npr.COOL, npr.WARM)
    np.testing.assert_allclose(colours[0], npr.COOL, atol=1e-3)
    np.testing.assert_allclose(colours[1], npr.WARM, atol=0.03)
    assert (colours[2] > npr.WARM).all() and (colours[2] < 1).all()
    everywhere = npr.cool_warm(npr.texel_positions(64), npr.COOL, npr.WARM)
    assert everywhere.min() > 0 and everywhere.max() < 1


def test_hatching_covers_what_it_says():
    """The mean darkness of a thin annulus is the strokes' duty: ½ (ρ − start)/(1 − start), the second set independent of it."""
    p = npr.texel_positions(1024, 2)
    radius = np.linalg.norm(p, axis=-1)
    ink = npr.strokes(p, 200.3)
    for rho in (0.3, 0.6, 0.7, 0.9):
        ring = np.abs(radius - rho) < 0.01
        covers = [0.5 * max(0.0, (rho - start) / (1 - start)) for start in npr.HATCH_FROM]
        assert ink[ring].mean() == pytest.approx(1 - (1 - covers[0]) * (1 - covers[1]), abs=0.005)


def ring_widths(chain):
    """Width [texels] of the ring on each level, from the area of what it leaves of the disc."""
    return [0.5 * len(level) - np.sqrt(level[..., 0].sum() / np.pi) for level in chain]


def test_every_level_of_the_equal_hierarchy_has_a_ring_of_the_same_width_and_box_filtering_loses_it():
    width = 3.0
    equal, box = (ring_widths(npr.levels("silhouette", {"width": width}, 256, h)) for h in ("equal", "box"))
    np.testing.assert_allclose(equal[:6], width, atol=0.02)  # 256 … 8 texels: as long as the ring fits into the disc
    np.testing.assert_allclose(equal[6:], [2, 1, 0.5])  # all black
    np.testing.assert_allclose(box, [width / 2**k for k in range(9)], atol=0.02)


@pytest.mark.parametrize("style", ["sketch", "cool-warm", "hatching"])
def test_levels_keep_the_mean_of_the_map(style):
    chain = npr.levels(style, PARAMETERS, 64, subsamples=8)
    assert [len(level) for level in chain] == [64, 32, 16, 8, 4, 2, 1]
    fine = npr.colour(style, npr.texel_positions(64, 16), PARAMETERS).mean((0, 1))
    assert 0.05 < fine.min()
    for level in chain:
        np.testing.assert_allclose(level.mean((0, 1)), fine, atol=5e-3)


def test_trilinear_blends_levels():
    chain = npr.levels("cool-warm", PARAMETERS, 64)
    p = np.random.default_rng(1).uniform(-1, 1, (50, 2))
    np.testing.assert_allclose(
        npr.trilinear(chain, p, 2.25), 0.75 * npr.trilinear(chain, p, 2) + 0.25 * npr.trilinear(chain, p, 3)
    )
    np.testing.assert_allclose(npr.trilinear(chain, p, 99), np.broadcast_to(chain[-1][0, 0], (50, 3)))
    # Bilinear interpolation of a smooth map: δ²/8 · f'' with δ = 2/64 and f'' ≈ 1/σ².
    np.testing.assert_allclose(npr.trilinear(chain, p, 0), npr.colour("cool-warm", p, PARAMETERS), atol=0.02)
