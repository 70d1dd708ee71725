"""One full-resolution pass over a scene's meshes, again and again with the projection moved to another sub-sample."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b

import moderngl
import numpy as np
from numpy.typing import NDArray

from evalsuite.gpu import camera, context, programs
from evalsuite.scene.model import Scene, TriangleMesh

_CACHED_MESHES = 64


@dataclass(frozen=True, eq=False)
class Draw:
    """A program with what one material sets in it."""

    program: moderngl.Program
    uniforms: Mapping[str, object] = field(default_factory=dict)
    textures: Mapping[str, object] = field(default_factory=dict)


_meshes: OrderedDict[bytes, tuple[dict[str, moderngl.Buffer], moderngl.Buffer]] = OrderedDict()


def _buffers(mesh: TriangleMesh) -> tuple[dict[str, moderngl.Buffer], moderngl.Buffer]:
    """Vertex buffers by attribute and the index buffer, kept between calls by content."""
    uvs = np.zeros((len(mesh.positions), 2), np.float32) if mesh.uvs is None else mesh.uvs
    arrays = {"in_position": mesh.positions, "in_normal": mesh.normals, "in_uv": uvs}
    data = {name: np.ascontiguousarray(array, np.float32).tobytes() for name, array in arrays.items()}
    indices = np.ascontiguousarray(mesh.faces, np.uint32).tobytes()
    key = blake2b(b"|".join([*data.values(), indices])).digest()
    if key not in _meshes:
        while len(_meshes) >= _CACHED_MESHES:
            _meshes.popitem(last=False)
        gl = context.get()
        _meshes[key] = ({name: gl.buffer(raw) for name, raw in data.items()}, gl.buffer(indices))
    _meshes.move_to_end(key)
    return _meshes[key]


class Stage:
    """A scene's meshes and a float framebuffer of its picture's size with two RGBA attachments."""

    def __init__(self, scene: Scene) -> None:
        gl, (width, height) = context.get(), scene.camera.size
        context.check_texture_size("picture", width, height)
        self.scene, self.size = scene, (width, height)
        self._range = camera.depth_range(scene)
        self._meshes = [(mesh.material, *_buffers(mesh)) for mesh in scene.meshes if len(mesh.faces)]
        self._target = gl.framebuffer(
            [gl.texture((width, height), 4, dtype="f4") for _ in range(2)], gl.depth_renderbuffer((width, height))
        )
        self._depth = Draw(programs.program((programs.part("surface.vert"),), (programs.part("depth.frag"),)))
        self._mark = Draw(programs.program((programs.part("surface.vert"),), (programs.part("mark.frag"),)))
        self._arrays: dict[tuple[int, int], moderngl.VertexArray] = {}
        self.pass_ms: list[float] = []
        context.check_errors("setting up the framebuffer")

    def _vertex_array(self, index: int, program: moderngl.Program) -> moderngl.VertexArray:
        key = (index, program.glo)
        if key not in self._arrays:
            _, buffers, indices = self._meshes[index]
            # Compilers drop attributes that a shader does not use.
            content = [(b, "2f" if name == "in_uv" else "3f", name) for name, b in buffers.items() if name in program]
            self._arrays[key] = context.get().vertex_array(program, content, indices, index_element_size=4)
        return self._arrays[key]

    def clip(self, subsample: tuple[float, float]) -> NDArray[np.float64]:
        """World → clip matrix of a sub-sample, (4, 4)."""
        return camera.world_to_clip(self.scene.camera, *self._range, subsample)

    def run(self, subsample: tuple[float, float], materials: Sequence[Sequence[Draw]], background: Draw | None = None) -> None:
        """Depth pre-pass, then background where nothing was hit, then each mesh with its material's program.

        materials: the Draws, in order, of each of Scene.materials; none leaves its meshes out of the shading (they still
        hide others).
        """
        gl, scene = context.get(), self.scene
        common = {"world_to_clip": self.clip(subsample), "camera_position": camera.position(scene.camera),
                  "camera_axis": camera.viewing_axis(scene.camera)}  # fmt: skip
        self._target.use()
        self._target.depth_mask, self._target.color_mask = True, ((True,) * 4,) * 2
        self._target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        gl.finish()

        def submit() -> None:
            self._target.color_mask = ((False,) * 4,) * 2
            programs.set_uniforms(self._depth.program, common)
            for index in range(len(self._meshes)):
                self._vertex_array(index, self._depth.program).render()
            self._target.color_mask, self._target.depth_mask = ((True,) * 4,) * 2, False
            if background is not None:
                self._background(subsample, background)
            for index, (material, *_) in enumerate(self._meshes):
                for draw in materials[material]:
                    programs.set_uniforms(draw.program, {**common, **draw.uniforms})
                    programs.bind_textures(draw.program, draw.textures)
                    self._vertex_array(index, draw.program).render()

        self.pass_ms.append(timed(submit))
        context.check_errors("drawing")

    def _background(self, subsample: tuple[float, float], draw: Draw) -> None:
        origin, step = camera.view_rays(self.scene.camera, subsample)
        rays = {"ray_origin": origin, "ray_step": step, "camera_to_world": self.scene.camera.to_world[:3, :3]}
        programs.set_uniforms(draw.program, {**rays, **draw.uniforms})
        programs.bind_textures(draw.program, draw.textures)
        key = (-1, draw.program.glo)
        if key not in self._arrays:
            self._arrays[key] = context.get().vertex_array(draw.program, [])
        self._arrays[key].render(moderngl.TRIANGLES, vertices=3)

    def mark(self, subsample: tuple[float, float], scored: Sequence[float]) -> None:
        """After `run`: alpha of each visible surface, by the index of its material, also where a technique discards."""
        values = {"world_to_clip": self.clip(subsample), "camera_position": camera.position(self.scene.camera)}
        self._target.color_mask = ((False, False, False, True), (False,) * 4)
        for index, (material, *_) in enumerate(self._meshes):
            programs.set_uniforms(self._mark.program, {**values, "scored": scored[material]})
            self._vertex_array(index, self._mark.program).render()
        self._target.color_mask = ((True,) * 4,) * 2
        context.check_errors("marking what is scored")

    def run_background(self, subsample: tuple[float, float], background: Draw) -> None:
        """The environment along every view ray, no meshes."""
        self._target.use()
        self._target.depth_mask, self._target.color_mask = True, ((True,) * 4,) * 2
        self._target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        self._background(subsample, background)

    def read(self, attachment: int = 0) -> NDArray[np.float32]:
        """(H, W, 4) float32 of an attachment, row 0 at the top."""
        width, height = self.size
        raw = self._target.read(components=4, attachment=attachment, dtype="f4", alignment=1)
        return np.frombuffer(raw, np.float32).reshape(height, width, 4)[::-1]


def timed(submit: Callable[[], None]) -> float:
    """Run and return milliseconds: a timer query on a GPU; on a CPU renderer, whose queries lie, wall time to finish()."""
    gl = context.get()
    if not context.is_software(gl):
        query = gl.query(time=True)
        with query:
            submit()
        return query.elapsed * 1e-6
    start = time.perf_counter()
    submit()
    gl.finish()
    return 1e3 * (time.perf_counter() - start)


def background_draw(latlong: object, uniforms: Mapping[str, object]) -> Draw:
    """The program that shows a lat-long environment behind the scene."""
    fragment = (programs.part("latlong.glsl"), programs.part("background.frag"))
    return Draw(programs.program((programs.part("screen.vert"),), fragment), uniforms, {"env_latlong": latlong})
