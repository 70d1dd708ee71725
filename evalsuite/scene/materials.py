"""Mitsuba BSDFs as the model states them: canonical parameters, or the reason why the GPU side cannot draw them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from evalsuite.scene.model import DRAWABLE, Material, Rgb, Texture
from evalsuite.scene.parse import WRAPPERS, ParsedScene
from evalsuite.scene.textures import read_texture

#: Values of parameters that Mitsuba leaves out of `traverse` when the file does.
_DEFAULTS: dict[str, float | Rgb | str | bool] = {
    "specular_reflectance": (1.0, 1.0, 1.0),
    "distribution": "beckmann",
    "combine": "add",
    "nonlinear": False,
    "style": "sketch",
    "viewer": "distant",
}


def describe_material(parsed: ParsedScene, index: int | None, bsdf: Any, name: str) -> Material:
    """Material of a BSDF node.

    index: the node, None for the BSDF that Mitsuba supplies to shapes without one (a diffuse). bsdf: the instance made
    from it. name: id to file it under.
    """
    if index is None:
        return _canonical(name, "diffuse", {}, _values(bsdf), {})
    location, two_sided, prefix, normal_map, undrawable = parsed.location(index), False, "", None, None
    while parsed.plugin(index) in WRAPPERS:
        inner = parsed.children(index, "BSDF")
        if len(inner) > 1:
            return Material(name, "twosided", {}, True, "its two sides differ", location)
        if parsed.plugin(index) == "twosided":
            two_sided, prefix = True, prefix + "brdf_0."
        else:
            prefix += "nested_bsdf."
            normal_map = read_texture(parsed, parsed.child(index, "normalmap"))
            undrawable = None if normal_map else f"a normal map that is not a bitmap ({location})"
        index = inner[0]
    plugin = parsed.plugin(index)
    if plugin not in DRAWABLE:
        return Material(name, plugin, {}, two_sided, "the GPU side has no such BSDF", location)
    textures = {key: read_texture(parsed, parsed.child(index, key)) for key in DRAWABLE[plugin] if parsed.child(index, key)}
    textures = {key: texture for key, texture in textures.items() if texture}
    material = _canonical(name, plugin, parsed.properties(index), _values(bsdf, prefix), textures)
    return replace(material, two_sided=two_sided, location=location, normal_map=normal_map,
                   undrawable=undrawable or material.undrawable)  # fmt: skip


def _canonical(
    name: str, plugin: str, properties: dict[str, Any], values: dict[str, Any], textures: dict[str, Texture]
) -> Material:
    parameters: dict[str, float | Rgb | str | bool | Texture] = {}
    undrawable = None
    for key in DRAWABLE[plugin]:
        if isinstance(_DEFAULTS.get(key), str | bool):
            parameters[key] = type(_DEFAULTS[key])(properties.get(key, _DEFAULTS[key]))
        elif key in values:
            parameters[key] = _scalar(values[key]) if _is_number(plugin, key) else _rgb(values[key])
        elif key in textures and key.endswith("reflectance"):
            parameters[key] = textures[key]
        elif any(other.startswith(f"{key}.") for other in values):
            undrawable = undrawable or f"textured {key}"
        elif key in _DEFAULTS:
            parameters[key] = _DEFAULTS[key]
        elif key == "alpha" and {"alpha_u", "alpha_v"} <= values.keys():
            undrawable = "anisotropic alpha"
        else:
            undrawable = undrawable or f"{key} is not a constant"
    if plugin == "roughconductor" and not undrawable and properties.get("alpha_u") != properties.get("alpha_v"):
        undrawable = "anisotropic alpha"
    return Material(name, plugin, parameters, undrawable=undrawable)


def _is_number(plugin: str, key: str) -> bool:
    """Whether a parameter is one number and no colour: of conductors η is a colour, of dielectrics it is not."""
    return key in ("alpha", "exponent", "width", "strokes") or (key == "eta" and "k" not in DRAWABLE[plugin])


def _values(bsdf: Any, prefix: str = "") -> dict[str, Any]:
    """Constants under their plain names (`reflectance.value` → `reflectance`); textures keep their dotted keys."""
    import mitsuba as mi

    parameters = mi.traverse(bsdf)
    found = {}
    for key in parameters.keys():
        if key.startswith(prefix):
            found[key.removeprefix(prefix).removesuffix(".value")] = parameters[key]
    return found


def _scalar(value: Any) -> float:
    return float(np.ravel(np.array(value))[0])


def _rgb(value: Any) -> Rgb:
    values = [float(v) for v in np.ravel(np.array(value))]
    red, green, blue = values if len(values) == 3 else values[:1] * 3
    return red, green, blue
