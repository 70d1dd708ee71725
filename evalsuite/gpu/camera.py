"""From the scene's camera to OpenGL: clip matrices and view rays of one sub-pixel sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.scene.model import Camera, Scene

Float = NDArray[np.float64]
CENTRE = (0.5, 0.5)


def depth_range(scene: Scene) -> tuple[float, float]:
    """(near, far) along the viewing axis, drawn in from the camera's own planes to what the meshes span: a 24-bit depth
    buffer then resolves it finely."""
    camera = scene.camera
    axis = np.linalg.inv(camera.to_world)[2]
    depths = [mesh.positions.astype(np.float64) @ axis[:3] + axis[3] for mesh in scene.meshes if len(mesh.positions)]
    if not depths:
        return camera.near, camera.far
    near = max(camera.near, 0.99 * min(d.min() for d in depths))
    far = min(camera.far, 1.01 * max(d.max() for d in depths))
    return (near, far) if far > near else (camera.near, camera.far)


def _axis_terms(camera: Camera) -> tuple[Float, Float]:
    """(scale, offset), each (x, y): camera-local p at depth z falls on crop coordinates (scale·p.xy/z + offset) ∈ [0, 1],
    from the left and from the top.

    Mitsuba: c = 1/tan(fov_x/2), a = W/H of the film, f = (½ − ½ c x/z, ½ − ½ a c y/z) on the film, then the crop
    (f·film − corner)/crop and the principal point −pp·film/crop.
    """
    film, crop = np.array(camera.film, np.float64), np.array(camera.crop[2:], np.float64)
    c = 1.0 / np.tan(0.5 * np.radians(camera.fov_x_deg))
    focal = np.array([c, c * film[0] / film[1]])
    scale = -0.5 * focal * film / crop
    offset = (0.5 * film - np.array(camera.crop[:2]) - np.array(camera.principal_point) * film) / crop
    return scale, offset


def world_to_clip(camera: Camera, near: float, far: float, subsample: tuple[float, float] = CENTRE) -> Float:
    """(4, 4) clip matrix that brings the given sub-sample of every pixel to its centre, where OpenGL samples."""
    scale, offset = _axis_terms(camera)
    x, y = offset - (np.array(subsample) - 0.5) / np.array(camera.size)
    clip = np.array([
        [2 * scale[0], 0, 2 * x - 1, 0],
        [0, -2 * scale[1], 1 - 2 * y, 0],
        [0, 0, (far + near) / (far - near), -2 * far * near / (far - near)],
        [0, 0, 1, 0],
    ])  # fmt: skip
    return clip @ np.linalg.inv(camera.to_world)


def view_rays(camera: Camera, subsample: tuple[float, float] = CENTRE) -> tuple[Float, Float]:
    """(origin, step), each (x, y): the ray through window coordinates w (bottom-left origin) is (origin + step·w, 1) in the
    camera frame."""
    scale, offset = _axis_terms(camera)
    size = np.array(camera.size, np.float64)
    # Window y runs upwards: crop y = 1 − w_y/H. The pixel centre w stands for the sub-sample.
    shift = (np.array(subsample) - 0.5) / size
    step = np.array([1.0, -1.0]) / size / scale
    origin = (np.array([0.0, 1.0]) + shift - offset) / scale
    return origin, step


def position(camera: Camera) -> Float:
    """The camera's world position, (3,)."""
    return camera.to_world[:3, 3].astype(np.float64)


def viewing_axis(camera: Camera) -> Float:
    """Unit world direction in which the camera looks, (3,)."""
    axis = camera.to_world[:3, 2]
    return axis / np.linalg.norm(axis)
