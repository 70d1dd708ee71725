"""Integrator plugin `unoccluded`: L_o = ∫ f(v, l) L_env(l) (n·l) dl over the BSDF's own domain, without visibility.

This is what a prefiltered environment map can at best show: no shadows, no interreflection, and no area lights.
"""

from __future__ import annotations

from typing import Any


def define_unoccluded() -> type:
    """Plugin class for the active Mitsuba variant: one environment sample and one BSDF sample, combined by the power
    heuristic (Veach 1997); perfect mirrors take the BSDF sample alone. Rays that miss see the environment itself."""
    import drjit as dr
    import mitsuba as mi

    def power_heuristic(a: Any, b: Any) -> Any:
        weight = (a * a) / (a * a + b * b)
        return dr.select(dr.isfinite(weight), weight, 0.0)

    class Unoccluded(mi.SamplingIntegrator):
        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> tuple:
            environment = scene.environment()
            si = scene.ray_intersect(ray, active)
            hit = si.is_valid() & active
            if environment is None:
                return mi.Spectrum(0.0), hit, []
            radiance = dr.select(active & ~hit, environment.eval(si, active & ~hit), 0.0)
            bsdf = si.bsdf(ray)
            context = mi.BSDFContext()

            smooth = hit & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            light, light_weight = environment.sample_direction(si, sampler.next_2d(smooth), smooth)
            value, bsdf_pdf = bsdf.eval_pdf(context, si, si.to_local(light.d), smooth & (light.pdf != 0.0))
            mis = dr.select(light.delta, 1.0, power_heuristic(light.pdf, bsdf_pdf))
            radiance += dr.select(smooth & (light.pdf != 0.0), value * light_weight * mis, 0.0)

            sample, bsdf_weight = bsdf.sample(context, si, sampler.next_1d(hit), sampler.next_2d(hit), hit)
            taken = hit & dr.any(bsdf_weight != 0.0)
            away = dr.zeros(mi.SurfaceInteraction3f)
            away.wi = -si.to_world(sample.wo)
            towards = dr.zeros(mi.DirectionSample3f)
            towards.d = -away.wi
            delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
            light_pdf = environment.pdf_direction(si, towards, taken & ~delta)
            mis = dr.select(delta, 1.0, power_heuristic(sample.pdf, light_pdf))
            radiance += dr.select(taken, bsdf_weight * environment.eval(away, taken) * mis, 0.0)
            return radiance, hit, []

        def to_string(self) -> str:
            return "Unoccluded[]"

    return Unoccluded
