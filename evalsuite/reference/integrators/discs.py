"""Integrator plugin `discs`: an environment as flat discs at infinity and the map that is left, each with or without
visibility, one bounce.

What a renderer can at best show that has taken an environment apart: no interreflection, no area lights of the scene's own.
The camera still sees the whole environment, which is the scene's; discs and remainder (`lights.model.Decomposition`) are the
plugin's own data.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evalsuite.lights.model import Decomposition
from evalsuite.scene.load import environment_plugin
from evalsuite.scene.model import Environment


def lighting(environment: Environment, found: Decomposition) -> dict[str, Any]:
    """The plugin's `lights` and `remainder`. lights: eight numbers each: direction (world), 1 − cos r, tan r, irradiance."""
    import mitsuba as mi

    rows = [
        (*(environment.to_world @ light.direction), 2.0 * np.sin(0.5 * r) ** 2, np.tan(r), *light.irradiance)
        for light in found.lights
        for r in (light.angular_radius,)
    ]
    remainder = Environment(found.remainder, environment.to_world, "remainder")
    return {"lights": mi.Float(np.ravel(rows)), "remainder": environment_plugin(remainder)}


def define_discs() -> type:
    """Plugin class for the active Mitsuba variant. The remainder: one sample of the map and one of the BSDF, combined by the
    power heuristic (Veach 1997). Each disc: one sample over its solid angle, combined with the same BSDF sample; or, with
    `from_centre`, its whole irradiance from its centre, with visibility from one sample over its tangent disc."""
    import drjit as dr
    import mitsuba as mi

    def power_heuristic(a: Any, b: Any) -> Any:
        weight = (a * a) / (a * a + b * b)
        return dr.select(dr.isfinite(weight), weight, 0.0)

    class Discs(mi.SamplingIntegrator):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.lights = props["lights"]
            self.count = len(self.lights) // 8
            self.remainder = props["remainder"]
            self.lights_shadowed = props.get("lights_shadowed", True)
            self.remainder_shadowed = props.get("remainder_shadowed", True)
            self.from_centre = props.get("from_centre", False)

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> tuple:
            si = scene.ray_intersect(ray, active)
            hit = si.is_valid() & active
            missed = active & ~hit
            radiance = dr.select(missed, scene.environment().eval(si, missed), 0.0)
            bsdf, context = si.bsdf(ray), mi.BSDFContext()
            smooth = hit & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)

            def visible(direction: Any, wanted: Any) -> Any:
                return wanted & ~scene.ray_test(si.spawn_ray(direction), wanted)

            light, weight = self.remainder.sample_direction(si, sampler.next_2d(smooth), smooth)
            value, pdf = bsdf.eval_pdf(context, si, si.to_local(light.d), smooth & (light.pdf != 0.0))
            value *= weight * power_heuristic(light.pdf, pdf)
            lit = smooth & (light.pdf != 0.0) & dr.any(value != 0.0)
            if self.remainder_shadowed:
                lit = visible(light.d, lit)
            radiance += dr.select(lit, value, 0.0)

            # The BSDF's own sample meets the remainder, and any number of discs.
            own, own_weight = bsdf.sample(context, si, sampler.next_1d(hit), sampler.next_2d(hit), hit)
            taken = hit & dr.any(own_weight != 0.0)
            towards = dr.zeros(mi.DirectionSample3f)
            towards.d = si.to_world(own.wo)
            delta = mi.has_flag(own.sampled_type, mi.BSDFFlags.Delta)
            open_sky = taken
            if self.remainder_shadowed or (self.lights_shadowed and not self.from_centre):
                open_sky = visible(towards.d, taken)
            away = dr.zeros(mi.SurfaceInteraction3f)
            away.wi = -towards.d
            lit = open_sky if self.remainder_shadowed else taken
            rest_pdf = self.remainder.pdf_direction(si, towards, lit & ~delta)
            mis = dr.select(delta, 1.0, power_heuristic(own.pdf, rest_pdf))
            radiance += dr.select(lit, own_weight * self.remainder.eval(away, lit) * mis, 0.0)
            if self.count == 0:
                return radiance, hit, []
            meets = (open_sky if self.lights_shadowed else taken) & (not self.from_centre)

            def add(i: Any, total: Any, sampler: Any) -> tuple:
                row = [dr.gather(mi.Float, self.lights, 8 * i + column) for column in range(8)]
                frame, versine, irradiance = mi.Frame3f(mi.Vector3f(*row[:3])), row[3], mi.Color3f(*row[5:])
                p = mi.warp.square_to_uniform_disk_concentric(sampler.next_2d(smooth))
                if self.from_centre:
                    direction, to_light = dr.normalize(frame.to_world(mi.Vector3f(row[4] * p.x, row[4] * p.y, 1.0))), frame.n
                else:
                    # Uniform in solid angle: 1 − cos grows as the square of the radius.
                    height = versine * dr.squared_norm(p)
                    aside = dr.safe_sqrt(versine * (2.0 - height))
                    direction = to_light = frame.to_world(mi.Vector3f(aside * p.x, aside * p.y, 1.0 - height))
                value, own_pdf = bsdf.eval_pdf(context, si, si.to_local(to_light), smooth)
                value *= irradiance
                disc_pdf = dr.rcp(dr.two_pi * versine)
                if not self.from_centre:
                    value *= power_heuristic(disc_pdf, own_pdf)
                lit = smooth & dr.any(value != 0.0)
                total += dr.select(visible(direction, lit) if self.lights_shadowed else lit, value, 0.0)
                if not self.from_centre:
                    # |d − D|² = 2 (1 − cos): exact for small discs, where d·D is not.
                    inside = meets & (dr.squared_norm(towards.d - frame.n) <= 2.0 * versine)
                    mis = dr.select(delta, 1.0, power_heuristic(own.pdf, disc_pdf))
                    total += dr.select(inside, own_weight * irradiance * disc_pdf * mis, 0.0)
                return i + 1, total, sampler

            start = (mi.UInt32(0), mi.Color3f(0.0), sampler)
            last = dr.opaque(mi.UInt32, self.count)
            radiance += dr.while_loop(start, lambda i, *_: i < last, add)[1]
            return radiance, hit, []

        def to_string(self) -> str:
            return f"Discs[{self.count}]"

    return Discs
