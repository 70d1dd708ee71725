"""What the four non-photorealistic techniques share: a sphere map that belongs to the viewer, looked up without a light."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import Float, Parameter, Prepared, Settings, StandsFor
from evalsuite.math import npr
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

PAPER = "Heidrich: Environment Maps and Their Applications (course notes), §4 and Fig 15"
TWIN_REASON = "float32 coordinates of p in a map that steps from 1 to 0 between neighbouring texels"
LIBRARY = ("npr.glsl",)
VIEWER = Parameter(
    "viewer", "distant", "distant: v₀ is the camera's axis everywhere, as in §2.1; local: each point's own view direction",
    "material", common.choice(*npr.VIEWERS), "distant or local",
)  # fmt: skip
FILTER = Parameter(
    "filter", "hardware", "hardware: trilinear at the hardware's own λ; finest: bilinear in level 0", "technique",
    common.choice("hardware", "finest"), "hardware or finest",
)  # fmt: skip


def _frame(value: object) -> list[list[float]]:
    rows = np.asarray(value, dtype=np.float64)
    if rows.shape != (3, 3) or not np.allclose(rows @ rows.T, np.eye(3), atol=1e-6):
        raise ValueError(value)
    return rows.tolist()


FRAME = Parameter(
    "frame", None, "rows right, up and towards the viewer of the map, world; default: the camera's", "technique", _frame,
    "three orthogonal unit vectors",
)  # fmt: skip
ASSUMPTIONS = (
    "The map belongs to the viewer: it turns with the camera, and neither light nor environment reaches it.",
    "A distant viewer (§2.1): off the axis by an angle a, a silhouette falls 1 − cos(a/2) of the map's radius short of its rim.",
)


def map_size(default: int | None, meaning: str = "") -> Parameter:
    """Parameter map_size [texels]."""
    return Parameter("map_size", default, f"width of the map [texels]{meaning}", "technique", common.FACE_SIZE.parse,
                     common.FACE_SIZE.expected)  # fmt: skip


def frame(scene: Scene) -> Float:
    """(3, 3), rows right, up and towards the viewer of the scene's camera, world, unit."""
    to_world = scene.camera.to_world[:3, :3].astype(np.float64)
    rows = to_world.T * np.array([[-1.0], [1.0], [-1.0]])  # local +x is the image's left, +z looks away from the viewer
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """The camera's frame, which the look-up is in."""
    return {} if settings["frame"] is not None else {"frame": FRAME.parse(frame(scene))}


def defines(settings: Settings) -> dict[str, object]:
    """#defines of library/npr.glsl."""
    wanted = {"LOCAL_VIEWER": settings["viewer"] == "local", "FINEST": settings["filter"] == "finest"}
    return {name: 1 for name, on in wanted.items() if on}


def chain(style: str, settings: Settings) -> list[Float]:
    """The map's MIP levels, kept for the next picture or twin with the same settings."""
    plain = tuple((name, settings[name]) for name in ("cool", "warm", "width", "strokes") if name in settings)
    return _chain(style, plain, settings["map_size"], settings.get("hierarchy", "box"))


@lru_cache(maxsize=4)
def _chain(style: str, parameters: tuple, size: int, hierarchy: str) -> list[Float]:
    return npr.levels(style, dict(parameters), size, hierarchy)


def prepare(style: str) -> Callable[[GpuEnvironment, Settings, Scene], Prepared]:
    """Uploads the map of a style with its MIP levels."""

    def prepare_map(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
        import moderngl

        from evalsuite.gpu import context

        start, gl = time.perf_counter(), context.get()
        size = settings["map_size"]
        context.check_texture_size("map_size", size, size)
        texture = gl.texture((size, size), 4, dtype="f4")
        texture.build_mipmaps()  # allocates the chain
        for number, level in enumerate(chain(style, settings)):
            rgba = np.ones((*level.shape[:2], 4), np.float32)
            rgba[..., :3] = level
            texture.write(rgba.tobytes(), level=number)
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        context.check_errors("uploading the map")
        rows = np.asarray(settings["frame"])
        elapsed = 1e3 * (time.perf_counter() - start)
        return Prepared({"npr_frame": rows, "npr_up": rows[1]}, {"npr_map": texture}, elapsed)

    return prepare_map


def twin(style: str) -> Callable[[Environment, Float, Float, Settings, Settings], Float]:
    """The look-up in float64: bilinear in level 0, or trilinear where the settings give the hardware's `lambda`, (N,)."""

    def look_up(environment: Environment, normals: Float, to_view: Float, material: Settings, settings: Settings) -> Float:
        p = npr.coordinates(normals, to_view, settings["frame"], settings["viewer"])
        return npr.trilinear(chain(style, settings), p, settings.get("lambda", 0.0))

    return look_up


def stands_for(style: str) -> dict[str, StandsFor]:
    """The `npr` BSDF of one style."""

    def reason_against(material: Material) -> str | None:
        other = material.parameters.get("style", "sketch")
        if material.normal_map is not None:
            return "npr under a normal map, which Mitsuba does not look up"
        return None if other == style else f"npr of style {other}"

    return {"npr": StandsFor("npr's map as it is", lambda material, settings: {}, reason_against)}


def target_bsdf(style: str, *names: str) -> Callable[[Settings], dict[str, object]]:
    """The `npr` BSDF with the named parameters."""
    return lambda settings: {"type": "npr", "style": style, **{name: settings[name] for name in ("viewer", *names)}}
