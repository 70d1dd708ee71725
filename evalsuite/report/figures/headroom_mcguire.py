"""McGuire's constant c in m = log₂(w√3) − ½ log₂(s + 1) + c, without noise: the lobes' integrals by quadrature.

Three truths. About h: the Blinn-Phong BRDF as it is, (s + 8)/8π (n·h)^s n·l. About h, albedo 1: the same over its own integral in
each pixel, so that width and shape alone count. About r: the Phong lobe of the same exponent, cut at the horizon.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evalsuite.compare.headroom_pool import random_effects
from evalsuite.math import cubemap, phong
from evalsuite.report.figures import sphere_view, style
from evalsuite.report.figures.sphere_view import MAPS, Float

EXPONENTS = (5, 10, 20, 50, 100, 250, 500)
FACE, QUADRATURE, PIXELS, PICTURE = 128, 64, 800, 64
OFFSETS = np.linspace(-2.0, 4.0, 49)  # further down, a small sun falls between the pixels looked at
LOBES = {"h": "about h, Blinn-Phong as it is", "h, albedo 1": "about h, albedo 1", "r": "about r, Phong"}
MARKS = {"h": "#D55E00", "h, albedo 1": "#E69F00", "r": "#0072B2"}


def truths(normal: Float, to_view: Float, exponent: float) -> dict[str, Float]:
    """Weights of the radiance of each texel of a QUADRATURE² cubemap in each pixel, (P, T) float32, of each lobe."""
    light = cubemap.texel_directions(QUADRATURE).reshape(-1, 3).astype(np.float32)
    omega = np.tile(cubemap.texel_solid_angles(QUADRATURE).ravel(), 6).astype(np.float32)
    r = phong.reflect(to_view, normal).astype(np.float32)
    normal, to_view = normal.astype(np.float32), to_view.astype(np.float32)  # of a sum of thousands: enough, and half the memory
    cosine = normal @ light.T
    lit = cosine > 0
    # |l + v|² = 2 + 2 l·v, so n·h = (n·l + n·v)/|l + v|.
    half = (cosine + (normal * to_view).sum(-1, keepdims=True)) / np.sqrt(np.maximum(2 + 2 * to_view @ light.T, 1e-12))
    about_h = np.where(lit, phong.blinn_phong_brdf(exponent, half) * cosine * omega, 0.0)
    about_r = np.where(lit, phong.phong_lobe(exponent, r @ light.T) * omega, 0.0)
    return {"h": about_h, "h, albedo 1": about_h / about_h.sum(-1, keepdims=True), "r": about_r}


def data() -> dict[str, Any]:
    """Best c of each map, exponent and lobe, and pooled over maps."""
    normal, to_view, mask = sphere_view.rays(PICTURE)
    chosen = sphere_view.some(mask, PIXELS)
    n, v = normal.reshape(-1, 3)[chosen], to_view.reshape(-1, 3)[chosen]
    r = phong.reflect(v, n)
    cubes = {name: sphere_view.cube(name, FACE) for name in MAPS}
    radiance = {name: _level(cube, QUADRATURE).reshape(-1, 3) for name, cube in cubes.items()}
    best: dict[str, dict[str, list[dict[str, Any]]]] = {lobe: {name: [] for name in MAPS} for lobe in LOBES}
    for exponent in EXPONENTS:
        levels = phong.exponent_to_lod(exponent, FACE) + OFFSETS
        looked_up = {name: np.stack([cube.lookup(r, float(m)) for m in levels]) for name, cube in cubes.items()}
        # A flat look-up past an end of the chain tells no two offsets apart.
        useful = (levels >= 0) & (levels <= cubes[MAPS[0]].max_level)
        for lobe, weights in truths(n, v, float(exponent)).items():
            for name in MAPS:
                truth = weights @ radiance[name]
                errors = np.sqrt(np.square(looked_up[name] - truth).mean((1, 2)))[useful]
                c = sphere_view.least(OFFSETS[useful], errors)
                published = float(np.interp(0.0, OFFSETS[useful], errors))
                scale = float(truth.mean())
                best[lobe][name].append({
                    "exponent": exponent, "c": c, "open": bool(np.isclose(c, OFFSETS[useful][[0, -1]]).any()),
                    "rel_rmse": float(errors.min()) / scale, "published_rel_rmse": published / scale,
                })  # fmt: skip
    pooled = {lobe: _pooled(by_map) for lobe, by_map in best.items()}
    about_r = {f"{lobe} − r": _difference(best[lobe], best["r"]) for lobe in ("h", "h, albedo 1")}
    return {"best": best, "measured": {"face_texels": FACE, "pixels": len(chosen), "maps": list(MAPS), "lobes": LOBES,
                                       "best_c": best, "pooled_over_maps": pooled, "difference": about_r}}  # fmt: skip


def _level(cube: cubemap.SeamlessCube, width: int) -> Float:
    return next(level for level in cube.levels if level.shape[1] == width)


def _over(values: list[float]) -> dict[str, Any]:
    """Random effects of one value a map; no interval for fewer than two."""
    if len(values) < 2:
        return {"value": values[0] if values else None, "ci95": [None, None], "maps": len(values)}
    mean, _, between = random_effects(values, [0.0] * len(values))
    return mean.to_json() | {"between_maps": between, "maps": len(values)}


def _difference(first: dict[str, list[dict[str, Any]]], second: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    """c of the first less c of the second under the same map and exponent, where neither is open, over the maps' means."""
    pairs = {name: list(zip(cells, second[name], strict=True)) for name, cells in first.items()}
    closed = [[a["c"] - b["c"] for a, b in some if not (a["open"] or b["open"])] for some in pairs.values()]
    return _over([float(np.mean(values)) for values in closed if values])


def _pooled(by_map: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    """Random effects over the maps' means, of cells with a best value; and for each exponent over the maps."""
    closed = {name: [cell["c"] for cell in cells if not cell["open"]] for name, cells in by_map.items()}
    out = _over([float(np.mean(values)) for values in closed.values() if values])
    by_exponent = {
        str(s): _over([cells[k]["c"] for cells in by_map.values() if not cells[k]["open"]]) for k, s in enumerate(EXPONENTS)
    }
    return out | {"by_exponent": by_exponent, "open_cells": sum(cell["open"] for cells in by_map.values() for cell in cells)}


def draw(data: dict[str, Any]) -> Any:
    """c over the exponent for each lobe: a line a map, the pooled value and its interval."""
    figure = style.figure(12, 4.6)
    panels = figure.subplots(1, len(LOBES), sharey=True)
    for axes, (lobe, title) in zip(panels, LOBES.items(), strict=True):
        for name, cells in data["best"][lobe].items():
            c = np.array([cell["c"] for cell in cells])
            closed = np.array([not cell["open"] for cell in cells])
            colour = sphere_view.COLOURS[name]
            axes.plot(EXPONENTS, c, color=colour, linewidth=1.0, alpha=0.8, label=name)
            axes.plot(np.array(EXPONENTS)[closed], c[closed], "o", color=colour, markersize=4)
            axes.plot(np.array(EXPONENTS)[~closed], c[~closed], "o", color=colour, markersize=5, fillstyle="none")
        pooled = data["measured"]["pooled_over_maps"][lobe]
        lo, hi = pooled["ci95"]
        axes.axhspan(lo, hi, color=MARKS[lobe], alpha=0.15, linewidth=0)
        axes.axhline(pooled["value"], color=MARKS[lobe])
        axes.axhline(0.0, **style.THEORY)
        axes.set_xscale("log")
        axes.set_xlabel("exponent s, N")
        axes.grid(color="0.9", linewidth=0.7)
        axes.set_title(f"{title}\nc = {pooled['value']:+.2f} [{lo:+.2f}, {hi:+.2f}]", loc="left", fontsize=10)
    panels[0].set_ylabel("best c [levels]; published: 0")
    panels[-1].legend(frameon=False, fontsize=7)
    figure.suptitle("Best constant in McGuire's level; hollow: at an end of the MIP chain; band: 95 % over maps", fontsize=9)
    return figure
