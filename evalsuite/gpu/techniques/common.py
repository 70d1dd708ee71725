"""Parameters, uniforms and preparations that several techniques share."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques.base import Float, FreeParameter, Parameter, Prepared, Settings
from evalsuite.math import cubemap, lobe_field, phong, radial_lobe, sh
from evalsuite.scene.model import Environment, Material, Scene, Texture

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

WHITE = (1.0, 1.0, 1.0)

_LOBE = ("exponent", "specular_reflectance", "diffuse_reflectance")
_METAL = ("eta", "k", "specular_reflectance")
#: Parameters of the plugins that `bsdf` may name where a technique stands for several.
OF_PLUGIN: Mapping[str, tuple[str, ...]] = {
    "diffuse": ("reflectance",),
    "phong": _LOBE,
    "blinnphong": _LOBE,
    "roughconductor": ("alpha", "distribution", *_METAL),
    "conductor": _METAL,
}
LAMBERT_AND_LOBES = ("diffuse", "phong", "blinnphong")


def number(low: float = -np.inf, high: float = np.inf) -> Callable[[object], float]:
    """Parser of a finite number within bounds."""

    def parse(value: object) -> float:
        x = float(value)
        if not isfinite(x) or not low <= x <= high:
            raise ValueError(value)
        return x

    return parse


def integer(low: int, high: int) -> Callable[[object], int]:
    """Parser of a whole number within bounds."""

    def parse(value: object) -> int:
        x = float(value)
        if not isfinite(x) or x != int(x) or not low <= x <= high:
            raise ValueError(value)
        return int(x)

    return parse


def choice(*words: str) -> Callable[[object], str]:
    """Parser of one of some words."""

    def parse(value: object) -> str:
        if str(value) not in words:
            raise ValueError(value)
        return str(value)

    return parse


def rgb(value: object) -> tuple[float, float, float]:
    """A colour: one number for grey, or three (also as text "r g b" or "r,g,b"). Raises ValueError."""
    if isinstance(value, str):
        value = [float(x) for x in value.replace(",", " ").split()]
    values = np.broadcast_to(np.asarray(value, dtype=np.float64).ravel() if np.ndim(value) else float(value), (3,))
    if not np.isfinite(values).all() or (values < 0).any():
        raise ValueError(value)
    return tuple(float(x) for x in values)


def material_parameter(name: str, default: object, meaning: str) -> Parameter:
    """A reflectance or an exponent."""
    if name == "exponent":
        return Parameter(name, default, meaning, "material", number(0.0, 1e7), "a number ≥ 0")
    return Parameter(name, default, meaning, "material", rgb, "a colour: one number or three, not negative")


FACE_SIZE = Parameter(
    "face_size", None, "cubemap face width [texels]; default: the smallest power of two whose four faces span the map's "
    "width, within 16 … 1024", "technique", lambda value: cubemap.check_face_size(integer(1, 8192)(value)),
    "a power of two from 1 to 8192",
)  # fmt: skip

LOD_OFFSET = Parameter(
    "lod_offset", 0.0, "c, added to the level [levels]; the published formula has 0", "technique", number(-32, 32),
    "a number of MIP levels",
)  # fmt: skip
FREE_LOD_OFFSET = FreeParameter("lod_offset", -6.0, 6.0, 1.0, "levels", "c = 0")

BELOW_TOP = Parameter(
    "below_top", 0.0, "levels below the 1 × 1 one that the diffuse look-up takes; the published formula has 0", "technique",
    number(0, 32), "a number of MIP levels ≥ 0",
)  # fmt: skip
FREE_BELOW_TOP = FreeParameter("below_top", 0.0, 6.0, 1.0, "levels", "the 1 × 1 level")

#: A LOD bias: the published choice is what solid angles say over the picture.
FREE_BIAS = FreeParameter("bias", -6.0, 6.0, 1.0, "levels", "mean λ + b has the lobe's solid angle, or as given")


def fill_face_size(scene: Scene, settings: Settings) -> dict[str, object]:
    """face_size from the width of the scene's map where it is not given."""
    if settings["face_size"] is not None:
        return {}
    width = 1 if scene.environment is None else scene.environment.radiance.shape[1]
    return {"face_size": cubemap.default_face_size(width)}


def colour(material: Material, name: str, default: object = WHITE) -> tuple[float, float, float]:
    """A colour of a material as a uniform; white where a bitmap gives it (the shader looks that up)."""
    value = material.parameters.get(name)
    return WHITE if isinstance(value, Texture) else rgb(default if value is None else value)


def diffuse_uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """`diffuse` as it is."""
    return {"diffuse_reflectance": colour(material, "reflectance", 0.5)}


def lobe_uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """`phong` or `blinnphong` as it is. η = 0, k = 1 makes the conductor's Fresnel factor exactly 1."""
    return {
        "specular_reflectance": colour(material, "specular_reflectance"),
        "diffuse_reflectance": colour(material, "diffuse_reflectance", 0.0),
        "exponent": float(material.parameters.get("exponent", 50.0)),
        "eta": (0.0, 0.0, 0.0),
        "k": WHITE,
    }


def require_exponent(technique: str, material: Material, exponent: float) -> None:
    """Raise EvalsuiteError for a lobe of another exponent than the one that a technique's maps were made for."""
    own = float(material.parameters.get("exponent", 50.0))
    if not np.isclose(own, exponent, rtol=1e-6):  # Mitsuba: float32
        raise EvalsuiteError(
            material.location or f"{technique}, material {material.id}",
            f"exponent {own:g}",
            f"exponent {exponent:g}, as the material that the maps of {technique} were made for",
            "give all lobes of the scene one exponent, or choose another technique",
        )


def conductor_uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """`conductor` as it is; material "none" is η = 0, k = 1."""
    return {
        "specular_reflectance": colour(material, "specular_reflectance"),
        "eta": colour(material, "eta", 0.0),
        "k": colour(material, "k", 1.0),
    }


def rough_conductor_uniforms(material: Material, settings: Settings) -> dict[str, object]:
    """`roughconductor` with α as the exponent of the same peak."""
    alpha = float(material.parameters.get("alpha", 0.1))
    return {**conductor_uniforms(material, settings), "exponent": float(phong.alpha_to_exponent(alpha))}


def lobe_target(plugin: str) -> Callable[[Settings], dict[str, object]]:
    """Target BSDF of a technique that draws one lobe of `phong` or `blinnphong` and no diffuse part."""
    return lambda settings: {
        "type": plugin,
        "exponent": settings["exponent"],
        "specular_reflectance": settings["specular_reflectance"],
        "diffuse_reflectance": (0.0, 0.0, 0.0),
    }


def bsdf_parameters(plugin: str, plugins: Sequence[str] = LAMBERT_AND_LOBES) -> tuple[Parameter, ...]:
    """Parameters of a technique that stands for several plugins, as far as diffuse, phong and blinnphong have them. plugin:
    its target's, by default."""
    of_lobe = "of a phong or blinnphong target"
    return (
        Parameter("bsdf", plugin, "plugin of the subject's target", "material", choice(*plugins),
                  f"one of {', '.join(plugins)}"),
        material_parameter("exponent", 50.0, f"exponent {of_lobe}"),
        material_parameter("specular_reflectance", WHITE, f"k_s {of_lobe}"),
        material_parameter("diffuse_reflectance", (0.0, 0.0, 0.0), f"k_d {of_lobe}"),
        material_parameter("reflectance", (0.5, 0.5, 0.5), "reflectance of a diffuse target"),
    )  # fmt: skip


def named_target(settings: Settings) -> dict[str, object]:
    """The plugin that `bsdf` names, with the parameters it has."""
    plugin = str(settings["bsdf"])
    return {"type": plugin, **{name: settings[name] for name in OF_PLUGIN[plugin]}}


def no_diffuse_part(material: Material) -> str | None:
    """Against a lobe material that also has a diffuse part."""
    if max(colour(material, "diffuse_reflectance", 0.0)) > 0:
        return f"{material.plugin} with a diffuse part (diffuse_reflectance > 0)"
    return None


def prepare_cube(env: GpuEnvironment, settings: Settings, scene: Scene) -> Prepared:
    """The environment as a cubemap with the hardware's MIPs."""
    cube = env.cube(settings["face_size"])
    uniforms = {"env_face_size": float(cube.face_size), "env_max_level": float(cube.max_level)}
    uniforms |= {name: settings[name] for name in ("lod_offset", "below_top") if name in settings}
    note = f"cubemap of {cube.face_size}² texels a face; resampling changed the map's energy by {cube.energy_residual:+.1e}"
    return Prepared(uniforms, {"env_cube": cube.texture}, cube.prepare_ms, (note,))


def sh9(env: GpuEnvironment, face_size: int) -> tuple[dict[str, object], float]:
    """Uniform `sh` of library/sh.glsl, L_i of the cubemap with faces face_size², and the milliseconds that projecting took."""

    def project() -> tuple[dict[str, object], float]:
        level0 = env.cube(face_size).level0
        start = time.perf_counter()
        coefficients = sh.project_cube(level0)
        return {"sh": coefficients}, 1e3 * (time.perf_counter() - start)

    return env.kept(("sh9", face_size), project)


@lru_cache(maxsize=8)
def twin_sh9(environment: Environment, face_size: int) -> np.ndarray:
    """(9, 3) L_i of an environment in float64, for twins."""
    return sh.project_cube(twin_cube(environment, face_size).levels[0])


@lru_cache(maxsize=8)
def twin_cube(environment: Environment, face_size: int) -> cubemap.SeamlessCube:
    """The cubemap of an environment, resampled and filtered in float64, for twins."""
    level0 = cubemap.resample_latlong(environment.radiance, environment.to_world, face_size)
    return cubemap.SeamlessCube(cubemap.box_mips(level0))


@lru_cache(maxsize=12)
def _lobe_field(environment: Environment, exponent: float) -> lobe_field.LobeField:
    return lobe_field.phong(environment.radiance, exponent)


def exact_lobe(environment: Environment, exponent: float, directions: Float) -> Float:
    """∫ (N + 1)/2π (d·l)₊^N L(l) dl about world directions d (P, 3), in float64 and without texels, (P, 3). N = 1: E/π."""
    return _lobe_field(environment, float(exponent))(directions @ np.asarray(environment.to_world, np.float64))


@lru_cache(maxsize=8)
def radial_fields(environment: Environment, *lobes: radial_lobe.RadialLobe) -> tuple[lobe_field.LobeField, ...]:
    """The means of an environment under lobes about any direction of the map's frame, without texels."""
    return lobe_field.radial(environment.radiance, lobes)


@lru_cache(maxsize=12)
def _cubic_lobe_field(environment: Environment, exponent: float) -> lobe_field.LobeField:
    return _lobe_field(environment, exponent).cubic()


def nearly_exact_lobe(environment: Environment, exponent: float, directions: Float) -> Float:
    """The same within 2·10⁻³ of the lobe's peak, by a cubic spline, three times as fast: for what is small."""
    return _cubic_lobe_field(environment, float(exponent))(directions @ np.asarray(environment.to_world, np.float64))
