"""Scene-equivalence certificate: before any score, both renderers must see the same thing.

Coverage, depth, normals and background are compared on the same sub-pixel rays, so nothing here is noise: what differs is
a camera, mesh, winding, orientation or texel-filtering mistake, and it would have been counted as a lighting error.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from evalsuite.scene.model import GBuffer

#: Coverage: both rasterise the same triangles at the same sub-sample positions; what remains is float32 rounding of edges
#: that pass through a sub-sample, at most a few in a thousand boundary sub-samples.
MIN_COVERAGE_IOU = 0.999
#: Normals: float32 interpolation of unit normals; a flipped or flat-shaded mesh is off by degrees.
MAX_NORMAL_DEG = 0.1
#: Depth: float32 depth of a few units' distance.
MAX_DEPTH_REL = 1e-4
#: Background: both look the same texels up bilinearly; float32 texture coordinates shift a look-up by up to 2·10⁻⁴ texel
#: on a large map, which on white noise texels is 1.5·10⁻⁴ (measured). A half-texel shift is three orders above.
MAX_BACKGROUND_REL = 2e-3


@dataclass(frozen=True)
class Certificate:
    """coverage_iou: intersection over union of the fractional coverages. normal_deg_p99: 99th percentile angle between
    normals [degrees]. depth_rel_p99: 99th percentile |difference| / depth. background_rel_p99: 99th percentile
    |difference| / (radiance + 1 % of its mean). reasons: what failed, in words."""

    passed: bool
    coverage_iou: float
    normal_deg_p99: float
    depth_rel_p99: float
    background_rel_p99: float
    reasons: tuple[str, ...] = ()

    def to_json(self) -> dict:
        return asdict(self) | {"reasons": list(self.reasons)}


def certify(image: GBuffer, reference: GBuffer) -> Certificate:
    """Compare what the GPU sees (image) with what Mitsuba sees (reference). Never raises for a difference: it says so."""
    if image.coverage.shape != reference.coverage.shape or image.material.shape != reference.material.shape:
        got, expected = image.material.shape, reference.material.shape
        return Certificate(False, 0.0, 180.0, 1.0, 1.0, (f"pictures of {got} against {expected} (materials, height, width)",))
    union = np.maximum(image.material, reference.material).sum(dtype=np.float64)
    both = np.minimum(image.material, reference.material).sum(dtype=np.float64)
    iou = float(both / union) if union > 0 else 1.0

    # Mixed pixels average over two surfaces; interiors are where a difference has one meaning.
    inside = (image.coverage >= 1) & (reference.coverage >= 1)
    inside &= (image.material.max(0) >= 1) & (reference.material.max(0) >= 1)
    if inside.any():
        a, b = image.normal[inside].astype(np.float64), reference.normal[inside].astype(np.float64)
        chord = np.linalg.norm(a - b, axis=-1)  # arccos of a dot product loses half the digits near 1
        normal = float(np.percentile(np.degrees(2 * np.arcsin(np.clip(chord / 2, 0, 1))), 99))
        depth_b = reference.depth[inside].astype(np.float64)
        depth = float(np.percentile(np.abs(image.depth[inside] - depth_b) / np.maximum(np.abs(depth_b), 1e-12), 99))
    else:
        normal = depth = 0.0
    a, b = image.background.astype(np.float64), reference.background.astype(np.float64)
    scale = b.mean(axis=-1, keepdims=True) + 0.01 * b.mean()
    difference = np.abs(a - b)
    background = float(np.percentile(np.divide(difference, scale, out=difference.copy(), where=scale > 0), 99))

    reasons = []
    for name, value, limit, unit, bad in (
        ("coverage IoU", iou, MIN_COVERAGE_IOU, "", not iou >= MIN_COVERAGE_IOU),
        ("normals' 99th percentile", normal, MAX_NORMAL_DEG, "°", not normal <= MAX_NORMAL_DEG),
        ("depth's 99th percentile", depth, MAX_DEPTH_REL, "", not depth <= MAX_DEPTH_REL),
        ("background's 99th percentile", background, MAX_BACKGROUND_REL, "", not background <= MAX_BACKGROUND_REL),
    ):
        if bad:
            reasons.append(f"{name} is {value:.4g}{unit}, limit {limit:g}{unit}")
    return Certificate(not reasons, iou, normal, depth, background, tuple(reasons))
