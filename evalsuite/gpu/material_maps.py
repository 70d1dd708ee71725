"""A material's bitmaps as textures, uniforms and #defines of the forward shaders (glsl/surface.glsl)."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from hashlib import blake2b

import moderngl
import numpy as np

from evalsuite.gpu import context
from evalsuite.scene.model import Material, Texture

_WRAP = {"repeat": 0, "mirror": 1, "clamp": 2}
_CACHED = 16
_textures: OrderedDict[bytes, moderngl.Texture] = OrderedDict()


def of(material: Material) -> tuple[dict[str, object], dict[str, object], Mapping[str, object]]:
    """(textures, uniforms, defines) for the parameters of a material that are bitmaps, and for its normal map.

    A `reflectance` is the shader's diffuse_reflectance.
    """
    maps = {("diffuse_reflectance" if name == "reflectance" else name): t for name, t in material.textures.items()}
    if material.normal_map is not None:
        maps["normal"] = material.normal_map
    textures, uniforms, defines = {}, {}, {}
    for name, texture in maps.items():
        textures[f"{name}_map"] = _upload(texture)
        uniforms[f"{name}_to_uv"] = texture.to_uv
        uniforms[f"{name}_wrap"] = _WRAP[texture.wrap]
        defines[f"{name.upper()}_MAP"] = 1
    return textures, uniforms, defines


def _upload(texture: Texture) -> moderngl.Texture:
    """The texels with hardware's MIPs, kept between calls by content. Wrapping is the shader's: OpenGL's modes through
    moderngl lack the mirrored one."""
    texels = np.ascontiguousarray(texture.texels, np.float32)
    key = blake2b(texels.tobytes() + repr((texels.shape, texture.wrap, texture.nearest)).encode()).digest()
    if key not in _textures:
        while len(_textures) >= _CACHED:
            _textures.popitem(last=False)[1].release()
        height, width = texels.shape[:2]
        context.check_texture_size(f"texture {texture.source}", width, height)
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., :3] = texels
        made = context.get().texture((width, height), 4, rgba.tobytes(), dtype="f4")
        made.repeat_x = made.repeat_y = texture.wrap == "repeat"
        if texture.nearest:
            made.filter = (moderngl.NEAREST, moderngl.NEAREST)
        else:
            made.build_mipmaps()
            made.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        _textures[key] = made
    _textures.move_to_end(key)
    return _textures[key]
