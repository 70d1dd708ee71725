"""What Mitsuba renders: the targets, in order of truth, and our integrator plugins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

from evalsuite.errors import EvalsuiteError
from evalsuite.lights import decompose
from evalsuite.lights.model import DecompositionSettings
from evalsuite.scene.model import Environment


@dataclass(frozen=True)
class Target:
    """One definition of the truth. description: one line for lists and pages. plugin: Mitsuba integrator dictionary.
    within_room: the scene's real room takes the environment's place. decomposed: area lights and a remainder do."""

    id: str
    description: str
    plugin: Mapping[str, object] = field(default_factory=dict)
    within_room: bool = False
    decomposed: bool = False


def _discs(suffix: str, description: str, lights_shadowed: bool, remainder_shadowed: bool, from_centre: bool = False) -> Target:
    flags = {"lights_shadowed": lights_shadowed, "remainder_shadowed": remainder_shadowed, "from_centre": from_centre}
    return Target("discs" + suffix, description, {"type": "discs", **flags}, decomposed=True)


TARGETS: dict[str, Target] = {
    target.id: target
    for target in (
        Target("unoccluded", "environment × BRDF above the horizon, no visibility, one bounce", {"type": "unoccluded"}),
        _discs("-unshadowed", "environment as area lights and remainder, no visibility, one bounce", False, False),
        _discs("-centre", "as `discs`, but each light shaded from its centre", True, False, True),
        _discs("", "area lights of the environment with visibility, remainder without, one bounce", True, False),
        _discs("-shadowed", "area lights and remainder of the environment with visibility, one bounce", True, True),
        Target("direct", "environment × BRDF with visibility, one bounce", {"type": "direct"}),
        # No depth limit: Russian roulette ends paths without bias, a limit would lose energy in cavities.
        Target("path", "full light transport with interreflection", {"type": "path", "max_depth": -1}),
        Target("near-field", "path-traced in the real room that the scene names", {"type": "path", "max_depth": -1}, True),
        Target("lookup", "no light: the map of an `npr` material, looked up exactly at the first hit", {"type": "lookup"}),
    )
}

_registered: set[str] = set()


def register() -> None:
    """Register `unoccluded`, `discs` and `lookup` with the active Mitsuba variant; does nothing the second time."""
    import mitsuba as mi

    from .discs import define_discs
    from .lookup import define_lookup
    from .unoccluded import define_unoccluded

    variant = mi.variant()
    if variant in _registered:
        return
    mi.register_integrator("unoccluded", define_unoccluded())
    mi.register_integrator("discs", define_discs())
    mi.register_integrator("lookup", define_lookup())
    _registered.add(variant)


def integrator(target: str, environment: Environment | None = None, settings: DecompositionSettings | None = None) -> Any:
    """Mitsuba integrator of a target. environment, settings: what a decomposed target takes apart, and how (by default as
    the paper does). Raises EvalsuiteError for unknown names, and for such a target without an environment."""
    if target not in TARGETS:
        raise EvalsuiteError("target", f"'{target}'", f"one of {', '.join(TARGETS)}")
    if not TARGETS[target].decomposed:
        return _plain(target)
    if environment is None:
        fix = "add one, give --env FILE, or choose another target"
        raise EvalsuiteError(f"target {target}", "a scene without an environment", "one to take apart", fix)
    return _decomposed(target, environment, settings or DecompositionSettings())


@cache
def _plain(target: str) -> Any:
    import mitsuba as mi

    return mi.load_dict(dict(TARGETS[target].plugin))


@lru_cache(maxsize=4)  # each holds a map
def _decomposed(target: str, environment: Environment, settings: DecompositionSettings) -> Any:
    import mitsuba as mi

    from .discs import lighting

    return mi.load_dict({**TARGETS[target].plugin, **lighting(environment, decompose.of(environment, settings))})
