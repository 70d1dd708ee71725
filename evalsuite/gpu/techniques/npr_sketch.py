"""The sketch of a window frame as an environment map (Heidrich, course notes §4, first example)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import npr
from evalsuite.gpu.techniques.base import Technique

TECHNIQUE = Technique(
    id="npr-sketch",
    title="Non-photorealistic, sketched windows",
    paper=npr.PAPER,
    equations="§2.1: p = xy of (v₀ + r)/|v₀ + r|; colour = texture(map, p), black bars of a room's windows on white",
    parameters=(npr.VIEWER, npr.FILTER, npr.FRAME, npr.map_size(512)),
    assumptions=npr.ASSUMPTIONS,
    stands_for=npr.stands_for("sketch"),
    target_bsdf=npr.target_bsdf("sketch"),
    target="lookup",
    shader=Path(__file__).with_suffix(".glsl"),
    library=npr.LIBRARY,
    prepare=npr.prepare("sketch"),
    twin=npr.twin("sketch"),
    twin_bound_reason=npr.TWIN_REASON,
    twin_settings={"filter": "finest", "map_size": 256},
    defines=npr.defines,
    fill=npr.fill,
)
