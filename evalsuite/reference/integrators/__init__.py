"""What Mitsuba renders: the targets, in order of truth, and our integrator plugins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from evalsuite.errors import EvalsuiteError


@dataclass(frozen=True)
class Target:
    """One definition of the truth. description: one line for lists and pages. plugin: Mitsuba integrator dictionary.
    within_room: the scene's real room takes the environment's place."""

    id: str
    description: str
    plugin: Mapping[str, object] = field(default_factory=dict)
    within_room: bool = False


TARGETS: dict[str, Target] = {
    target.id: target
    for target in (
        Target("unoccluded", "environment × BRDF above the horizon, no visibility, one bounce", {"type": "unoccluded"}),
        Target("direct", "environment × BRDF with visibility, one bounce", {"type": "direct"}),
        # No depth limit: Russian roulette ends paths without bias, a limit would lose energy in cavities.
        Target("path", "full light transport with interreflection", {"type": "path", "max_depth": -1}),
        Target("near-field", "path-traced in the real room that the scene names", {"type": "path", "max_depth": -1}, True),
        Target("lookup", "no light: the map of an `npr` material, looked up exactly at the first hit", {"type": "lookup"}),
    )
}

_registered: set[str] = set()


def register() -> None:
    """Register `unoccluded` and `lookup` with the active Mitsuba variant; does nothing the second time."""
    import mitsuba as mi

    from .lookup import define_lookup
    from .unoccluded import define_unoccluded

    variant = mi.variant()
    if variant in _registered:
        return
    mi.register_integrator("unoccluded", define_unoccluded())
    mi.register_integrator("lookup", define_lookup())
    _registered.add(variant)


@cache
def integrator(target: str) -> Any:
    """Mitsuba integrator of a target. Raises EvalsuiteError for unknown names."""
    import mitsuba as mi

    if target not in TARGETS:
        raise EvalsuiteError("target", f"'{target}'", f"one of {', '.join(TARGETS)}")
    return mi.load_dict(dict(TARGETS[target].plugin))
