"""Writes every mesh of `scenes/meshes/` anew, byte for byte: `python scenes/generate_meshes.py [-o DIRECTORY]`.

NumPy only. Each builder returns (positions, faces): one or more closed surfaces, y up, wound counter-clockwise seen from
outside. Normals are smooth, weighted by the corner angles (exact ones where the surface has a formula); `flat` ones have facets.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Faces = NDArray[np.int64]
#: Coordinates are rounded to this grid, so that a last-bit difference of sin or cos between processors leaves no trace.
GRID = 2.0**-20


def grid_faces(rows: int, columns: int, wrap_rows: bool = False) -> Faces:
    """Triangles of a rows × columns vertex grid, periodic in columns; row index grows along ∂p/∂u × (this) outward."""
    i, j = np.meshgrid(np.arange(rows if wrap_rows else rows - 1), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns
    return np.concatenate([np.stack([a, c, d], -1).reshape(-1, 3), np.stack([a, d, b], -1).reshape(-1, 3)])


def capped_tube(rings: Points) -> tuple[Points, Faces]:
    """Closed surface through (R, C, 3) rings; the first and the last ring shrink to their centres as poles."""
    count, columns = rings.shape[:2]
    positions = np.concatenate([rings.reshape(-1, 3), [rings[0].mean(0), rings[-1].mean(0)]])
    first, last = count * columns, count * columns + 1
    j = np.arange(columns)
    k = (j + 1) % columns
    start = np.stack([np.full(columns, first), j, k], -1)
    end = np.stack([np.full(columns, last), (count - 1) * columns + k, (count - 1) * columns + j], -1)
    return positions, np.concatenate([grid_faces(count, columns), start, end])


def revolve(profile: Points, columns: int) -> tuple[Points, Faces]:
    """Closed body of revolution about y of an (R, 2) profile (radius > 0, height), listed from the top to the bottom."""
    phi = 2 * np.pi * np.arange(columns) / columns
    radius, height = profile[:, :1], np.broadcast_to(profile[:, 1:], (len(profile), columns))
    return capped_tube(np.stack([radius * np.sin(phi), height, radius * np.cos(phi)], -1))


def spline(points: list[tuple[float, ...]], steps: int) -> Points:
    """Centripetal Catmull-Rom curve through the points (no overshoot or cusp), `steps` samples a segment."""
    p = np.asarray(points, float)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    t = np.concatenate([[0.0], np.cumsum(np.sqrt(np.linalg.norm(np.diff(p, axis=0), axis=1)))])[:, None]
    curve = []
    for i in range(1, len(p) - 2):
        s = t[i] + (t[i + 1] - t[i]) * np.arange(steps)[:, None] / steps
        a = [(p[k] * (t[k + 1] - s) + p[k + 1] * (s - t[k])) / (t[k + 1] - t[k]) for k in (i - 1, i, i + 1)]
        b = [(a[k] * (t[i + 1 + k] - s) + a[k + 1] * (s - t[i - 1 + k])) / (t[i + 1 + k] - t[i - 1 + k]) for k in (0, 1)]
        curve.append((b[0] * (t[i + 1] - s) + b[1] * (s - t[i])) / (t[i + 1] - t[i]))
    return np.concatenate([*curve, p[-2:-1]])


def tube_rings(curve: Points, columns: int) -> Points:
    """Cross-sections (R, C, 3) of a tube along an (R, 3) curve of (x, y, radius) in the plane z = 0."""
    tangent = np.gradient(curve[:, :2], axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.stack([tangent[:, 1], -tangent[:, 0], np.zeros(len(curve))], -1)
    phi = 2 * np.pi * np.arange(columns)[:, None] / columns
    centre = np.concatenate([curve[:, :2], np.zeros((len(curve), 1))], -1)
    offset = np.cos(phi) * across[:, None] + np.sin(phi) * np.array([0.0, 0.0, 1.0])
    return centre[:, None] + curve[:, None, 2:] * offset


def hollow_tip(rings: Points) -> Points:
    """The rings, and three more that run back into the last one: a rounded lip and a dark mouth."""
    tip, centre = rings[-1], rings[-1].mean(0)
    outward = centre - rings[-2].mean(0)
    outward /= np.linalg.norm(outward)
    mouth = [centre + (tip - centre) * size + outward * along for size, along in ((0.88, 0.008), (0.68, -0.02), (0.48, -0.15))]
    return np.concatenate([rings, mouth])


def merge(*parts: tuple[Points, Faces]) -> tuple[Points, Faces]:
    """The parts as one mesh."""
    starts = np.cumsum([0, *(len(positions) for positions, _ in parts[:-1])])
    return (
        np.concatenate([positions for positions, _ in parts]),
        np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=True)]),
    )


def sphere72() -> tuple[Points, Faces]:
    """Unit sphere of 72 slices × 72 stacks about y: 71·72 + 2 vertices, 2·71·72 triangles."""
    theta = np.pi * np.arange(1, 72) / 72
    positions, faces = revolve(np.stack([np.sin(theta), np.cos(theta)], -1), 72)
    positions[-2:] = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]
    return positions, faces


def torus() -> tuple[Points, Faces]:
    """Torus about y of radii 1 and 0.4: 144 × 72 vertices, 2·144·72 triangles."""
    phi, psi = np.meshgrid(2 * np.pi * np.arange(144) / 144, 2 * np.pi * np.arange(72) / 72, indexing="ij")
    ring = 1 + 0.4 * np.cos(psi)
    positions = np.stack([ring * np.sin(phi), 0.4 * np.sin(psi), ring * np.cos(phi)], -1).reshape(-1, 3)
    return positions, grid_faces(144, 72, wrap_rows=True)


def teapot() -> tuple[Points, Faces]:
    """A teapot of four closed, overlapping surfaces: body, lid with knob, spout, handle. Stands on y = 0."""
    body = [(0.02, 1.27), (0.50, 1.275), (0.565, 1.30), (0.585, 1.345), (0.625, 1.35), (0.645, 1.31), (0.70, 1.22)]
    body += [(0.86, 1.03), (0.98, 0.78), (1.00, 0.53), (0.90, 0.29), (0.73, 0.135), (0.655, 0.085), (0.645, 0.055)]
    body += [(0.69, 0.02), (0.665, 0.002), (0.60, 0.0), (0.02, 0.0)]
    lid = [(0.012, 1.752), (0.075, 1.738), (0.125, 1.69), (0.13, 1.64), (0.085, 1.585), (0.066, 1.545), (0.10, 1.508)]
    lid += [(0.25, 1.472), (0.42, 1.415), (0.53, 1.35), (0.545, 1.325), (0.52, 1.30), (0.02, 1.29)]
    spout = [(0.62, 0.42, 0.30), (0.95, 0.47, 0.265), (1.20, 0.62, 0.20), (1.36, 0.88, 0.145), (1.52, 1.14, 0.115)]
    spout += [(1.64, 1.27, 0.115), (1.70, 1.315, 0.125)]
    handle = [(-0.70, 1.13, 0.085), (-1.02, 1.19, 0.075), (-1.33, 1.17, 0.072), (-1.53, 1.02, 0.075)]
    handle += [(-1.53, 0.80, 0.078), (-1.38, 0.58, 0.075), (-1.16, 0.42, 0.075), (-0.80, 0.30, 0.10)]
    return merge(
        revolve(spline(body, 4), 96),
        revolve(spline(lid, 4), 64),
        capped_tube(hollow_tip(tube_rings(spline(spout, 8), 32))),
        capped_tube(tube_rings(spline(handle, 8), 24)),
    )


def icosphere(levels: int) -> tuple[Points, Faces]:
    """Unit icosahedron, each triangle split in four `levels` times: 20·4^levels triangles."""
    g = (1 + 5**0.5) / 2
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    corners += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    fan = "0 11 5 0 5 1 0 1 7 0 7 10 0 10 11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5"
    faces = np.array([*fan.split(), *"2 4 11 6 2 10 8 6 7 9 8 1".split()], np.int64).reshape(-1, 3)
    positions = np.array(corners, float)
    for _ in range(levels):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        unique, index = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = index.reshape(3, -1) + len(positions)
        a, b, c = faces.T
        positions = np.concatenate([positions, positions[unique].mean(1)])
        faces = np.concatenate([np.stack(t, -1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return positions / np.linalg.norm(positions, axis=1, keepdims=True), faces


def gradient_noise(points: Points, seed: int) -> NDArray[np.float64]:
    """Gradient noise of (N, 3) points, about −1…1, from an integer hash of the lattice: the same on every machine."""
    cell = np.floor(points).astype(np.int64)
    local = points - cell
    fade = local**3 * (local * (local * 6 - 15) + 10)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        key = ((cell + corner) * [73856093, 19349663, 83492791]).sum(1) + seed * 40503
        key = (key ^ (key >> 13)) * 1274126177 & 0x7FFFFFFF
        gradient = np.stack([(key >> shift & 255) / 127.5 - 1 for shift in (3, 11, 19)], -1)
        weight = np.prod(np.where(corner, fade, 1 - fade), axis=1)
        total += weight * ((local - corner) * gradient).sum(1)
    return total


def organic() -> tuple[Points, Faces]:
    """Icosphere of 20 480 triangles, displaced along its radius by four octaves of noise, the finer ones ridged."""
    positions, faces = icosphere(5)
    radius = 1 + 0.42 * gradient_noise(positions * 1.4 + 5.2, 1) + 0.24 * gradient_noise(positions * 2.9, 2)
    radius += 0.13 * (0.25 - np.abs(gradient_noise(positions * 4.7, 3))) + 0.05 * gradient_noise(positions * 9.5, 4)
    return positions * radius[:, None], faces


def flat(positions: Points, faces: Faces) -> tuple[Points, Faces]:
    """The same triangles with corners of their own, so that each keeps its own normal."""
    return positions[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


def prism(profile: Points, columns: int, turn: float = 0.0) -> tuple[Points, Faces]:
    """Closed body of `columns` flat sides about y through an (R, 2) profile (radius, height), listed from the top: R − 1 rings of
    sides and two caps, 2·columns·(R − 1) + 2·(columns − 2) triangles."""
    phi = 2 * np.pi * np.arange(columns) / columns + turn
    radius, height = profile[:, :1], np.broadcast_to(profile[:, 1:], (len(profile), columns))
    rings = np.stack([radius * np.sin(phi), height, radius * np.cos(phi)], -1)
    count, j = len(profile), np.arange(1, columns - 1)
    top = np.stack([np.zeros_like(j), j, j + 1], -1)
    bottom = (count - 1) * columns + np.stack([np.zeros_like(j), j + 1, j], -1)
    return rings.reshape(-1, 3), np.concatenate([grid_faces(count, columns), top, bottom])


def column() -> tuple[Points, Faces]:
    """A column of 438 triangles on y = 0: square plinth and abacus, a shaft of 19 sides that swells towards its foot."""
    square = 2**0.5
    plinth = prism(np.array([[0.42 * square, 0.16], [0.42 * square, 0.0]]), 4, np.pi / 4)
    abacus = prism(np.array([[0.42 * square, 2.36], [0.42 * square, 2.2]]), 4, np.pi / 4)
    profile = [(0.36, 2.2), (0.36, 2.12), (0.25, 2.02), (0.25, 1.9), (0.268, 1.5), (0.284, 1.1), (0.294, 0.7)]
    profile += [(0.3, 0.45), (0.3, 0.3), (0.38, 0.22), (0.38, 0.16)]
    return flat(*merge(plinth, prism(np.array(profile), 19), abacus))


FRAMES = 8


def dancer(frame: int) -> tuple[Points, Faces]:
    """A figure that bends, twists and strides in a circle: 8 frames of one topology, 388 triangles."""
    t = 2 * np.pi * frame / FRAMES
    ring, side = np.linspace(0.0, 1.0, 14), 2 * np.pi * np.arange(14) / 14
    width = 0.10 + 0.2 * np.sin(np.pi * ring) ** 2 + 0.08 * np.cos(3 * np.pi * ring) ** 2
    twist = 1.6 * np.sin(t) * ring
    phi = side + twist[:, None]
    flattened = np.stack([width[:, None] * np.sin(phi) * 1.35, np.zeros_like(phi), width[:, None] * np.cos(phi) * 0.7], -1)
    lean, sway = 0.55 * np.sin(t) * ring**2, 0.35 * np.cos(2 * t) * np.sin(np.pi * ring)
    height = (1.75 - 0.25 * np.sin(t) ** 2) * ring + 0.02 + 0.25 * (1 + np.cos(2 * t)) / 2
    middle = np.stack([lean + 0.7 * np.cos(t), height, sway + 0.7 * np.sin(t)], -1)
    rings = (middle[:, None] + flattened)[::-1]
    count, columns = rings.shape[:2]
    j = np.arange(1, columns - 1)
    top = np.stack([np.zeros_like(j), j, j + 1], -1)
    bottom = (count - 1) * columns + np.stack([np.zeros_like(j), j + 1, j], -1)
    return flat(rings.reshape(-1, 3), np.concatenate([grid_faces(count, columns), top, bottom]))


def smooth_normals(positions: Points, faces: Faces) -> Points:
    """(V, 3) unit normals: face normals weighted by the angle at the vertex."""
    corners = positions[faces]
    face_normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face_normal /= np.linalg.norm(face_normal, axis=1, keepdims=True)
    normals = np.zeros_like(positions)
    for k in range(3):
        a, b = (corners[:, (k + step) % 3] - corners[:, k] for step in (1, 2))
        cosine = (a * b).sum(1) / (np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))
        np.add.at(normals, faces[:, k], face_normal * np.arccos(np.clip(cosine, -1, 1))[:, None])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def torus_normals(positions: Points) -> Points:
    """Exact normals of the torus of radii 1 and 0.4."""
    centre = positions * [1.0, 0.0, 1.0]
    return (positions - centre / np.linalg.norm(centre, axis=1, keepdims=True)) / 0.4


#: name → builder of (positions, faces), and the exact normals where the surface has a formula.
MESHES: dict[str, tuple[Callable[[], tuple[Points, Faces]], Callable[[Points], Points] | None]] = {
    "sphere72": (sphere72, lambda positions: positions),
    "torus": (torus, torus_normals),
    "teapot": (teapot, None),
    "organic": (organic, None),
    "column": (column, None),
    **{f"dancer-{frame}": (partial(dancer, frame), None) for frame in range(FRAMES)},
}


def ply(name: str) -> bytes:
    """The mesh as a binary little-endian PLY file: float32 positions and normals, int32 triangles."""
    build, exact = MESHES[name]
    positions, faces = build()
    normals = exact(positions) if exact else smooth_normals(positions, faces)
    vertices = (np.round(np.concatenate([positions, normals], 1) / GRID) * GRID + 0.0).astype("<f4")
    triangles = np.empty(len(faces), [("count", "u1"), ("index", "<i4", 3)])
    triangles["count"], triangles["index"] = 3, faces
    header = ["ply", "format binary_little_endian 1.0", f"comment evalsuite {name}", f"element vertex {len(vertices)}"]
    header += [f"property float {axis}" for axis in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    return "\n".join(header).encode() + vertices.tobytes() + triangles.tobytes()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "meshes", help="directory")
    directory = parser.parse_args().output
    directory.mkdir(parents=True, exist_ok=True)
    for name in MESHES:
        (directory / f"{name}.ply").write_bytes(ply(name))


if __name__ == "__main__":
    main()
