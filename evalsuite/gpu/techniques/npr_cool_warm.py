"""Cool-to-warm shading by a hand-made environment map (Gooch et al. 1998 through Heidrich, course notes §4)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, npr
from evalsuite.gpu.techniques.base import Technique
from evalsuite.math.npr import COOL, WARM

TECHNIQUE = Technique(
    id="npr-cool-warm",
    title="Non-photorealistic, cool to warm",
    paper=npr.PAPER,
    equations="§2.1: p = xy of (v₀ + r)/|v₀ + r|; colour = texture(map, p), cool and warm triangle and white circle, blurred",
    parameters=(
        common.material_parameter("cool", COOL, "colour of what is turned away from the light, linear"),
        common.material_parameter("warm", WARM, "colour of what is turned towards it, linear"),
        npr.VIEWER,
        npr.FILTER,
        npr.FRAME,
        npr.map_size(128),
    ),
    assumptions=npr.ASSUMPTIONS,
    stands_for=npr.stands_for("cool-warm"),
    target_bsdf=npr.target_bsdf("cool-warm", "cool", "warm"),
    target="lookup",
    shader=Path(__file__).with_suffix(".glsl"),
    library=npr.LIBRARY,
    prepare=npr.prepare("cool-warm"),
    twin=npr.twin("cool-warm"),
    twin_settings={"filter": "finest"},
    defines=npr.defines,
    fill=npr.fill,
)
