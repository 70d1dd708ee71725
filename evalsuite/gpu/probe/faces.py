"""Six 90° views of the room from one point, straight into a cubemap with its MIPs and SH coefficients (Kautz et al. §5.1)."""

from __future__ import annotations

from functools import cached_property

import moderngl
import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import context, programs
from evalsuite.gpu.environment import Cube
from evalsuite.gpu.passes import timed
from evalsuite.math import cubemap, mesh_colors, sh
from evalsuite.math.probe import SH_FACE_SIZE, SUBSAMPLES
from evalsuite.scene.model import Room

CLIP_DISTANCE = 0x3000  # GL_CLIP_DISTANCE0, unknown to moderngl


class Probe:
    """A room's triangles and light on the GPU, and a cubemap that they are drawn into.

    room: see `scene.model.Room`. face_size: of the cubemap. lit_here: light from the lamps, formed anew in each frame without
    shadows and interreflection, instead of the light that was baked.
    """

    def __init__(self, room: Room, face_size: int, lit_here: bool) -> None:
        gl, width = context.get(), face_size * SUBSAMPLES
        context.check_texture_size(f"a probe with faces of {face_size}²", width, 6 * width)
        self.room, self.face_size = room, face_size
        corners = np.ascontiguousarray(room.corners, np.float32)
        self._buffers = [gl.buffer(data.tobytes()) for data in self._storage(room, lit_here)]
        offsets = programs.part("library/probe_samples.glsl")
        fragment, defines = (programs.part("library/probe.frag"),), (("LIT_HERE", 1),) if lit_here else ()
        vertex = (programs.part("library/cube_faces.glsl"), offsets, programs.part("library/probe.vert"))
        self._program = programs.program(vertex, fragment, defines)
        self._uniforms = {"subsamples": SUBSAMPLES, "face_size": float(face_size), "lamps": len(lamps(room)[0])}
        self._vertices = gl.vertex_array(self._program, [(gl.buffer(corners.tobytes()), "3f", "in_position")])
        self._drawn = gl.texture((width, 6 * width), 4, dtype="f4")
        self._drawn.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._target = gl.framebuffer([self._drawn], gl.depth_renderbuffer((width, 6 * width)))
        self._resolve = programs.compute((offsets, programs.part("library/probe_resolve.comp")))
        self._project = programs.compute((programs.part("library/probe_sh.comp"),))
        level = min(SH_FACE_SIZE, face_size)
        self._sh_level = (face_size // level).bit_length() - 1
        weights = sh.basis(cubemap.texel_directions(level)) * cubemap.texel_solid_angles(level)[None, :, :, None]
        self._weights = gl.buffer(weights.astype(np.float32).tobytes())
        self._coefficients = gl.buffer(reserve=9 * 16)
        self.texture = gl.texture_cube((face_size, face_size), 4, dtype="f4")
        self.texture.build_mipmaps()
        context.check_errors("setting up the probe")

    @staticmethod
    def _storage(room: Room, lit_here: bool) -> list[NDArray]:
        lattice = np.stack([mesh_colors.first_sample(room.divisions), room.divisions], axis=-1).astype(np.int32)
        if not lit_here:
            return [lattice, _vec4(room.radiance)]
        triangles, radiance = lamps(room)
        lamp = np.concatenate([triangles, radiance[:, None]], axis=1).reshape(-1, 3)
        return [lattice, _vec4(room.emission), _vec4(room.reflectance), _vec4(normals(room)), _vec4(np.atleast_2d(lamp))]

    def draw(self, centre: NDArray[np.float64]) -> float:
        """Draw the six faces from centre, filter them, project them; returns the milliseconds it took."""
        gl = context.get()
        far = 1.01 * float(np.linalg.norm(self.room.corners.reshape(-1, 3) - np.asarray(centre), axis=1).max())
        place = {"centre": tuple(float(c) for c in centre), "depth_range": (1e-3 * far, far)}

        def submit() -> None:
            self._target.use()
            self._target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
            gl.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            for plane in range(4):
                gl.enable_direct(CLIP_DISTANCE + plane)
            gl.depth_func = "<"
            for unit, buffer in enumerate(self._buffers):
                buffer.bind_to_storage_buffer(unit)
            programs.set_uniforms(self._program, {**self._uniforms, **place})
            self._vertices.render(moderngl.TRIANGLES, instances=6 * SUBSAMPLES**2)
            for plane in range(4):
                gl.disable_direct(CLIP_DISTANCE + plane)
            programs.set_uniforms(self._resolve, {"subsamples": SUBSAMPLES})
            programs.bind_textures(self._resolve, {"drawn": self._drawn})
            self.texture.bind_to_image(0, read=False, write=True, level=0)
            groups = (self.face_size + 7) // 8
            self._resolve.run(groups, groups, 6)
            gl.memory_barrier()
            self.texture.build_mipmaps()
            self.texture.bind_to_image(0, read=True, write=False, level=self._sh_level)
            self._weights.bind_to_storage_buffer(0)
            self._coefficients.bind_to_storage_buffer(1)
            self._project.run()
            gl.memory_barrier()

        gl.finish()
        milliseconds = timed(submit)
        self.texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        gl.enable_only(moderngl.DEPTH_TEST)
        context.check_errors("drawing the probe")
        self.__dict__.pop("cube", None)
        return milliseconds

    @property
    def coefficients(self) -> NDArray[np.float32]:
        """L_i, (9, 3), of the faces last drawn."""
        return np.frombuffer(self._coefficients.read(), np.float32).reshape(9, 4)[:, :3].copy()

    @cached_property
    def cube(self) -> Cube:
        """The faces last drawn."""
        return Cube(self.texture, self.face_size, 0.0, 0.0)

    def coverage(self) -> float:
        """Part of the sphere that the room fills; what it leaves open is black."""
        faces = [np.frombuffer(self.texture.read(face), np.float32).reshape(-1, 4)[:, 3] for face in range(6)]
        omega = cubemap.texel_solid_angles(self.face_size).ravel()
        return float(sum(face @ omega for face in faces) / (4.0 * np.pi))


def normals(room: Room) -> NDArray[np.float64]:
    """(F, 3) unit normals of the triangles, towards the side that is seen."""
    corners = room.corners.astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-30)


def lamps(room: Room) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Triangles that emit, (L, 3, 3), and the mean radiance of each, (L, 3)."""
    first = mesh_colors.first_sample(room.divisions)
    emission = np.add.reduceat(room.emission.astype(np.float64), first) / mesh_colors.sample_count(room.divisions)[:, None]
    shining = emission.max(axis=1) > 0
    return room.corners[shining].astype(np.float64), emission[shining]


def _vec4(rows: NDArray) -> NDArray[np.float32]:
    padded = np.zeros((max(len(rows), 1), 4), np.float32)
    padded[: len(rows), :3] = rows
    return padded
