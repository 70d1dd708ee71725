"""Mitsuba's bitmap textures as plain arrays: their texels as Mitsuba itself evaluates them."""

from __future__ import annotations

import numpy as np

from evalsuite.scene.model import Texture
from evalsuite.scene.parse import ParsedScene


def read_texture(parsed: ParsedScene, index: int | None) -> Texture | None:
    """The Texture of a `bitmap` node; None for other plugins. Raises EvalsuiteError for a file that cannot be read."""
    if index is None or parsed.plugin(index) != "bitmap":
        return None
    import drjit as dr
    import mitsuba as mi

    properties = parsed.properties(index)
    texture = ParsedScene(parsed.source).instantiate(index)
    parameters = mi.traverse(texture)
    height, width, *_ = np.shape(np.array(parameters["data"]))
    to_uv = np.eye(3)
    to_uv[:2] = np.array(parameters["to_uv"].matrix, np.float64)[:2, :3]
    # At a texel's centre the interpolated value is the texel, converted from sRGB where Mitsuba does so.
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    u, v, _ = np.linalg.inv(to_uv) @ np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    si = dr.zeros(mi.SurfaceInteraction3f, x.size)
    si.uv = mi.Point2f(u, v)
    texels = np.array(texture.eval(si), np.float32)
    texels = np.broadcast_to(texels, (3, x.size)).T.reshape(height, width, 3)
    return Texture(
        np.ascontiguousarray(texels),
        to_uv,
        str(properties.get("wrap_mode", "repeat")),
        properties.get("filter_type", "bilinear") == "nearest",
        str(properties.get("filename", "")),
    )
