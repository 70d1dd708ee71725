"""Integrator plugin `squares`: another integrator's samples, with their squares as three AOVs beside them."""

from __future__ import annotations

from typing import Any


def define_squares() -> type:
    """Plugin class for the active Mitsuba variant.

    Parameter: one nested integrator. Each sample returns L and the AOVs L² per RGB channel: their pixel means give an
    unbiased sample variance of every pixel (Mitsuba's own `moment` integrator squares XYZ instead).
    """
    import mitsuba as mi

    class Squares(mi.SamplingIntegrator):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.inner = next(props[key] for key in props.keys() if isinstance(props[key], mi.Integrator))

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> tuple:
            radiance, valid, _ = self.inner.sample(scene, sampler, ray, medium, active)
            return radiance, valid, [radiance.x * radiance.x, radiance.y * radiance.y, radiance.z * radiance.z]

        def aov_names(self) -> list[str]:
            return ["square.R", "square.G", "square.B"]

        def to_string(self) -> str:
            return f"Squares[{self.inner}]"

    return Squares
