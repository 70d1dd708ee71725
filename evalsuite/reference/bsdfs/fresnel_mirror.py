"""A smooth dielectric's mirror reflection with a Lambert part below it (Heidrich, course notes, §3.1.1, Eq 13, Fig 8).

`combine` add: L_o = F·L_m + L_d; blend: L_o = F·L_m + (1 − F)·L_d, a clear coat. F = F(n·v) in both: light that enters the
coat at the angle of l, or is reflected inside it, is not modelled (Mitsuba's `plastic` does).
"""

from __future__ import annotations

import math
from typing import Any

from evalsuite.errors import EvalsuiteError

from .lobe import reflectance

NAME = "fresnelmirror"
COMBINE = ("add", "blend")


def fresnel_dielectric(cosine: Any, eta: Any) -> Any:
    """math.fresnel.fresnel_dielectric in Dr.Jit."""
    import drjit as dr

    g2 = eta * eta + cosine * cosine - 1.0
    total = dr.maximum(dr.safe_sqrt(g2) + cosine, 1e-15)
    difference = (eta * eta - 1.0) / total
    ratio = (cosine * total - 1.0) / (cosine * difference + 1.0)
    return dr.select((g2 <= 0.0) & (eta < 1.0), 1.0, 0.5 * dr.square(difference / total) * (1.0 + ratio * ratio))


def define_fresnel_mirror() -> type:
    """The plugin class for the active Mitsuba variant.

    Parameters: eta (1.5), diffuse_reflectance k_d (RGB or texture, 0), combine (add). Constructing it raises EvalsuiteError
    for an eta that is not positive and finite, an unknown way to combine, and reflectances outside [0, 1].
    """
    import drjit as dr
    import mitsuba as mi

    class FresnelMirror(mi.BSDF):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            eta, combine = float(props.get("eta", 1.5)), str(props.get("combine", "add"))
            if not (math.isfinite(eta) and eta > 0.0):
                raise EvalsuiteError(NAME, f"eta {eta:g}", "a finite relative index of refraction > 0")
            if combine not in COMBINE:
                raise EvalsuiteError(NAME, f"combine '{combine}'", " or ".join(COMBINE))
            self.diffuse = reflectance(props, NAME, "diffuse_reflectance", 0.0)
            self.blend = combine == "blend"
            self.eta = mi.Float(eta)
            dr.make_opaque(self.eta)
            self.m_components = [
                mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide,
                mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide,
            ]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def traverse(self, cb: Any) -> None:
            cb.put("eta", self.eta, mi.ParamFlags.Differentiable)
            cb.put("diffuse_reflectance", self.diffuse, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Any) -> None:
            dr.make_opaque(self.eta)

        def _parts(self, ctx: Any, si: Any, active: Any) -> tuple[Any, Any, Any]:
            """Weights of mirror and Lambert part, as far as the context asks for them, and the probability of the mirror."""
            fresnel = fresnel_dielectric(dr.clip(mi.Frame3f.cos_theta(si.wi), 0.0, 1.0), self.eta)
            diffuse = self.diffuse.eval(si, active) * (1.0 - fresnel if self.blend else 1.0)
            if not ctx.is_enabled(mi.BSDFFlags.DeltaReflection, 0):
                fresnel = mi.Float(0.0)
            if not ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 1):
                diffuse = mi.Spectrum(0.0)
            total = fresnel + dr.mean(diffuse)
            return fresnel, diffuse, dr.select(total > 0.0, fresnel / total, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            """The Lambert part alone: the mirror is a delta distribution."""
            cos_o = mi.Frame3f.cos_theta(wo)
            active = (mi.Frame3f.cos_theta(si.wi) > 0.0) & (cos_o > 0.0) & active
            _, diffuse, probability = self._parts(ctx, si, active)
            pdf = (1.0 - probability) * mi.warp.square_to_cosine_hemisphere_pdf(wo)
            return dr.select(active, diffuse * (cos_o * dr.inv_pi), 0.0), dr.select(active, pdf, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
            active = (mi.Frame3f.cos_theta(si.wi) > 0.0) & active
            fresnel, diffuse, probability = self._parts(ctx, si, active)
            mirror = sample1 < probability
            bs = mi.BSDFSample3f()
            bs.wo = dr.select(mirror, mi.reflect(si.wi), mi.warp.square_to_cosine_hemisphere(sample2))
            density = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
            bs.pdf = dr.select(mirror, probability, (1.0 - probability) * density)
            bs.eta = 1.0
            bs.sampled_component = dr.select(mirror, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                mirror,
                mi.UInt32(+mi.BSDFFlags.DeltaReflection),
                mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
            )
            active &= bs.pdf > 0.0
            # f·cos/pdf: the cosine and the 1/π of the Lambert part cancel against the density.
            weight = dr.select(mirror, mi.Spectrum(fresnel / probability), diffuse / (1.0 - probability))
            return bs, dr.select(active, weight, 0.0)

        def to_string(self) -> str:
            combine = COMBINE[self.blend]
            return f"{NAME}[eta={self.eta[0]:g}, combine={combine}, diffuse={self.diffuse}]"

    FresnelMirror.__name__ = FresnelMirror.__qualname__ = NAME
    return FresnelMirror
