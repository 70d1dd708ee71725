"""Which truths a cell's error ledger goes through, from the fullest down to the picture."""

from __future__ import annotations

from evalsuite.gpu.techniques.base import (
    ARITHMETIC,
    DISTANT,
    FRESNEL,
    INTERREFLECTION,
    KERNEL,
    LOOKUP,
    REPRESENTATION,
    ROUGHNESS,
    VISIBILITY,
    Settings,
    Technique,
)
from evalsuite.plan import NEAR_FIELD

#: What Mitsuba renders, and what each leaves out that the one before it has.
TRUTHS = ((NEAR_FIELD, DISTANT), ("path", INTERREFLECTION), ("direct", VISIBILITY), ("unoccluded", ""))
#: A technique's own error, where nothing says what it is made of.
WHOLE = "technique"
#: What a picture is once an assumption is given up.
LIFTED = {
    ARITHMETIC: "float64",
    REPRESENTATION: "no texels",
    KERNEL: "exact lobe",
    FRESNEL: "Fresnel inside",
    ROUGHNESS: "own roughness",
}


def truths(technique: Technique, target: str, settings: Settings, lifted: bool) -> tuple[tuple[str, str], ...]:
    """(target, what separates it from the next one's picture), the first being the cell's own target, the last followed by the
    technique's pictures, lifted (whether there are any) or as drawn. None for what draws no light."""
    if target == LOOKUP:
        return ()
    own = tuple(technique.chain(settings))
    names = [name for name, _ in own]
    if target in names:
        return own[names.index(target) :]
    order = [name for name, _ in TRUTHS]
    if target not in order or technique.within_room:
        return ((target, WHOLE),)
    below = TRUTHS[order.index(target) :]
    if own and target != "unoccluded":
        return tuple(step for step in below if order.index(step[0]) < order.index(names[0])) + own
    return (*below[:-1], ("unoccluded", technique.left if lifted or technique.random else WHOLE))
