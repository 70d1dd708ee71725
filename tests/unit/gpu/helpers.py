"""Scenes made directly from the model's dataclasses: no files, no Mitsuba."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.scene.model import Camera, Environment, Material, Scene, TriangleMesh


def look_at(origin, target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Camera to world as Mitsuba: +z looks at the target, +x is the image's left."""
    origin, target, up = (np.asarray(x, np.float64) for x in (origin, target, up))
    z = (target - origin) / np.linalg.norm(target - origin)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x, np.cross(z, x), z, origin
    return out


def sphere_mesh(segments=48, rings=24, radius=1.0, centre=(0.0, 0.0, 0.0), material=0, name="sphere") -> TriangleMesh:
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, segments + 1), indexing="ij")
    n = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij")
    a, b = i * (segments + 1) + j, (i + 1) * (segments + 1) + j
    faces = np.concatenate([np.stack([a, a + 1, b], -1).reshape(-1, 3), np.stack([a + 1, b + 1, b], -1).reshape(-1, 3)])
    positions = (n * radius + np.asarray(centre)).astype(np.float32)
    return TriangleMesh(name, positions, n.astype(np.float32), faces.astype(np.uint32), material)


def camera(size=(48, 48), origin=(0.0, 0.5, 4.0), fov=35.0, **more) -> Camera:
    return Camera(look_at(origin), fov, size, (0, 0, *size), **more)


def environment(radiance, to_world=None) -> Environment:
    radiance = np.asarray(radiance, np.float32)
    if radiance.ndim == 1:
        radiance = radiance[None, None, :]
    return Environment(radiance, np.eye(3) if to_world is None else np.asarray(to_world, np.float64), "test")


FURNACE = environment([0.7, 1.1, 2.0])


def ramp(height=17, width=32) -> Environment:
    """Each channel grows along its own lat-long axis."""
    u, v = np.meshgrid(np.arange(width) / width, np.arange(height) / (height - 1))
    return environment(np.stack([0.2 + u, 0.1 + v, 1.0 + 0.5 * np.sin(2 * np.pi * u)], -1))


def noise(height=17, width=32, seed=7, to_world=None) -> Environment:
    return environment(np.random.default_rng(seed).gamma(0.5, size=(height, width, 3)), to_world)


def rotation(degrees=37.0, axis=(1.0, 2.0, -0.5)) -> np.ndarray:
    k = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def material(plugin: str, two_sided=False, name=None, **parameters) -> Material:
    return Material(name or plugin, plugin, parameters, two_sided)


def scene(env: Environment, *materials: Material, size=(48, 48), meshes=None, subject=(), view=None, **more) -> Scene:
    meshes = (sphere_mesh(),) if meshes is None else tuple(meshes)
    return Scene("test", Path("test.xml"), view or camera(size, **more), meshes, tuple(materials), env, subject=subject)


def visible(drawing_scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixel-centre geometry of a one-sample picture: mask (H, W), normals and to_view of its pixels, (N, 3) float64."""
    from evalsuite.gpu.worker import gbuffer

    g = gbuffer(drawing_scene, 1)
    mask = g.coverage > 0
    to_view = drawing_scene.camera.to_world[:3, 3] - g.position[mask].astype(np.float64)
    to_view /= np.linalg.norm(to_view, axis=-1, keepdims=True)
    normal = g.normal[mask].astype(np.float64)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return mask, normal, to_view


_LOOKUP = """#version 430 core
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer In { vec4 query[]; };
layout(std430, binding = 1) writeonly buffer Out { vec4 answer[]; };
uniform samplerCube cube;
uniform int count;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(count)) answer[i] = textureLod(cube, query[i].xyz, query[i].w);
}
"""


def hardware_lookup(texture, directions, lod) -> np.ndarray:
    """textureLod(cube, direction, lod).rgb of each row, (N, 3), by a compute shader."""
    from evalsuite.gpu import context

    gl = context.get()
    query = np.concatenate([directions, np.broadcast_to(lod, len(directions))[:, None]], -1).astype(np.float32)
    source, out = gl.buffer(query.tobytes()), gl.buffer(reserve=query.nbytes)
    shader = gl.compute_shader(_LOOKUP)
    source.bind_to_storage_buffer(0)
    out.bind_to_storage_buffer(1)
    texture.use(0)
    shader["cube"].value, shader["count"].value = 0, len(query)
    shader.run((len(query) + 63) // 64)
    gl.memory_barrier()
    return np.frombuffer(out.read(), np.float32).reshape(-1, 4)[:, :3]
