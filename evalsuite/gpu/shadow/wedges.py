"""Penumbra wedges (Akenine-Möller and Assarsson 2002) for discs at infinity: visibility of each light in each pixel.

In each frame, on the GPU: planes of the triangles; positions of what the camera sees; for each light its silhouette edges, hard
shadow volumes of them, whose sides count the layers between a pixel and the light's centre, and wedges around them, in which
each pixel adds the part of the disc between edge and rim. Both go into one float buffer.

Sides are counted from the camera to the pixel ("z-pass"), with no caps: nothing opaque lies in between, and whether the camera
itself is in shadow is counted apart. Whether a side is crossed is asked of the pixel's position, with the same words and bits as
the wedge asks on which side of the disc's centre its edge passes, so that the two steps cancel.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import camera, context, programs
from evalsuite.gpu.passes import timed
from evalsuite.gpu.techniques.base import Frame, PassInputs
from evalsuite.lights.adjacency import Adjacency, adjacency
from evalsuite.math.disc_coverage import tangent_frame
from evalsuite.scene.model import Scene

DEPTH_CLAMP = 0x864F  # GL_DEPTH_CLAMP, unknown to moderngl
#: As parts of the scene's size, from float32's positions: heights over a receiver below which nothing counts as being before
#: the light, and distances from a plane below which a receiver lies in it.
SHORTEST, COPLANAR = 1e-6, 3e-6


def _part(name: str) -> programs.Part:
    return programs.Part(name, Path(__file__).with_name(name).read_text(encoding="utf-8"))


@dataclass(frozen=True, eq=False)
class Casters:
    """All triangles of a scene, welded mesh by mesh: adjacency with indices into one list, and `raw`, (T, 3, 3) float32, the
    triangles as they are drawn."""

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    edges: NDArray[np.int32]
    edge_faces: NDArray[np.int32]
    raw: NDArray[np.float32]


def casters(scene: Scene) -> Casters:
    """Every mesh casts. Meshes that touch stay apart: each is closed, or open, by itself."""
    parts: list[Adjacency] = [adjacency(mesh.positions, mesh.faces) for mesh in scene.meshes]
    vertex = np.cumsum([0, *(len(part.positions) for part in parts)])
    face = np.cumsum([0, *(len(part.faces) for part in parts)])
    return Casters(
        np.concatenate([part.positions for part in parts]).astype(np.float32),
        np.concatenate([part.faces + v for part, v in zip(parts, vertex[:-1], strict=True)]).astype(np.int32),
        np.concatenate([part.edges + v for part, v in zip(parts, vertex[:-1], strict=True)]).astype(np.int32),
        np.concatenate([
            np.where(part.edge_faces >= 0, part.edge_faces + f, -1) for part, f in zip(parts, face[:-1], strict=True)
        ]).astype(np.int32),
        np.concatenate([mesh.positions[mesh.faces] for mesh in scene.meshes]).astype(np.float32),
    )  # fmt: skip


def layers_above(origin: NDArray, direction: NDArray, triangles: NDArray) -> tuple[int, int]:
    """(facing, turned away): how many triangles (T, 3, 3) a ray from origin meets that face along `direction`, or away."""
    triangles = np.asarray(triangles, np.float64)
    a, e1, e2 = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(direction, e2)
    determinant = (e1 * p).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origin - a
        u = (s * p).sum(-1) / determinant
        q = np.cross(s, e1)
        v, t = q @ direction / determinant, (e2 * q).sum(-1) / determinant
        hit = (determinant != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    facing = np.cross(e1, e2) @ direction > 0
    return int((hit & facing).sum()), int((hit & ~facing).sum())


class Wedges:
    """Visibility of lights in the pixels of one picture, anew in each pass.

    directions: (L, 3) world, unit; radii: (L,) [rad]; centre: silhouettes as seen from the light's centre, for the whole
    penumbra (as published), instead of those that each pixel itself sees. Result: the texture `visibility`, a layer a light.
    """

    def __init__(self, scene: Scene, directions: NDArray, radii: NDArray, centre: bool) -> None:
        gl, (width, height) = context.get(), scene.camera.size
        context.check_texture_size("picture", width, height)
        self.scene, self.directions, self.radii = scene, np.asarray(directions, np.float64), np.asarray(radii, np.float64)
        made = casters(scene)
        self.edges, self.faces, self.raw = len(made.edges), len(made.faces), made.raw
        self.size = float(np.linalg.norm(np.ptp(made.positions, axis=0)))
        self._camera = camera.position(scene.camera)
        self._raw = gl.buffer(reserve=max(made.raw.nbytes, 16))
        self._positions = gl.buffer(reserve=16 * max(len(made.positions), 1))
        self._static = [
            gl.buffer(_padded(made.faces).tobytes()),
            gl.buffer(np.concatenate([made.edges, made.edge_faces], axis=1).astype(np.int32).tobytes()),
        ]
        self._planes = gl.buffer(reserve=16 * max(self.faces, 1))
        self._records = gl.buffer(reserve=64 * max(self.edges, 1))
        self._commands = gl.buffer(reserve=40)
        self.move(made.positions, made.raw)

        self._plane_shader = programs.compute((_part("planes.comp"),))
        self._resolve = programs.compute((_part("resolve.comp"),))
        side, edge = _part("side.glsl"), _part("edge.glsl")
        defines = (("CENTRE", 1),) if centre else ()
        self._silhouettes = programs.compute((_part("silhouettes.comp"),), defines)
        self._position = programs.program((_part("position.vert"),), (_part("position.frag"),))
        self._hard = programs.program((side, edge, _part("hard.vert")), (side, _part("hard.frag")))
        self._wedge = programs.program((side, edge, _part("wedge.vert")), (side, _part("wedge.frag")), defines)
        self._triangles = gl.vertex_array(self._position, [(self._raw, "3f", "in_position")])
        self._sides = self._instanced(self._hard)
        self._wedges = self._instanced(self._wedge)

        self._seen = _texture((width, height), 4)
        self._covered = _texture((width, height), 2)
        depth = gl.depth_renderbuffer((width, height))
        self._seen_target = gl.framebuffer([self._seen], depth)
        self._covered_target = gl.framebuffer([self._covered], depth)
        self.visibility = gl.texture_array((width, height, len(self.directions)), 1, dtype="f4")
        self.visibility.filter = (moderngl.NEAREST, moderngl.NEAREST)
        context.check_errors("setting up the wedges")

    def move(self, positions: NDArray, raw: NDArray) -> None:
        """New places of the same vertices: positions (V, 3) welded, in the order of `casters`; raw (T, 3, 3)."""
        self.raw = np.asarray(raw, np.float32)
        self._positions.write(_padded(np.asarray(positions, np.float32)).tobytes())
        self._raw.write(self.raw.tobytes())
        facts = [layers_above(self._camera, direction, self.raw) for direction in self.directions]
        self._lowest = (self.raw.reshape(-1, 3) @ self.directions.T).min(axis=0) - 1e-3 * self.size
        self._camera_layers = [(float(facing), float(away)) for facing, away in facts]

    def _instanced(self, program: moderngl.Program) -> moderngl.VertexArray:
        names = [name if name in program else None for name in ("in_from", "in_to", "in_left", "in_right")]
        layout = " ".join("4f" if name else "16x" for name in names) + "/i"
        return context.get().vertex_array(program, [(self._records, layout, *(name for name in names if name))])

    def before_pass(self, frame: Frame, clip: NDArray) -> PassInputs:
        """All lights' visibility in the pixels of one sub-sample."""
        context.get().finish()
        milliseconds = timed(lambda: self._draw(clip))
        context.check_errors("drawing shadows")
        return PassInputs({}, {"visibility": self.visibility}, milliseconds)

    def _draw(self, clip: NDArray) -> None:
        gl = context.get()
        self._orient()
        self._see(clip)
        gl.enable_direct(DEPTH_CLAMP)  # neither plane cuts a volume open
        gl.blend_func = (moderngl.ONE, moderngl.ONE)
        for light in range(len(self.directions)):
            self._cover(light, clip)
            self.visibility.bind_to_image(0, read=False, write=True)
            programs.set_uniforms(self._resolve, {"light": light})
            programs.bind_textures(self._resolve, {"covered": self._covered})
            width, height = self._covered.size
            self._resolve.run((width + 7) // 8, (height + 7) // 8)
            gl.memory_barrier()
        gl.disable_direct(DEPTH_CLAMP)
        gl.cull_face = "back"
        gl.depth_func = "<="
        gl.enable_only(moderngl.DEPTH_TEST)

    def _orient(self) -> None:
        """The triangles' planes, where the vertices are now."""
        for unit, buffer in enumerate([self._positions, self._static[0], self._planes, self._static[1], self._records]):
            buffer.bind_to_storage_buffer(unit)
        self._commands.bind_to_storage_buffer(5)
        programs.set_uniforms(self._plane_shader, {"faces": self.faces})
        self._plane_shader.run((self.faces + 63) // 64)
        context.get().memory_barrier()

    def _see(self, clip: NDArray) -> None:
        gl = context.get()
        self._seen_target.use()
        self._seen_target.depth_mask = True
        self._seen_target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        programs.set_uniforms(self._position, {"world_to_clip": clip})
        self._triangles.render()

    def _cover(self, light: int, clip: NDArray) -> None:
        gl, direction, radius = context.get(), self.directions[light], self.radii[light]
        tangent, bitangent = tangent_frame(direction)
        common = {"to_light": direction, "tangent": tangent, "bitangent": bitangent, "world_to_clip": clip,
                  "camera_position": self._camera}  # fmt: skip
        programs.set_uniforms(
            self._silhouettes, {"edges": self.edges, "to_light": direction, "sin_radius": float(np.sin(radius))}
        )
        self._silhouettes.run()
        gl.memory_barrier()
        self._covered_target.use()
        self._covered_target.depth_mask = False
        self._covered_target.clear(*self._camera_layers[light], 0.0, 0.0)  # the depth stays: it may not be written
        gl.enable_only(moderngl.BLEND)
        programs.set_uniforms(self._hard, common)
        programs.bind_textures(self._hard, {"positions": self._seen})
        self._sides.render_indirect(self._commands, moderngl.TRIANGLES, count=1)
        # Back faces behind the pixel: what lies before the wedge is left to the shader, and the camera may be within.
        gl.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        gl.cull_face, gl.depth_func = "front", ">="
        wedge = {"tan_radius": np.tan(radius), "lowest": self._lowest[light],
                 "shortest": SHORTEST * self.size, "coplanar": COPLANAR * self.size}  # fmt: skip
        programs.set_uniforms(self._wedge, {**common, **{k: float(v) for k, v in wedge.items()}})
        programs.bind_textures(self._wedge, {"positions": self._seen})
        self._wedges.render_indirect(self._commands, moderngl.TRIANGLES, count=1, first=1)

    def read(self) -> NDArray[np.float32]:
        """Visibility as last drawn, (L, H, W), row 0 at the top."""
        width, height, layers = self.visibility.size
        return np.frombuffer(self.visibility.read(), np.float32).reshape(layers, height, width)[:, ::-1]


def _texture(size: tuple[int, int], components: int) -> moderngl.Texture:
    texture = context.get().texture(size, components, dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def _padded(rows: NDArray) -> NDArray:
    """(N, 3) → (N, 4), as storage buffers hold vectors."""
    out = np.zeros((max(len(rows), 1), 4), rows.dtype)
    out[: len(rows), :3] = rows
    return out
