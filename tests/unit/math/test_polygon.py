"""Light from triangles, rays against them, and values on their lattices."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.math import mesh_colors, polygon
from evalsuite.math.probe import subsample_offsets


def quadrature(point, normal, triangle, cells=400):
    """∫ (n·l)₊ cos θ' / r² dA over the triangle, at midpoints."""
    uv = (np.arange(cells) + 0.5) / cells
    u, v = (x[np.add.outer(uv, uv) < 1] for x in np.meshgrid(uv, uv, indexing="ij"))
    e1, e2 = triangle[1] - triangle[0], triangle[2] - triangle[0]
    ray = triangle[0] + u[:, None] * e1 + v[:, None] * e2 - point
    across, r = np.cross(e1, e2), np.linalg.norm(ray, axis=1)
    area = 0.5 * np.linalg.norm(across)
    cosine = np.maximum(ray @ normal, 0) / r * np.abs(ray @ across) / np.linalg.norm(across) / r
    return area * (cosine / r**2).mean()


@pytest.mark.parametrize("normal", [[0, 0, 1], [0.6, 0, 0.8], [-0.8, 0.36, 0.48], [0.96, 0.28, 0]])
def test_form_factor_is_the_integral_also_where_the_horizon_cuts(normal):
    triangle = np.array([[-1.0, -0.7, 1.0], [1.5, -0.5, 1.4], [0.2, 1.1, 0.8]])
    normal = np.array(normal, float)
    expected = quadrature(np.zeros(3), normal, triangle)
    assert expected > 0.05
    found = polygon.form_factor(np.zeros((1, 3)), normal[None], triangle)[0]
    assert found == pytest.approx(expected, rel=6e-3)  # midpoints along the diagonal and the horizon
    flipped = polygon.form_factor(np.zeros((1, 3)), normal[None], triangle[::-1])[0]
    assert flipped == pytest.approx(found, rel=1e-12)


def test_form_factor_of_a_square_above_and_of_one_below():
    """A square of side 2a at height h above a point: E = 4 · a/√(a²+h²) · atan(a/√(a²+h²)) (Howell, B-3, times π)."""
    a, h = 0.5, 1.7
    square = np.array([[-a, -a, h], [a, -a, h], [a, a, h], [-a, a, h]])
    x = a / np.hypot(a, h)
    halves = [polygon.form_factor(np.zeros((1, 3)), [[0, 0, 1]], square[i])[0] for i in ([0, 1, 2], [0, 2, 3])]
    assert sum(halves) == pytest.approx(4 * x * np.arctan(x), rel=1e-12)
    assert polygon.form_factor(np.zeros((1, 3)), [[0, 0, -1]], square[:3])[0] == 0


def test_first_hit_takes_the_nearest_and_only_the_front():
    near = np.array([[-1, -1, 1], [-1, 3, 1], [3, -1, 1]], float)
    triangles = np.stack([near + np.array([0, 0, 2]), near, near[::-1] - np.array([0, 0, 0.5])])
    directions = np.array([[0.1, 0.2, 1.0], [5.0, 0, 1.0], [0, 0, -1.0]])
    hit, u, v = polygon.first_hit((0, 0, 0), directions, triangles)
    assert hit.tolist() == [1, -1, -1]
    point = near[0] + u[0] * (near[1] - near[0]) + v[0] * (near[2] - near[0])
    np.testing.assert_allclose(point, directions[0], atol=1e-12)


def test_lattices_hold_linear_functions_exactly_and_number_every_sample_once():
    divisions, random = np.array([1, 7, 4]), np.random.default_rng(3)
    plane = random.normal(size=(3, 3))  # value = a + b u + c v, by triangle
    values = np.concatenate([plane[i, 0] + mesh_colors.lattice(n) @ plane[i, 1:] for i, n in enumerate(divisions)])[:, None]
    assert len(values) == mesh_colors.sample_count(divisions).sum() == 3 + 36 + 15
    triangles, uv = random.integers(3, size=500), random.dirichlet([1, 1, 1], 500)[:, 1:]
    uv[:6] = [[0, 0], [1, 0], [0, 1], [0.5, 0.5], [1 - 1e-16, 1e-17], [0, 1 - 1e-16]]
    found = mesh_colors.lookup(values, divisions, triangles, uv[:, 0], uv[:, 1])[:, 0]
    np.testing.assert_allclose(found, plane[triangles, 0] + (uv * plane[triangles, 1:]).sum(1), atol=1e-12)
    j, i = np.meshgrid(np.arange(8), np.arange(8), indexing="ij")
    inside = i + j <= 7
    assert sorted(mesh_colors.index(7, i[inside], j[inside])) == list(range(36))


def test_lattices_are_continuous_across_their_cells():
    divisions, random = np.array([5]), np.random.default_rng(4)
    values = random.normal(size=(21, 3))
    uv = random.dirichlet([1, 1, 1], 2000)[:, 1:]
    step = 1e-6 * random.normal(size=uv.shape)
    a, b = (mesh_colors.lookup(values, divisions, np.zeros(2000, int), *p.T) for p in (uv, uv + step))
    assert np.abs(a - b).max() < 5 * 5e-6 * np.abs(values).max() and np.abs(a).max() > 1


def test_every_row_and_column_of_a_texel_has_one_sample():
    offsets = subsample_offsets(4)
    assert (sorted((offsets[:, 0] * 16).astype(int)) == np.arange(16)).all()
    assert (sorted((offsets[:, 1] * 16).astype(int)) == np.arange(16)).all()
    np.testing.assert_allclose(offsets.mean(0), 0.5, atol=1e-12)
