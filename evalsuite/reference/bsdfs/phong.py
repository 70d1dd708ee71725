"""Phong lobe about the reflected view direction r: f = k_d/π + k_s (N+1)/(2π) (r·l)₊^N / (n·l).

f·cos is the normalised lobe itself, so that k_s is the lobe's integral, as in a Phong-prefiltered map (Kautz et al.
Eq 5–7). What the horizon clips is lost. f·cos is symmetric in view and light; f is *not* reciprocal, because of 1/(n·l).
"""

from __future__ import annotations

from typing import Any

from .lobe import Lobe, clamped_power, sample_cosine_power


class PhongLobe(Lobe):
    """(N+1)/(2π) (r·l)₊^N, drawn exactly by `sample`: only the horizon makes its weight other than k_s."""

    @staticmethod
    def pdf(wi: Any, wo: Any, exponent: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        return (exponent + 1.0) * dr.inv_two_pi * clamped_power(dr.dot(mi.reflect(wi), wo), exponent)

    eval = pdf  # lobe × cos θ_o is the density itself

    @staticmethod
    def sample(wi: Any, exponent: Any, sample: Any) -> Any:
        import mitsuba as mi

        return mi.Frame3f(mi.reflect(wi)).to_world(sample_cosine_power(exponent, sample))
