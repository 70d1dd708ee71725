"""The frame that the glossy plugins share: f = k_d/π + k_s · lobe, one-sided, sampled as a mixture of cosine and lobe.

Inside Mitsuba plugins `wi` points to the viewer and `wo` to the light, both in the shading frame (n = +z).
"""

from __future__ import annotations

import math
from typing import Any, Protocol

from evalsuite.errors import EvalsuiteError


class Lobe(Protocol):
    """One glossy lobe, all in float32 Dr.Jit arrays, for wi and wo in the upper hemisphere."""

    @staticmethod
    def eval(wi: Any, wo: Any, exponent: Any) -> Any:
        """Lobe × cos θ_o [sr⁻¹], for k_s = 1."""

    @staticmethod
    def sample(wi: Any, exponent: Any, sample: Any) -> Any:
        """Direction wo distributed by `pdf`; may fall below the horizon."""

    @staticmethod
    def pdf(wi: Any, wo: Any, exponent: Any) -> Any:
        """Density of `sample` per solid angle [sr⁻¹]."""

    @staticmethod
    def cosine_share(exponent: float) -> float:
        """Share of the lobe's own samples better drawn from a cosine."""


def define_lobe_bsdf(name: str, lobe: type[Lobe]) -> type:
    """The plugin class for the active Mitsuba variant (each variant has base classes of its own).

    Parameters: specular_reflectance k_s (RGB or texture, 1), diffuse_reflectance k_d (RGB or texture, 0), exponent (50).
    Constructing it raises EvalsuiteError for an exponent that is negative or not finite, and for reflectances outside [0, 1].
    """
    import drjit as dr
    import mitsuba as mi

    class LobeBSDF(mi.BSDF):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            exponent = float(props.get("exponent", 50.0))
            if not (math.isfinite(exponent) and exponent >= 0.0):
                raise EvalsuiteError(name, f"exponent {exponent:g}", "a finite exponent ≥ 0")
            for key in ("specular_reflectance", "diffuse_reflectance"):
                # Mitsuba itself checks colours, but not single numbers.
                if isinstance(props.get(key), float | int) and not 0.0 <= props[key] <= 1.0:
                    raise EvalsuiteError(name, f"{key} {props[key]:g}", "a reflectance between 0 and 1")
            self.specular = props.get_texture("specular_reflectance", 1.0)
            self.diffuse = props.get_texture("diffuse_reflectance", 0.0)
            self.exponent = mi.Float(exponent)
            self._prepare()
            self.m_components = [
                mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide,
                mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide,
            ]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def _prepare(self) -> None:
            self.cosine_share = mi.Float(lobe.cosine_share(self.exponent[0]))
            # Opaque: a literal would be compiled into the kernel, and every new exponent would compile a new one.
            dr.make_opaque(self.exponent, self.cosine_share)

        def traverse(self, cb: Any) -> None:
            cb.put("specular_reflectance", self.specular, mi.ParamFlags.Differentiable)
            cb.put("diffuse_reflectance", self.diffuse, mi.ParamFlags.Differentiable)
            cb.put("exponent", self.exponent, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Any) -> None:
            self._prepare()

        def _lobe_probability(self, si: Any, active: Any) -> Any:
            specular = dr.mean(self.specular.eval(si, active))
            diffuse = dr.mean(self.diffuse.eval(si, active))
            total = specular + diffuse
            return dr.select(total > 0.0, specular * (1.0 - self.cosine_share) / total, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active = (cos_i > 0.0) & (cos_o > 0.0) & active
            value = self.diffuse.eval(si, active) * (cos_o * dr.inv_pi)
            value += self.specular.eval(si, active) * lobe.eval(si.wi, wo, self.exponent)
            probability = self._lobe_probability(si, active)
            pdf = probability * lobe.pdf(si.wi, wo, self.exponent)
            pdf += (1.0 - probability) * mi.warp.square_to_cosine_hemisphere_pdf(wo)
            return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
            active = (mi.Frame3f.cos_theta(si.wi) > 0.0) & active
            take_lobe = sample1 < self._lobe_probability(si, active)
            bs = mi.BSDFSample3f()
            bs.wo = dr.select(
                take_lobe,
                lobe.sample(si.wi, self.exponent, sample2),
                mi.warp.square_to_cosine_hemisphere(sample2),
            )
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            bs.eta = 1.0
            bs.sampled_component = dr.select(take_lobe, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                take_lobe,
                mi.UInt32(+mi.BSDFFlags.GlossyReflection),
                mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
            )
            active &= bs.pdf > 0.0
            return bs, dr.select(active, value / bs.pdf, 0.0)

        def to_string(self) -> str:
            return f"{name}[exponent={self.exponent[0]:g}, specular={self.specular}, diffuse={self.diffuse}]"

    LobeBSDF.__name__ = LobeBSDF.__qualname__ = name
    return LobeBSDF


def sample_cosine_power(exponent: Any, sample: Any) -> Any:
    """Direction about +z with density (N+1)/(2π) cos^N θ [sr⁻¹]."""
    import drjit as dr
    import mitsuba as mi

    cos_theta = dr.power(1.0 - sample.x, 1.0 / (exponent + 1.0))  # 1 − u lies in (0, 1]: no power of zero
    sin_phi, cos_phi = dr.sincos(2.0 * dr.pi * sample.y)
    sin_theta = dr.safe_sqrt(1.0 - cos_theta * cos_theta)
    return mi.Vector3f(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)


def clamped_power(cosine: Any, exponent: Any) -> Any:
    """(c)₊^N: zero for c ≤ 0 also when N = 0."""
    import drjit as dr

    positive = cosine > 0.0
    return dr.select(positive, dr.power(dr.select(positive, cosine, 1.0), exponent), 0.0)
