"""Hatching near silhouettes by an environment map (Heidrich, course notes §4, last example)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, npr
from evalsuite.gpu.techniques.base import Parameter, Technique

TECHNIQUE = Technique(
    id="npr-hatching",
    title="Non-photorealistic, hatching",
    paper=npr.PAPER,
    equations="§2.1: p = xy of (v₀ + r)/|v₀ + r|; colour = texture(map, p), strokes that grow towards the rim",
    parameters=(
        Parameter("strokes", 28.0, "strokes over the width of the map", "material", common.number(1.0, 1000.0), "1 to 1000"),
        npr.VIEWER,
        npr.FILTER,
        npr.FRAME,
        npr.map_size(512),
    ),
    assumptions=npr.ASSUMPTIONS,
    stands_for=npr.stands_for("hatching"),
    target_bsdf=npr.target_bsdf("hatching", "strokes"),
    target="lookup",
    shader=Path(__file__).with_suffix(".glsl"),
    library=npr.LIBRARY,
    prepare=npr.prepare("hatching"),
    twin=npr.twin("hatching"),
    twin_bound_reason=npr.TWIN_REASON,
    twin_settings={"filter": "finest", "map_size": 256},
    defines=npr.defines,
    fill=npr.fill,
)
