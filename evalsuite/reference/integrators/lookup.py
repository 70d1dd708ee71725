"""Integrator plugin `lookup`: what a map that belongs to the viewer holds for the first hit, looked up exactly.

The truth for non-photorealistic maps: Mitsuba's shading normal, the sphere-map coordinates p of it, and the map itself as a
function, without texels or MIP levels. Materials other than `npr` are black; rays that miss see the environment. A scene
without any `npr` raises EvalsuiteError.
"""

from __future__ import annotations

import math
from typing import Any

from evalsuite.errors import EvalsuiteError
from evalsuite.reference.bsdfs.npr import ATTRIBUTE, FOOTPRINT, LOCAL_VIEWER

#: Offset of the neighbouring rays over which p is differentiated [pixels]: small beside a triangle, large beside float32's steps.
OFFSET = 1.0 / 16.0


def coordinates(normal: Any, to_view: Any, axes: tuple[Any, Any, Any], local: Any) -> Any:
    """math.npr.coordinates. axes: right, up and towards the viewer. local: where v₀ is each point's own."""
    import drjit as dr
    import mitsuba as mi

    right, up, v0 = axes
    own_right = dr.normalize(dr.cross(up, to_view))
    mine = mi.Point2f(dr.dot(normal, own_right), dr.dot(normal, dr.cross(to_view, own_right)))
    r = 2.0 * dr.dot(normal, to_view) * normal - to_view
    h = mi.Point2f(dr.dot(r, right), dr.dot(r, up))
    z, side = dr.dot(r, v0), dr.norm(h)
    # math.sphere_map.direction_to_disc: near −v₀ 1 + z cancels.
    scale = dr.select(z > 0.0, dr.rsqrt(2.0 * dr.maximum(1.0 + z, 0.5)), dr.safe_sqrt(0.5 * (1.0 - z)) / dr.maximum(side, 1e-20))
    return dr.select(local, mine, h * scale)


def define_lookup() -> type:
    """Plugin class for the active Mitsuba variant."""
    import drjit as dr
    import mitsuba as mi

    class Lookup(mi.SamplingIntegrator):
        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> tuple:
            if not any(dr.any(shape.bsdf().has_attribute(ATTRIBUTE)) for shape in scene.shapes()):
                raise EvalsuiteError(
                    "target lookup", "a scene without an `npr` material", "one to look up", "choose another target"
                )
            sensor = scene.sensors()[0]
            to_world = sensor.world_transform()
            left, up, ahead = (dr.normalize(to_world @ mi.Vector3f(*axis)) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
            axes = (-left, up, -ahead)

            def seen(direction: Any, origin: Any, active: Any) -> tuple[Any, Any, Any, Any]:
                """Interaction, whether it is a map seen from its painted side, and p."""
                si = scene.ray_intersect(mi.Ray3f(origin, direction), active)
                bsdf = si.bsdf()
                hit = active & si.is_valid()
                both = mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)
                hit &= bsdf.has_attribute(ATTRIBUTE, hit) & (both | (dr.dot(si.n, direction) < 0.0))
                normal = dr.select(both & (dr.dot(si.sh_frame.n, direction) > 0.0), -si.sh_frame.n, si.sh_frame.n)
                p = coordinates(normal, -direction, axes, bsdf.has_attribute(LOCAL_VIEWER, hit))
                return si, bsdf, hit, p

            si, bsdf, hit, p = seen(ray.d, ray.o, active)
            wide = hit & bsdf.has_attribute(FOOTPRINT, hit)
            # What a pixel spans, along the longer axis as MIP selection does; each axis to the side on which p changes less,
            # since the other may have left the surface.
            local = to_world.inverse() @ ray.d
            local /= local.z
            span = mi.Float(0.0)
            for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
                steps = []
                for sign in (1.0, -1.0):
                    shift = mi.Vector3f(axis) * (sign * OFFSET * _pixel(sensor))
                    _, _, there, q = seen(dr.normalize(to_world @ (local + shift)), ray.o, wide)
                    steps.append(dr.select(there, dr.norm(q - p) / OFFSET, dr.inf))
                span = dr.maximum(span, dr.minimum(*steps))
            si.uv = p
            si.duv_dx = mi.Vector2f(dr.select(dr.isfinite(span), span, 0.0), 0.0)
            radiance = dr.select(hit, bsdf.eval_attribute_3(ATTRIBUTE, si, hit), 0.0)
            environment = scene.environment()
            if environment is not None:
                missed = active & ~si.is_valid()
                radiance += dr.select(missed, environment.eval(si, missed), 0.0)
            return radiance, active & si.is_valid(), []

        def to_string(self) -> str:
            return "Lookup[]"

    return Lookup


def _pixel(sensor: Any) -> float:
    """Width of a pixel on the plane at unit depth (pixels are square)."""
    import mitsuba as mi
    import numpy as np

    fov = float(np.ravel(np.array(mi.traverse(sensor)["x_fov"]))[0])
    return 2.0 * math.tan(0.5 * math.radians(fov)) / float(np.ravel(np.array(sensor.film().size()))[0])
