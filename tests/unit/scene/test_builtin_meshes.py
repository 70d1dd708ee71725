"""The shipped meshes are what their generator writes, and sound: closed, wound outward, with unit normals."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import numpy as np
import pytest

from evalsuite.lights.adjacency import adjacency
from evalsuite.scene.builtin import scenes_directory


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate_meshes", scenes_directory() / "generate_meshes.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SMOOTH = ("sphere72", "torus", "teapot", "organic")
FACETED = ("column", *(f"dancer-{frame}" for frame in range(8)))
NAMES = (*SMOOTH, *FACETED)


def read_ply(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, normals, faces of a shipped mesh, read by hand: an oracle apart from the writer."""
    header, data = (scenes_directory() / "meshes" / f"{name}.ply").read_bytes().split(b"end_header\n", 1)
    counts = [int(line.split()[-1]) for line in header.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(data, "<f4", counts[0] * 6).reshape(-1, 6).astype(float)
    triangles = np.frombuffer(data[counts[0] * 24 :], [("n", "u1"), ("i", "<i4", 3)])
    assert len(triangles) == counts[1] and (triangles["n"] == 3).all()
    return vertices[:, :3], vertices[:, 3:], triangles["i"]


def components(faces: np.ndarray, count: int) -> np.ndarray:
    """Label of each vertex: the smallest vertex number of its connected surface."""
    label = np.arange(count)
    while True:
        lowest = label.copy()
        np.minimum.at(lowest, faces.ravel(), np.repeat(label[faces].min(1), 3))
        lowest = lowest[lowest]
        if (lowest == label).all():
            return label
        label = lowest


def test_nothing_else_ships(generator: ModuleType) -> None:
    assert set(generator.MESHES) == set(NAMES) == {path.stem for path in (scenes_directory() / "meshes").iterdir()}


@pytest.mark.parametrize("name", NAMES)
def test_generator_writes_the_shipped_bytes(generator: ModuleType, name: str) -> None:
    shipped = (scenes_directory() / "meshes" / f"{name}.ply").read_bytes()
    assert len(shipped) < 1_000_000
    assert generator.ply(name) == shipped


@pytest.mark.parametrize(
    "name, vertices, triangles",
    [("sphere72", 71 * 72 + 2, 2 * 71 * 72), ("torus", 144 * 72, 2 * 144 * 72), ("organic", 10242, 20480)],
)
def test_counts(name: str, vertices: int, triangles: int) -> None:
    positions, _, faces = read_ply(name)
    assert (len(positions), len(faces)) == (vertices, triangles)


@pytest.mark.parametrize("name, parts", [("sphere72", 1), ("torus", 1), ("teapot", 4), ("organic", 1)])
def test_closed_and_wound_outward(name: str, parts: int) -> None:
    positions, _, faces = read_ply(name)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 1).all(), "an edge run through twice in one direction"
    assert {tuple(e) for e in edges.tolist()} == {tuple(e[::-1]) for e in edges.tolist()}, "a hole"
    a, b, c = np.moveaxis(positions[faces], 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-6, "a degenerate triangle"
    label = components(faces, len(positions))[faces[:, 0]]
    volumes = [(np.cross(b, c) * a)[label == k].sum() / 6 for k in np.unique(label)]
    assert len(volumes) == parts and min(volumes) > 0


@pytest.mark.parametrize("name", NAMES)
def test_normals_are_unit_and_on_the_outer_side(name: str) -> None:
    positions, normals, faces = read_ply(name)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=2e-6)  # rounded to 2⁻²⁰ per coordinate
    a, b, c = np.moveaxis(positions[faces], 1, 0)
    face_normal = np.cross(b - a, c - a)
    assert ((normals[faces] * face_normal[:, None]).sum(-1) > 0).all()


@pytest.mark.parametrize("name", FACETED)
def test_facets_are_flat_and_the_body_closed(name: str) -> None:
    positions, normals, faces = read_ply(name)
    assert adjacency(positions, faces).closed
    a, b, c = np.moveaxis(positions[faces], 1, 0)
    face_normal = np.cross(b - a, c - a)
    assert (face_normal * a).sum() / 6 > 0.1, "a volume turned inside out"
    face_normal /= np.linalg.norm(face_normal, axis=1, keepdims=True)
    np.testing.assert_allclose(normals[faces], np.repeat(face_normal[:, None], 3, axis=1), atol=1e-4)


def test_sphere_and_torus_lie_on_their_surfaces() -> None:
    positions, normals, _ = read_ply("sphere72")
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 1, atol=2e-6)
    np.testing.assert_allclose(normals, positions, atol=2e-6)
    positions, normals, _ = read_ply("torus")
    x, y, z = positions.T
    np.testing.assert_allclose((np.hypot(x, z) - 1) ** 2 + y**2, 0.16, atol=4e-6)
    spine = np.stack([x / np.hypot(x, z), 0 * y, z / np.hypot(x, z)], -1)
    np.testing.assert_allclose(normals, (positions - spine) / 0.4, atol=1e-5)


def test_teapot_stands_on_the_ground() -> None:
    positions, _, _ = read_ply("teapot")
    assert abs(positions[:, 1].min()) < 2e-3
