"""Plugin `npr`: a non-photorealistic map that the integrator `lookup` reads at the first hit (Heidrich, course notes §4).

It reflects no light: every other integrator sees it black. The maps are `math.npr.colour` in Dr.Jit, evaluated exactly.
"""

from __future__ import annotations

import math
from typing import Any

from evalsuite.errors import EvalsuiteError
from evalsuite.math import npr

NAME = "npr"
#: Attribute under which `lookup` reads the map: at si.uv = p, with what one pixel spans of p in si.duv_dx.x.
ATTRIBUTE = "npr_map"
#: Attribute that only the styles have which need that span.
FOOTPRINT = "npr_footprint"
#: Attribute of materials whose v₀ is each point's own view direction.
LOCAL_VIEWER = "npr_local_viewer"


def define_npr() -> type:
    """The plugin class for the active Mitsuba variant.

    Parameters: style (sketch), viewer (distant), cool and warm (RGB, of cool-warm), width [pixels] (2, of silhouette),
    strokes (28, of hatching). Constructing it raises EvalsuiteError for an unknown style or viewer, and for numbers that are
    not positive.
    """
    import drjit as dr
    import mitsuba as mi

    class Npr(mi.BSDF):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.style, self.viewer = str(props.get("style", "sketch")), str(props.get("viewer", "distant"))
            for name, word, words in (("style", self.style, npr.STYLES), ("viewer", self.viewer, npr.VIEWERS)):
                if word not in words:
                    raise EvalsuiteError(NAME, f"{name} '{word}'", f"one of {', '.join(words)}")
            for name, default in (("cool", npr.COOL), ("warm", npr.WARM)):
                if name not in props:
                    props[name] = mi.load_dict({"type": "rgb", "value": list(default)})
            self.cool, self.warm = props.get_texture("cool"), props.get_texture("warm")
            self.width, self.strokes = mi.Float(_positive(props, "width", 2.0)), mi.Float(_positive(props, "strokes", 28.0))
            self.parameters_changed([])
            self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def traverse(self, cb: Any) -> None:
            for name in ("cool", "warm", "width", "strokes"):
                cb.put(name, getattr(self, name), mi.ParamFlags.NonDifferentiable)

        def parameters_changed(self, keys: Any) -> None:
            dr.make_opaque(self.width, self.strokes)

        def has_attribute(self, name: str, active: Any = True) -> Any:
            own = {ATTRIBUTE: True, FOOTPRINT: self.style == "silhouette", LOCAL_VIEWER: self.viewer == "local"}
            return mi.Bool(own.get(name, False)) & active

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            p = si.uv
            if self.style == "cool-warm":
                value = _cool_warm(p, self.cool.eval(si, active), self.warm.eval(si, active))
            elif self.style == "silhouette":
                value = mi.Color3f(dr.select(1.0 - dr.norm(p) < self.width * si.duv_dx.x, 0.0, 1.0))
            else:
                ink = _window_bars(p) if self.style == "sketch" else _strokes(p, self.strokes)
                value = mi.Color3f(dr.select(ink, 0.0, 1.0))
            return dr.select(active, value, 0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
            return dr.zeros(mi.BSDFSample3f), mi.Color3f(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            return mi.Color3f(0.0), mi.Float(0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def to_string(self) -> str:
            return f"{NAME}[style={self.style}, viewer={self.viewer}]"

    return Npr


def _positive(props: Any, name: str, default: float) -> float:
    value = float(props.get(name, default))
    if not (math.isfinite(value) and value > 0.0):
        raise EvalsuiteError(NAME, f"{name} {value:g}", "a finite number > 0")
    return value


def _window_bars(p: Any) -> Any:
    """math.npr.window_bars."""
    import drjit as dr

    squared = dr.minimum(dr.squared_norm(p), 1.0)
    h_z = dr.sqrt(1.0 - squared)
    x, y, z = 2.0 * h_z * p.x, 2.0 * h_z * p.y, 1.0 - 2.0 * squared
    sine, cosine = math.sin(math.radians(npr.ROOM_TURN)), math.cos(math.radians(npr.ROOM_TURN))
    x, z = dr.abs(cosine * x - sine * z), dr.abs(sine * x + cosine * z)
    wall = dr.maximum(x, z)
    across, up = dr.minimum(x, z) / wall, dr.abs(y / wall - npr.RAISED)
    inside = (across < npr.WINDOW[0] + npr.BAR) & (up < npr.WINDOW[1] + npr.BAR)
    bar = dr.minimum(across, dr.abs(across - npr.WINDOW[0])) < npr.BAR
    return inside & (bar | (dr.minimum(up, dr.abs(up - npr.WINDOW[1])) < npr.BAR))


def _cool_warm(p: Any, cool: Any, warm: Any) -> Any:
    """math.npr.cool_warm."""
    import drjit as dr

    towards = 0.5 * (1.0 + dr.erf((p.x * npr.LIGHT[0] + p.y * npr.LIGHT[1]) / (npr.BLUR * math.sqrt(2.0))))
    distance = dr.hypot(p.x - npr.CIRCLE * npr.LIGHT[0], p.y - npr.CIRCLE * npr.LIGHT[1])
    circle = 0.0
    for x, half, weight in zip(*npr.chords(), strict=True):  # math.npr.blurred_disc
        share = weight * math.erf(half / (npr.BLUR * math.sqrt(2.0))) / (npr.BLUR * math.sqrt(2.0 * math.pi))
        circle += float(share) * dr.exp(-0.5 * dr.square((float(x) - distance) / npr.BLUR))
    return cool + towards * (warm - cool) + circle * (1.0 - warm)


def _strokes(p: Any, count: Any) -> Any:
    """math.npr.strokes."""
    import drjit as dr

    radius, out = dr.norm(p), False
    for start, sign in zip(npr.HATCH_FROM, (1.0, -1.0), strict=True):
        cover = 0.5 * dr.clip((radius - start) / (1.0 - start), 0.0, 1.0)
        along = 0.5 * math.sqrt(0.5) * count * (p.x + sign * p.y)
        out |= dr.abs(along - dr.floor(along) - 0.5) < 0.5 * cover
    return out
