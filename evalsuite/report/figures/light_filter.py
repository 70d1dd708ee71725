"""004 Fig 1: the filter that finds lights, its weight over the angle from its centre, and which of its sizes a bright disc gets.

A filter of inner radius r_i and outer radius r_o = r_i/0.75 weighs solid angle by 1 within r_i and by −10 from there to r_o, over
its angular extent 2 r_o. With Ω(r) = 2π(1 − cos r), about a disc of radius ρ and radiance 1 before black it responds with
[11 Ω(min(r_i, ρ)) − 10 Ω(min(r_o, ρ))]/(2 r_o), which is largest at r_i = ρ.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.lights.decompose import PAPER, decompose, flat_discs, radii
from evalsuite.lights.filter_bank import Pyramid
from evalsuite.lights.model import Decomposition, Light
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles
from evalsuite.report.claims.intervals import mean
from evalsuite.report.figures import style
from evalsuite.report.numbers import measured

Float = NDArray[np.float64]

#: Rows of the maps that are filtered; the disc whose responses are shown [degrees]; surroundings over its radiance; discs tried.
HEIGHT, DISC_DEG, GROUNDS, DISCS = 256, 7.0, (0.0, 1 / 40, 1 / 10), 32
SHOWN_DEG = 15.0  # inner radius of the filter drawn


def solid_angle(radius: Any) -> Float:
    """Ω [sr] of a disc of this radius [rad]."""
    return 4.0 * np.pi * np.sin(0.5 * np.asarray(radius)) ** 2


def weights(theta: Float, inner: float) -> Float:
    """1 within the inner radius, −10 within the outer one [rad], 0 outside."""
    return np.where(theta <= inner, 1.0, np.where(theta <= inner / PAPER.inner, PAPER.surround, 0.0))


def cumulative(theta: Float, inner: float) -> Float:
    """∫ weight dΩ from the centre to θ, over the centre's solid angle: 1 at r_i, 11 − 10 Ω(r_o)/Ω(r_i) from r_o on."""
    centre, surround = np.minimum(theta, inner), np.clip(theta, inner, inner / PAPER.inner)
    return (solid_angle(centre) + PAPER.surround * (solid_angle(surround) - solid_angle(inner))) / solid_angle(inner)


def response(inner: Any, disc: float, ground: float) -> Float:
    """Of filters about the centre of a disc of radius `disc` [rad] and radiance 1, before radiance `ground`."""
    inner = np.asarray(inner, np.float64)
    outer = inner / PAPER.inner

    def energy(radius: Float) -> Float:
        return ground * solid_angle(radius) + (1.0 - ground) * solid_angle(np.minimum(radius, disc))

    return (energy(inner) + PAPER.surround * (energy(outer) - energy(inner))) / (2.0 * outer)


def disc_map(direction: Any, radius: float, ground: float) -> Float:
    """(H, 2H, 3) a disc of radiance 1, texels on its edge in proportion, before `ground`."""
    light = Light(tuple(direction), radius, (float(solid_angle(radius)),) * 3)
    disc = flat_discs(Decomposition((light,), np.zeros((HEIGHT, 2 * HEIGHT, 3), np.float32)), 8)
    return ground + (1.0 - ground) * disc.astype(np.float64)


def data() -> dict[str, Any]:
    sizes, disc = radii(PAPER), float(np.radians(DISC_DEG))
    at = HEIGHT // 3 * 2 * HEIGHT + HEIGHT  # a texel's centre, off the equator
    centre = latlong_directions(HEIGHT, 2 * HEIGHT).reshape(-1, 3)[at]
    responses, picked = {}, {}
    for ground in GROUNDS:
        texels = disc_map(centre, disc, ground)
        grid = Pyramid(texels[..., 0] * latlong_solid_angles(HEIGHT, 2 * HEIGHT)).levels[0]
        inner, outer = ([float(grid.disc_sums(np.array([at]), r, 4)[0]) for r in bank] for bank in (sizes, sizes / PAPER.inner))
        responses[ground] = (np.array(inner) + PAPER.surround * np.subtract(outer, inner)) / (2.0 * sizes / PAPER.inner)
        lights = decompose(texels).lights
        picked[ground] = lights[0].angular_radius if lights else None

    rng = np.random.default_rng(1)
    of_disc, of_light = np.exp(rng.uniform(*np.log(np.radians([2.0, 16.0])), DISCS)), np.zeros(DISCS)
    for k in range(DISCS):
        direction = rng.standard_normal(3)
        lights = decompose(disc_map(direction / np.linalg.norm(direction), of_disc[k], 0.001)).lights
        of_light[k] = lights[0].angular_radius if lights else np.nan
    ratio = of_light / of_disc
    return {
        "sizes": sizes, "responses": responses, "picked": picked, "discs": of_disc, "lights": of_light,
        "measured": {
            "inner_over_outer": PAPER.inner,
            "weights": [1.0, PAPER.surround],
            "radii_deg": np.degrees(sizes).tolist(),
            "step": float(sizes[1] / sizes[0]),
            "disc_deg": DISC_DEG,
            "picked_deg": {f"{ground:g}": None if r is None else float(np.degrees(r)) for ground, r in picked.items()},
            "light_over_disc": mean(ratio),
            "least_and_most": [float(ratio.min()), float(ratio.max())],
        },
    }  # fmt: skip


def draw(data: dict[str, Any]) -> Any:
    figure = style.figure(13.0, 3.9)
    axes = figure.subplots(1, 4, width_ratios=(0.8, 1, 1.1, 1))
    _draw_filter(axes[0])
    _draw_profile(axes[1])
    _draw_responses(axes[2], data)
    _draw_picked(axes[3], data)
    return figure


def _draw_filter(axes: Any) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(Circle((0, 0), 1.0, facecolor="0.8", edgecolor="black"))
    axes.add_patch(Circle((0, 0), PAPER.inner, facecolor="white", edgecolor="black"))
    axes.text(0, 0.25, "+1", ha="center", va="center", fontsize=13)
    axes.text(0, 0.87, f"−{-PAPER.surround:g}", ha="center", va="center", fontsize=11)
    for angle, radius, word in ((200, PAPER.inner, "$r_i$"), (-40, 1.0, "$r_o$")):
        x, y = radius * np.cos(np.radians(angle)), radius * np.sin(np.radians(angle))
        axes.annotate("", (x, y), (0, 0), arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0})
        axes.text(0.5 * x, 0.5 * y - 0.04, word, ha="center", va="top", fontsize=11)
    axes.set_xlim(-1.1, 1.1)
    axes.set_ylim(-1.1, 1.1)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"The filter: $r_i$ = {PAPER.inner:g} $r_o$", fontsize=9, loc="left")


def _draw_profile(axes: Any) -> None:
    inner = float(np.radians(SHOWN_DEG))
    theta = np.linspace(0.0, 1.25 * inner / PAPER.inner, 1000)
    axes.plot(np.degrees(theta), weights(theta, inner), color=style.SERIES[0], label="weight")
    axes.plot(np.degrees(theta), cumulative(theta, inner), color=style.SERIES[1], linestyle="--",
              label="its integral to θ\nover Ω($r_i$)")  # fmt: skip
    axes.axhline(0.0, color="0.6", linewidth=0.7)
    for x, word in ((SHOWN_DEG, "$r_i$"), (SHOWN_DEG / PAPER.inner, "$r_o$")):
        axes.axvline(x, color="0.8", linewidth=0.7)
        axes.text(x, 1.6, word, ha="center", fontsize=9)
    axes.set_ylim(-11, 3)
    axes.set_xlim(0, np.degrees(theta[-1]))
    axes.set_xlabel("angle θ from the centre [degrees]")
    axes.set_ylabel("weight; integral [relative to the centre's]")
    axes.set_title(f"Over the angle, $r_i$ = {SHOWN_DEG:g}°", fontsize=9, loc="left")
    axes.legend(frameon=False, fontsize=7.5, loc="lower left")


def _draw_responses(axes: Any, data: dict[str, Any]) -> None:
    disc, fine = np.radians(DISC_DEG), np.geomspace(data["sizes"][0], data["sizes"][-1], 800)
    top = float(response(disc, disc, 0.0))
    for colour, (ground, values) in zip(style.SERIES, data["responses"].items(), strict=False):
        found = data["picked"][ground]
        name = "before black" if ground == 0 else f"before 1/{1 / ground:.0f} of its radiance"
        name += "" if found is not None else ": no light"
        axes.plot(np.degrees(fine), response(fine, disc, ground) / top, color=colour, label=name)
        axes.plot(np.degrees(data["sizes"]), values / top, "o", color=colour, markersize=3)
        if found is not None:
            axes.plot(
                np.degrees(found), response(found, disc, ground) / top, "o", color=colour, markersize=9, markerfacecolor="none"
            )
    axes.axvline(DISC_DEG, color="0.6", linewidth=0.7, linestyle=":")
    axes.axhline(0.0, color="0.6", linewidth=0.7)
    axes.set_xscale("log")
    axes.set_xticks([2, 4, 7, 10, 16], labels=["2", "4", "7", "10", "16"])
    axes.minorticks_off()
    axes.set_ylim(-1.5, 2.0)
    axes.set_xlabel("inner radius $r_i$ of the filter [degrees]")
    axes.set_ylabel("response over the largest before black")
    axes.set_title(
        f"Response at a disc of radius {DISC_DEG:g}°\n(line: closed form; dots: on a map; ring: the light)",
        fontsize=9,
        loc="left",
    )
    axes.legend(frameon=False, fontsize=7.5, loc="upper left")


def _draw_picked(axes: Any, data: dict[str, Any]) -> None:
    found = data["measured"]
    ends = np.array([1.8, 17.0])
    axes.fill_between(ends, ends, ends * found["step"], color="0.9", label="one size of the bank more")
    axes.plot(ends, ends, label="its own radius", **style.THEORY)
    axes.plot(
        np.degrees(data["discs"]), np.degrees(data["lights"]), "o", color=style.SERIES[0], markersize=4, label="light found"
    )
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_ticks([2, 4, 8, 16], labels=["2", "4", "8", "16"])
    axes.minorticks_off()
    axes.set_xlabel("radius of a bright disc [degrees]")
    axes.set_ylabel("radius of its light [degrees]")
    axes.set_title(f"Light over disc, mean of {DISCS}:\n{measured(found['light_over_disc'])}", fontsize=9, loc="left")
    axes.legend(frameon=False, fontsize=7.5, loc="upper left")
