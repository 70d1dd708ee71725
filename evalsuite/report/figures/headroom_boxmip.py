"""Box-filtered MIPs at a LOD bias: which Phong exponent N each bias b comes nearest to, and the best b for each N.

Both ways on the scene `sphere` under the built-in maps, in float64. λ is the hardware's own for a picture of PICTURE² pixels and
faces of FACE² texels; another size of either moves every b by the difference of mean λ, log₂ of the ratio.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evalsuite.compare.headroom_pool import random_effects
from evalsuite.gpu.techniques.glossy_boxmip import fit_exponent
from evalsuite.math import cubemap, phong
from evalsuite.report.figures import sphere_view, style
from evalsuite.report.figures.sphere_view import MAPS, Float

FACE, PICTURE, PIXELS, QUADRATURE = 128, 256, 240, 64
BIASES = (1.0, 2.0, 2.25, 3.0, 4.0, 5.0)
EXPONENTS = (10, 20, 50, 100, 225, 500)
#: Kautz, Daubert and Seidel, Fig 5.
PAPER = {"bias": 2.25, "exponent": 225.0}
_GRID = np.linspace(-1.0, 7.0, 65)


def data() -> dict[str, Any]:
    """N over b and b over N of each map, pooled over maps, and what sizes the paper's pair would need."""
    normal, to_view, mask = sphere_view.rays(PICTURE)
    lod, inside = sphere_view.hardware_lod(normal, to_view, mask, FACE)
    chosen = sphere_view.some(inside, PIXELS)
    mean_lod = float(lod[inside].mean())
    r = phong.reflect(to_view, normal)[:-1, :-1].reshape(-1, 3)[chosen]
    at = lod.ravel()[chosen]
    exponents: dict[str, list[float]] = {}
    biases: dict[str, list[float]] = {}
    for name in MAPS:
        cube = sphere_view.cube(name, FACE)
        exponents[name] = [fit_exponent(cube, r, cube.lookup(r, at + b))["exponent"] for b in BIASES]
        looked_up = np.stack([cube.lookup(r, at + b) for b in _GRID])
        biases[name] = [_best_bias(looked_up, _lobe(cube, r, float(n))) for n in EXPONENTS]
    by_bias = [_over([np.log2(found[k] + 1) for found in exponents.values()]) for k in range(len(BIASES))]
    by_exponent = [_over([found[k] for found in biases.values()]) for k in range(len(EXPONENTS))]
    matched = [float(phong.exponent_to_lod(n, FACE)) - mean_lod for n in EXPONENTS]
    return {"exponents": exponents, "biases": biases, "measured": {
        "face_texels": FACE,
        "picture_pixels": PICTURE,
        "sphere_pixels": int(np.ptp(np.flatnonzero(mask.any(0)))) + 1,
        "mean_lambda": mean_lod,
        "maps": list(MAPS),
        "exponent_of_bias": [
            {"bias": b, "exponent": 2 ** one["value"] - 1, "ci95": [2**end - 1 for end in one["ci95"]],
             "by_map": {name: found[k] for name, found in exponents.items()}}
            for k, (b, one) in enumerate(zip(BIASES, by_bias, strict=True))
        ],
        "bias_of_exponent": [
            {"exponent": n, "bias": one["value"], "ci95": one["ci95"], "solid_angle_match": m,
             "by_map": {name: found[k] for name, found in biases.items()}}
            for k, (n, one, m) in enumerate(zip(EXPONENTS, by_exponent, matched, strict=True))
        ],
        "paper": PAPER | _needed(by_exponent[EXPONENTS.index(225)], matched[EXPONENTS.index(225)], mask),
    }}  # fmt: skip


def _lobe(cube: cubemap.SeamlessCube, r: Float, exponent: float) -> Float:
    """The Phong lobe's mean of the map about r, the whole lobe, (P, 3)."""
    level = next(level for level in cube.levels if level.shape[1] == QUADRATURE)
    omega = np.tile(cubemap.texel_solid_angles(QUADRATURE).ravel(), 6)
    weights = phong.phong_lobe(exponent, r @ cubemap.texel_directions(QUADRATURE).reshape(-1, 3).T) * omega
    return weights @ level.reshape(-1, 3) / weights.sum(-1, keepdims=True)


def _best_bias(looked_up: Float, truth: Float) -> float:
    return sphere_view.least(_GRID, np.square(looked_up - truth).mean((1, 2)))


def _over(values: list[float]) -> dict[str, Any]:
    return random_effects(values, [0.0] * len(values))[0].to_json()


def _needed(best: dict[str, Any], matched: float, mask: Any) -> dict[str, Any]:
    """By how many levels mean λ would have to be larger for the paper's b to be the best for its N, and the sphere's diameter
    [pixels] that has it so at some face sizes: λ grows by one where the face doubles or the sphere is half as large."""
    diameter = int(np.ptp(np.flatnonzero(mask.any(0)))) + 1

    def size(bias: float, face: int) -> float:
        return diameter * (face / FACE) * 2.0 ** -(bias - PAPER["bias"])

    return {
        "best_bias_here": best["value"],
        "ci95": best["ci95"],
        "lambda_shift": best["value"] - PAPER["bias"],
        "sphere_pixels_at_face": {
            str(face): {"value": size(best["value"], face), "ci95": sorted(size(end, face) for end in best["ci95"]),
                        "by_solid_angle": size(matched, face)}
            for face in (64, 128, 256, 512)
        },
    }  # fmt: skip


def draw(data: dict[str, Any]) -> Any:
    """N over b: fits of each map, both ways, the pooled values with intervals, the solid-angle match and the paper's pair."""
    figure = style.figure(7.6, 5.4)
    axes = figure.subplots()
    measured = data["measured"]
    for name in MAPS:
        colour = sphere_view.COLOURS[name]
        axes.plot(BIASES, data["exponents"][name], color=colour, linewidth=0.8, alpha=0.7, label=name)
        axes.plot(data["biases"][name], EXPONENTS, color=colour, linewidth=0.8, alpha=0.7, linestyle=(0, (2, 2)))
    rows = measured["exponent_of_bias"]
    value = np.array([row["exponent"] for row in rows])
    ends = np.maximum(np.array([row["ci95"] for row in rows]), 0.05)
    axes.errorbar(BIASES, value, yerr=np.abs(ends - value[:, None]).T, fmt="o", color="black", capsize=3,
                  label="nearest N of each b")  # fmt: skip
    rows = measured["bias_of_exponent"]
    value = np.array([row["bias"] for row in rows])
    ends = np.array([row["ci95"] for row in rows])
    axes.errorbar(value, EXPONENTS, xerr=np.abs(ends - value[:, None]).T, fmt="s", color="0.45", capsize=3,
                  label="best b for each N")  # fmt: skip
    b = np.linspace(min(BIASES), max(BIASES) + 0.5, 100)
    axes.plot(b, phong.lod_to_exponent(measured["mean_lambda"] + b, FACE), label="equal solid angle", **style.THEORY)
    axes.plot(PAPER["bias"], PAPER["exponent"], "*", markersize=14, color="#D55E00", label="Kautz et al.: b = 2.25 ~ N = 225")
    axes.set_yscale("log")
    axes.set_ylim(1, 3000)
    axes.set_xlabel(f"LOD bias b [levels], faces of {FACE}², sphere {measured['sphere_pixels']} pixels wide "
                    f"(mean λ = {measured['mean_lambda']:.2f})")  # fmt: skip
    axes.set_ylabel("Phong exponent N")
    axes.grid(color="0.9", linewidth=0.7)
    axes.legend(frameon=False, fontsize=8)
    axes.set_title("Box-filtered MIPs: bias and exponent (bars: 95 % over maps)", loc="left")
    return figure
