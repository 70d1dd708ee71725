"""Blinn-Phong lobe in the half vector h: f = (1/π) [k_L + k_G (s+8)/8 (h·n)₊^s] (McGuire et al. 2013, Eq 13).

k_L is `diffuse_reflectance`, k_G `specular_reflectance`, s `exponent`. The BRDF is reciprocal. (s+8)/8 is the paper's
approximate normalisation: the albedo differs from k_G, at grazing angles much.
"""

from __future__ import annotations

from typing import Any

from .lobe import Lobe, clamped_power, sample_cosine_power


class BlinnPhongLobe(Lobe):
    """(s+8)/(8π) (h·n)₊^s cos θ_o; h is drawn from (s+1)/(2π) cos^s, hence l with a density of that over 4 (h·v).

    The weight (s+8)/(s+1) (h·v)(n·l) is bounded, but at small s wide: there a share 2^−s of the samples is drawn
    from the cosine instead, all of them at s = 0, where the lobe is a cosine.
    """

    @staticmethod
    def eval(wi: Any, wo: Any, exponent: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        cos_half = mi.Frame3f.cos_theta(dr.normalize(wi + wo))
        lobe = (exponent + 8.0) * (0.125 * dr.inv_pi) * clamped_power(cos_half, exponent)
        return lobe * mi.Frame3f.cos_theta(wo)

    @staticmethod
    def pdf(wi: Any, wo: Any, exponent: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        half_vector = dr.normalize(wi + wo)
        density = (exponent + 1.0) * dr.inv_two_pi * clamped_power(mi.Frame3f.cos_theta(half_vector), exponent)
        return density / (4.0 * dr.dot(half_vector, wi))  # h·v > 0 whenever v and l are both above the horizon

    @staticmethod
    def sample(wi: Any, exponent: Any, sample: Any) -> Any:
        import mitsuba as mi

        return mi.reflect(wi, sample_cosine_power(exponent, sample))

    @staticmethod
    def cosine_share(exponent: float) -> float:
        return 2.0**-exponent
