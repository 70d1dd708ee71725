"""What the techniques for Mitsuba's `roughconductor` share: its parameters, target, uniforms and the twins' reading of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import common
from evalsuite.gpu.techniques.base import Float, Parameter, Settings
from evalsuite.math import microfacet
from evalsuite.scene.model import Material

ALPHA = Parameter("alpha", 0.2, "width α of the distribution of facet normals", "material", common.number(1e-3, 1.0),
                  "a number from 0.001 to 1")  # fmt: skip
DISTRIBUTION = Parameter("distribution", "ggx", "distribution of facet normals", "material",
                         common.choice(*microfacet.DISTRIBUTIONS), "ggx or beckmann")  # fmt: skip
_INDEX = "of the complex index of refraction η + ik; η = 0, k = 1 reflects everything"
ETA = Parameter("eta", (0.0, 0.0, 0.0), f"η {_INDEX}", "material", common.rgb, "one number or three, not negative")
K = Parameter("k", common.WHITE, f"k {_INDEX}", "material", common.rgb, "one number or three, not negative")
SPECULAR = common.material_parameter("specular_reflectance", common.WHITE, "factor on the reflected radiance")


def distribution(material: Mapping[str, object]) -> str:
    """Mitsuba's default is Beckmann."""
    return str(material.get("distribution") or "beckmann")


def alpha(material: Mapping[str, object]) -> float:
    """Mitsuba's default is 0.1."""
    value = material.get("alpha")
    return 0.1 if value is None else float(value)


def uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """`roughconductor` as it is."""
    return {**common.conductor_uniforms(material, settings), "alpha": alpha(material.parameters)}


def target_bsdf(settings: Settings) -> dict[str, object]:
    """`roughconductor` with the settings' parameters; a technique without a choice of distribution takes GGX."""
    names = ("alpha", "eta", "k", "specular_reflectance")
    return {"type": "roughconductor", "distribution": settings.get("distribution", "ggx")} | {n: settings[n] for n in names}


def reflectance(material: Settings) -> tuple[Float, Float, Float]:
    """specular_reflectance, η and k of a twin's material, (3,) each."""
    values = (("specular_reflectance", 1.0), ("eta", 0.0), ("k", 1.0))
    return tuple(np.asarray(common.rgb(default if material.get(name) is None else material[name])) for name, default in values)


def require_same(technique: str, material: Material, settings: Settings, names: tuple[str, ...]) -> None:
    """Raise EvalsuiteError for a material other than the one whose maps were made: they hold one material's lobe."""
    read = {"alpha": alpha, "distribution": distribution}
    for name in names:
        own = read[name](material.parameters) if name in read else common.colour(material, name, settings[name])
        same = own == settings[name] if isinstance(own, str) else np.allclose(own, settings[name], rtol=1e-6)  # Mitsuba: float32
        if not same:
            raise EvalsuiteError(
                material.location or f"{technique}, material {material.id}",
                f"{name} {own}",
                f"{name} {settings[name]}, as the material that the maps of {technique} were made for",
                "give all roughconductors of the scene the same values, or choose another technique",
            )
