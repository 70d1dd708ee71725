"""Silhouettes by a black ring in an environment map, equally wide on every MIP level (Heidrich, course notes §4)."""

from __future__ import annotations

from pathlib import Path

from evalsuite.gpu.techniques import common, npr
from evalsuite.gpu.techniques.base import Parameter, Settings, Technique
from evalsuite.scene.model import Scene


def fill(scene: Scene, settings: Settings) -> dict[str, object]:
    """map_size as wide as the picture: an object larger than the map would magnify level 0 and its ring."""
    size = settings["map_size"] or min(4096, 1 << (max(scene.camera.size) - 1).bit_length())
    return {**npr.fill(scene, settings), "map_size": size}


TECHNIQUE = Technique(
    id="npr-silhouette",
    title="Non-photorealistic, silhouettes of equal width",
    paper=npr.PAPER,
    equations="§2.1: p = xy of (v₀ + r)/|v₀ + r|; colour = texture(map, p), each MIP level with a rim of `width` black texels",
    parameters=(
        Parameter("width", 2.0, "width of the silhouettes [pixels]", "material", common.number(0.0, 64.0), "0 to 64 pixels"),
        Parameter("hierarchy", "equal", "equal: a ring of `width` texels on every MIP level; box: level 0, box-filtered",
                  "technique", common.choice("equal", "box"), "equal or box"),
        npr.VIEWER,
        npr.FILTER,
        npr.FRAME,
        npr.map_size(None, "; default: the smallest power of two as wide as the picture, at most 4096"),
    ),
    assumptions=(
        *npr.ASSUMPTIONS,
        "Hardware's λ is the footprint along its longer axis: exact where both curvatures are alike, a wider line elsewhere.",
        "Between two levels the line is up to 8.6 % wider than on them: 1 + t for 2^t.",
    ),
    stands_for=npr.stands_for("silhouette"),
    target_bsdf=npr.target_bsdf("silhouette", "width"),
    target="lookup",
    shader=Path(__file__).with_suffix(".glsl"),
    library=npr.LIBRARY,
    prepare=npr.prepare("silhouette"),
    twin=npr.twin("silhouette"),
    twin_bound_reason=npr.TWIN_REASON,
    twin_settings={"filter": "finest", "map_size": 64, "width": 4.0},
    defines=npr.defines,
    fill=fill,
)  # fmt: skip
