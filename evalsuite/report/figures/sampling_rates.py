"""001 Fig 4: how densely sphere, cube and dual paraboloid maps of as many texels sample the directions.

Two quantities, since they tell different stories. Solid angle: a sphere map's texels all have the same (4 dA), a cube's differ by
3√3, a paraboloid's by 4. Linear rate along the worse and the better direction on the sphere: a sphere map's goes to zero along
the radius towards −v₀, where it grows without bound along the rim.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.math import cubemap, paraboloid, sphere_map
from evalsuite.report.figures import style

FACE = 256  # texels along a cube's edge; the other maps hold as many texels within their circles
BINS = 180
LABELS = {"sphere": "sphere map", "cube": "cube map", "paraboloid": "dual paraboloid map"}
Float = NDArray[np.float64]


def _disc(radius: float) -> tuple[int, float]:
    """Size [texels] and border of a map with a circle of that radius and room around it."""
    size = 2 * int(np.ceil(radius + 1))
    return size, 0.5 * size - radius


def whole(size: int, border: float, room: float = 0.0) -> NDArray[np.bool_]:
    """Texels that the circle does not cut, with `room` texels to spare, (n, n)."""
    far = (np.abs(np.arange(size) + 0.5 - 0.5 * size) + 0.5 + room) / (0.5 * size - border)
    return np.hypot(far[None, :], far[:, None]) <= 1.0


def _linear_rates(directions: Float) -> Float:
    """Texels per degree along the worse and the better direction, (n, n, 2), of a map with directions (n, n, 3): the inverse
    singular values of the step from texel to texel, by central differences; NaN on the border and where a step is none."""
    rates = np.full((*directions.shape[:2], 2), np.nan)
    across = 0.5 * (directions[1:-1, 2:] - directions[1:-1, :-2])
    up = 0.5 * (directions[2:, 1:-1] - directions[:-2, 1:-1])
    trace, twist = (across**2 + up**2).sum(-1), (across * up).sum(-1)
    spread = np.sqrt(((across**2 - up**2).sum(-1)) ** 2 + 4.0 * twist**2)
    squares = 0.5 * np.stack([trace + spread, trace - spread], -1)  # of the singular values, larger first
    moves = squares[..., 1] > 0
    rates[1:-1, 1:-1][moves] = 1.0 / np.degrees(np.sqrt(squares[moves]))
    return rates


def _map(directions: Float, omega: Float, inside: NDArray[np.bool_]) -> dict[str, Float]:
    """What is shown of one map: its picture of ω over the mean, and for each whole texel θ from +z, ω over the mean and rates."""
    mean = 4.0 * np.pi / (6 * FACE**2)
    rates = np.stack([_linear_rates(d) for d in directions])
    use = inside & np.isfinite(rates).all(-1)
    return {
        "picture": np.where(inside, omega / mean, np.nan),
        "theta": np.degrees(np.arccos(np.clip(directions[use][:, 2], -1, 1))),
        "omega": np.broadcast_to(omega / mean, use.shape)[use],
        "rates": rates[use],
    }


def data() -> dict[str, Any]:
    """The three maps and the ratios of their largest and smallest texel, on ever finer maps."""
    maps = {}
    size, border = _disc(sphere_map.matched_radius(FACE))
    maps["sphere"] = _map(
        sphere_map.texel_directions(size, border)[None],
        sphere_map.texel_solid_angles(size, border),
        whole(size, border, 1.0)[None],
    )
    everywhere = np.ones((6, FACE, FACE), bool)
    maps["cube"] = _map(cubemap.texel_directions(FACE), cubemap.texel_solid_angles(FACE), everywhere)
    size, border = _disc(paraboloid.matched_radius(FACE))
    inside = np.broadcast_to(whole(size, border, 1.0), (2, size, size))
    maps["paraboloid"] = _map(paraboloid.texel_directions(size, border), paraboloid.texel_solid_angles(size, border), inside)
    return {"maps": maps, "measured": {
        "cube_face_texels": FACE,
        "texels": 6 * FACE**2,
        "mean_solid_angle_sr": 4.0 * np.pi / (6 * FACE**2),
        "solid_angle_largest_over_smallest": {
            "cube": {str(w): ratio(cubemap.texel_solid_angles(w)) for w in (64, 256, 1024)},
            "cube_in_the_paper": 3.0 * np.sqrt(3.0),
            "paraboloid": {str(n): ratio(paraboloid.texel_solid_angles(n)[whole(n, 0.0)]) for n in (128, 512, 2048)},
            "paraboloid_in_the_papers": 4.0,
            "sphere": {str(n): ratio(sphere_map.texel_solid_angles(n)[whole(n, 0.0)]) for n in (128, 512, 2048)},
        },
        "linear_rate_texels_per_degree": {
            name: {"least": float(m["rates"][:, 0].min()), "most": float(m["rates"][:, 1].max())} for name, m in maps.items()
        },
    }}  # fmt: skip


def ratio(omega: Float) -> float:
    """The largest solid angle over the smallest."""
    return float(omega.max() / omega.min())


def draw(data: dict[str, Any]) -> Any:
    """Above, ω/mean in each map's own layout; below, ω/mean and linear rate over θ."""
    figure = style.figure(11, 7.4)
    above, below = figure.subfigures(2, 1, height_ratios=(1, 1.6))
    _draw_pictures(above, data)
    left, right = below.subplots(1, 2)
    for name, one in data["maps"].items():
        colour, label = style.COLOURS[name], LABELS[name]
        low, high = _extent(one["theta"], one["omega"])
        left.fill_between(_centres(), low, high, color=colour, alpha=0.35, linewidth=0)
        left.plot(_centres(), low, color=colour, label=label)
        left.plot(_centres(), high, color=colour)
        worse, better = (_extent(one["theta"], one["rates"][:, k]) for k in (0, 1))
        right.fill_between(_centres(), worse[0], better[1], color=colour, alpha=0.2, linewidth=0)
        right.plot(_centres(), worse[0], color=colour, label=f"{label}: worse direction")
        right.plot(_centres(), better[1], color=colour, linestyle=(0, (4, 2)), label="better direction")
    # What the texels show as far as they go: dρ/dθ = ½ cos(θ/2) along the radius, ρ/sin θ = 1/(2 cos(θ/2)) along the rim.
    theta = np.linspace(0, 179.5, 360)
    radial = np.radians(1.0) * sphere_map.matched_radius(FACE) * 0.5 * np.cos(np.radians(theta) / 2)
    right.plot(theta, radial, label="½ R cos(θ/2) and ½ R/cos(θ/2)", zorder=3, **style.THEORY)
    right.plot(theta, (np.radians(0.5) * sphere_map.matched_radius(FACE)) ** 2 / radial, zorder=3, **style.THEORY)
    for axes in (left, right):
        style.angle_axis(axes, 180)
    left.set_ylim(0, 2.15)
    left.set_ylabel("solid angle of a texel over the mean of all")
    left.set_title("Solid angle (band: all azimuths)", loc="left")
    left.legend(frameon=False, loc="lower center", ncols=3, fontsize=8)
    right.set_yscale("log")
    right.set_ylim(0.2, 60)
    right.set_ylabel("linear sampling rate [texels per degree]")
    right.set_title(f"Linear sampling rate ({6 * FACE**2} texels each)", loc="left")
    right.legend(frameon=False, fontsize=7, ncols=1)
    return figure


def _draw_pictures(figure: Any, data: dict[str, Any]) -> None:
    """The maps in false colour on one scale, with the ratio of their extremes."""
    measured = data["measured"]["solid_angle_largest_over_smallest"]
    ratios = {
        "sphere": "all equal",
        "cube": f"max/min {measured['cube']['1024']:.3f} at 1024² (3√3 = {3 * 3**0.5:.3f})",
        "paraboloid": f"max/min {measured['paraboloid']['2048']:.3f} at 2048² (4)",
    }
    panels = figure.subplots(1, 3, width_ratios=(1, 4 / 3, 2))
    shown = None
    for axes, (name, one) in zip(panels, data["maps"].items(), strict=True):
        picture = one["picture"]
        layout = {"sphere": picture[0], "cube": _cross(picture), "paraboloid": np.concatenate(list(picture), 1)}[name]
        shown = axes.imshow(layout, origin="lower", vmin=0, vmax=2, cmap="viridis", interpolation="nearest")
        axes.set_axis_off()
        axes.set_title(f"{LABELS[name]}\n{ratios[name]}", fontsize=9, loc="left")
    figure.colorbar(shown, ax=list(panels), shrink=0.8, label="solid angle over the mean")


def _cross(picture: Float) -> Float:
    """The six faces, each with this picture, as an unfolded cube."""
    width = picture.shape[-1]
    out = np.full((3 * width, 4 * width), np.nan)
    for row, column in ((1, 0), (1, 1), (1, 2), (1, 3), (0, 1), (2, 1)):
        out[row * width : (row + 1) * width, column * width : (column + 1) * width] = picture[0]
    return out


def _centres() -> Float:
    return (np.arange(BINS) + 0.5) * 180.0 / BINS


def _extent(theta: Float, value: Float) -> tuple[Float, Float]:
    """Smallest and largest value in each bin of θ, NaN where there is none."""
    low, high = np.full(BINS, np.inf), np.full(BINS, -np.inf)
    index = np.minimum((theta * BINS / 180.0).astype(int), BINS - 1)
    np.minimum.at(low, index, value)
    np.maximum.at(high, index, value)
    empty = ~np.isfinite(low)
    low[empty] = high[empty] = np.nan
    return low, high
