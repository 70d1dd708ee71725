"""Where the error is, for a cell's page: the sentence on the worst region, and the regions' names."""

from __future__ import annotations

from collections.abc import Mapping

from evalsuite.compare.regions import ORDER
from evalsuite.report.scales import REGIONS

#: Regions smaller than this part of the object are listed, but not named as the worst.
LEAST_PART = 0.005
SAYS = {
    "highlight": "the brightest 1 % of the reference",
    "silhouette": "within three pixels of an edge of the object, or between two surfaces",
    "penumbra": "the area lights' light arrives in part",
    "umbra": "less than 1 % of the area lights' light arrives",
    "face-corner": "within 10° of a corner of the cube map",
    "face-edge": "within 5° of an edge of the cube map, corners apart",
    "grazing": "n · v below 0.3",
    "face-centre": "within 15° of the centre of a cube face, to compare with",
    "unshadowed": "more than 99 % of the area lights' light arrives",
}
#: (name, what it says, number, CSS colour) of the table's rows.
ROWS = tuple((name, SAYS[name], number, f"rgb{REGIONS[number]}") for number, name in enumerate(ORDER, 1))


def worst(cell: Mapping) -> dict[str, object] | None:
    """The region where the error is densest: {"name", "part": of the object's pixels, "share": of its squared error, "times":
    one over the other}; None where none stands out of its interval."""
    pixels, found = cell.get("mask_pixels") or 0, None
    for name, region in (cell.get("regions") or {}).items():
        part, share = region["pixels"] / pixels if pixels else 0.0, region["share"]
        if part >= LEAST_PART and share["ci95"][0] > part and (found is None or share["value"] / part > found["times"]):
            found = {"name": name, "part": part, "share": share, "times": share["value"] / part, "region": region}
    return found


def numbered(cell: Mapping) -> list[tuple[int, str]]:
    """(number, name) of the regions that a cell has, in the order of their numbers."""
    return [(number, name) for name, _, number, _ in ROWS if name in (cell.get("regions") or {})]
