"""Kautz, Daubert and Seidel's combined reflection (Eq 8): L_o = (1 − F(r·n)) L_diffuse + F(r·n) L_phong.

F is Schlick's approximation from f_λ, the colour that white light has after reflection at normal incidence (§5.2). The paper
takes it at r·n = v·n, outside the integral: f = (1 − F(n·v)) k_d/π + F(n·v) (N+1)/(2π) (r·l)₊^N / (n·l).
"""

from __future__ import annotations

from typing import Any

from .phong import PhongLobe


class KautzLobe(PhongLobe):
    """The Phong lobe, its weight f_λ turned into F, and (1 − F) on the Lambert part: math.fresnel.fresnel_schlick."""

    parameter = "fresnel_normal"
    default = 0.1

    @staticmethod
    def weights(cos_view: Any, glossy: Any, diffuse: Any) -> tuple[Any, Any]:
        import drjit as dr

        grazing = 1.0 - dr.clip(cos_view, 0.0, 1.0)
        fresnel = glossy + (1.0 - glossy) * (grazing * dr.square(dr.square(grazing)))
        return fresnel, (1.0 - fresnel) * diffuse
