"""The frame that the glossy plugins share: f = k_d/π + k_s · lobe, one-sided, sampled as a mixture of cosine and lobe.

Inside Mitsuba plugins `wi` points to the viewer and `wo` to the light, both in the shading frame (n = +z).
"""

from __future__ import annotations

import math
from typing import Any, Protocol

from evalsuite.errors import EvalsuiteError


class Lobe(Protocol):
    """One glossy lobe, all in float32 Dr.Jit arrays, for wi and wo in the upper hemisphere. parameter, default: name and
    default of the plugin's glossy coefficient (RGB or texture)."""

    parameter = "specular_reflectance"
    default = 1.0

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
        return 0.0

    @staticmethod
    def weights(cos_view: Any, glossy: Any, diffuse: Any) -> tuple[Any, Any]:
        """Weights of lobe and Lambert part, from the glossy coefficient and k_d, at cos_view = n·v."""
        return glossy, diffuse


def define_lobe_bsdf(name: str, lobe: type[Lobe]) -> type:
    """The plugin class for the active Mitsuba variant (each variant has base classes of its own).

    Parameters: the lobe's glossy coefficient, k_s but for `kautz`, diffuse_reflectance k_d (RGB or texture, 0), exponent (50).
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
            self.glossy = reflectance(props, name, lobe.parameter, lobe.default)
            self.diffuse = reflectance(props, name, "diffuse_reflectance", 0.0)
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
            cb.put(lobe.parameter, self.glossy, mi.ParamFlags.Differentiable)
            cb.put("diffuse_reflectance", self.diffuse, mi.ParamFlags.Differentiable)
            cb.put("exponent", self.exponent, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Any) -> None:
            self._prepare()

        def _weights(self, si: Any, active: Any) -> tuple[Any, Any, Any]:
            """Weights of lobe and Lambert part, and the probability of sampling the lobe."""
            cos_view = mi.Frame3f.cos_theta(si.wi)
            glossy, diffuse = lobe.weights(cos_view, self.glossy.eval(si, active), self.diffuse.eval(si, active))
            total = dr.mean(glossy) + dr.mean(diffuse)
            return glossy, diffuse, dr.select(total > 0.0, dr.mean(glossy) * (1.0 - self.cosine_share) / total, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active = (cos_i > 0.0) & (cos_o > 0.0) & active
            glossy, diffuse, probability = self._weights(si, active)
            value = diffuse * (cos_o * dr.inv_pi) + glossy * lobe.eval(si.wi, wo, self.exponent)
            pdf = probability * lobe.pdf(si.wi, wo, self.exponent)
            pdf += (1.0 - probability) * mi.warp.square_to_cosine_hemisphere_pdf(wo)
            return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
            active = (mi.Frame3f.cos_theta(si.wi) > 0.0) & active
            take_lobe = sample1 < self._weights(si, active)[2]
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
            return f"{name}[exponent={self.exponent[0]:g}, {lobe.parameter}={self.glossy}, diffuse={self.diffuse}]"

    LobeBSDF.__name__ = LobeBSDF.__qualname__ = name
    return LobeBSDF


def reflectance(props: Any, plugin: str, key: str, default: float) -> Any:
    """A plugin's reflectance as a texture. Mitsuba itself checks colours; single numbers outside [0, 1] raise EvalsuiteError."""
    if isinstance(props.get(key), float | int) and not 0.0 <= props[key] <= 1.0:
        raise EvalsuiteError(plugin, f"{key} {props[key]:g}", "a reflectance between 0 and 1")
    return props.get_texture(key, default)


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
