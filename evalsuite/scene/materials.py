"""Mitsuba BSDFs as the model states them: canonical parameters, or the reason why the GPU side cannot draw them."""

from __future__ import annotations

from typing import Any

import numpy as np

from evalsuite.scene.model import DRAWABLE, Material, Rgb
from evalsuite.scene.parse import ParsedScene

#: Values of parameters that Mitsuba leaves out of `traverse` when the file does.
_DEFAULTS: dict[str, float | Rgb | str] = {"specular_reflectance": (1.0, 1.0, 1.0), "distribution": "beckmann"}


def describe_material(parsed: ParsedScene, index: int | None, bsdf: Any, name: str) -> Material:
    """Material of a BSDF node.

    index: the node, None for the BSDF that Mitsuba supplies to shapes without one (a diffuse). bsdf: the instance made
    from it. name: id to file it under.
    """
    if index is None:
        return _canonical(name, "diffuse", {}, _values(bsdf), False, "")
    location, two_sided, prefix = parsed.location(index), False, ""
    if parsed.plugin(index) == "twosided":
        inner = parsed.children(index, "BSDF")
        if len(inner) > 1:
            return Material(name, "twosided", {}, True, "its two sides differ", location)
        index, two_sided, prefix = inner[0], True, "brdf_0."
    properties = parsed.properties(index)
    plugin = parsed.plugin(index)
    if plugin not in DRAWABLE:
        return Material(name, plugin, {}, two_sided, "the GPU side has no such BSDF", location)
    return _canonical(name, plugin, properties, _values(bsdf, prefix), two_sided, location)


def _canonical(
    name: str, plugin: str, properties: dict[str, Any], values: dict[str, Any], two_sided: bool, location: str
) -> Material:
    parameters: dict[str, float | Rgb | str] = {}
    undrawable = None
    for key in DRAWABLE[plugin]:
        if key == "distribution":
            parameters[key] = str(properties.get(key, _DEFAULTS[key]))
        elif key in values:
            parameters[key] = _scalar(values[key]) if key in ("alpha", "exponent") else _rgb(values[key])
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
    return Material(name, plugin, parameters, two_sided, undrawable, location)


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
