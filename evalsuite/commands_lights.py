"""`evalsuite decompose`: an environment map's area lights and remainder, as files and pictures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.execute.local import Lane
from evalsuite.image import exr
from evalsuite.image.color import luminance
from evalsuite.image.files import replacing
from evalsuite.lights.decompose import check, decompose, flat_discs
from evalsuite.lights.description import described
from evalsuite.lights.model import Decomposition, DecompositionSettings
from evalsuite.math.disc_coverage import tangent_frame
from evalsuite.math.sphere import direction_to_latlong, latlong_solid_angles
from evalsuite.scene import builtin


def decompose_environment(name: str, directory: Path, settings: DecompositionSettings, repair: bool) -> dict:
    """Write lights.json, remainder.exr, lights.exr, discs.png, convergence.json and convergence.png into a folder (made where
    it is not there); returns what convergence.json holds. Raises EvalsuiteError for bad input, OSError for such a folder."""
    check(settings)
    lane = Lane("reference")  # a broken picture file can take a process down
    try:
        return lane.call("evalsuite.commands_lights:_decompose", builtin.environment_path(name), directory, settings, repair)
    finally:
        lane.close()


def _decompose(path: Path, directory: Path, settings: DecompositionSettings, repair: bool) -> dict:
    from evalsuite.scene.environment import read_environment

    environment = read_environment(path, repair=repair)
    found = decompose(environment.radiance, settings)
    power = float(luminance(found.integral))
    lights = described(found)
    before = np.einsum("yxc,yx->c", environment.radiance.astype(np.float64), latlong_solid_angles(*found.shape))
    residual = np.divide(found.integral, before, out=np.ones(3), where=before > 0) - 1.0
    facts = {
        "file": str(path),
        "width": found.shape[1],
        "height": found.shape[0],
        "settings": {name: getattr(settings, name) for name in settings.__dataclass_fields__},
        "lights": len(lights),
        "share": float(luminance(found.irradiance)) / power if power > 0 else 0.0,
        "energy_residual": [float(x) for x in residual],
        "search": _with_shares(found, power),
        "notes": [*environment.notes, *environment.remarks],
    }
    directory.mkdir(parents=True, exist_ok=True)
    exr.write(directory / "remainder.exr", found.remainder)
    exr.write(directory / "lights.exr", flat_discs(found))
    for file, content in (("lights.json", lights), ("convergence.json", facts)):
        with replacing(directory / file) as place:
            place.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    for file, drawing in (("discs.png", draw_discs(environment.radiance, found)), ("convergence.png", draw_search(facts))):
        with replacing(directory / file) as place:
            drawing.savefig(place, format="png", dpi=150, metadata={"Software": None})
    return facts


def _with_shares(found: Decomposition, power: float) -> list[dict]:
    """The search's table with each light's share of the map's luminance, and all shares so far."""
    rows, so_far = [], 0.0
    for number, row in enumerate(found.table, 1):
        share = float(luminance(np.array(row.get("irradiance", (0.0, 0.0, 0.0))))) / power if power > 0 else 0.0
        so_far += share if row["kept"] else 0.0
        rows.append({"light": number, **row, "share": share, "share_so_far": so_far})
    return rows


def draw_discs(radiance: NDArray, found: Decomposition) -> Any:
    """The map with the lights' outlines, as a matplotlib Figure. radiance: (H, W, 3)."""
    from evalsuite.report.figures.style import figure

    drawing = figure(8.0, 4.6)
    axes = drawing.add_subplot()
    level = float(np.quantile(luminance(radiance), 0.9)) or float(radiance.max()) or 1.0
    shown = np.clip(radiance / (2.0 * level), 0.0, 1.0) ** (1 / 2.2)
    axes.imshow(shown, extent=(0, 360, 180, 0), interpolation="nearest", aspect="equal")
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    for number, light in enumerate(found.lights, 1):
        centre, r = np.asarray(light.direction), light.angular_radius
        t, b = tangent_frame(centre)
        rim = np.cos(r) * centre + np.sin(r) * (np.cos(around)[:, None] * t + np.sin(around)[:, None] * b)
        u, v = (x * scale for x, scale in zip(direction_to_latlong(rim), (360.0, 180.0), strict=True))
        u[1:][np.abs(np.diff(u)) > 180.0] = np.nan  # across the seam
        axes.plot(u, v, color="black", linewidth=2.6)
        axes.plot(u, v, color="#F0E442", linewidth=1.2)
        x, y = (float(c) * s for c, s in zip(direction_to_latlong(centre), (360.0, 180.0), strict=True))
        axes.annotate(str(number), (x, y), (9, 9), textcoords="offset points", color="black", ha="center", va="center",
                      fontsize=7, bbox={"boxstyle": "circle,pad=0.2", "fc": "#F0E442", "lw": 0})  # fmt: skip
    axes.set_xlabel("longitude φ [degrees], 0 looks along −z")
    axes.set_ylabel("angle θ from +y [degrees]")
    axes.set_xticks(range(0, 361, 60))
    axes.set_yticks(range(0, 181, 30))
    share = float(luminance(found.irradiance)) / max(float(luminance(found.integral)), 1e-300)
    count = f"{len(found.lights)} light{'' if len(found.lights) == 1 else 's'}"
    axes.set_title(f"{count} with {share:.1%} of the energy; white is {2.0 * level:.3g} W m⁻² sr⁻¹", fontsize=10)
    return drawing


def draw_search(facts: dict) -> Any:
    """Each light's share of the map's energy, and all so far, as a matplotlib Figure."""
    from evalsuite.report.figures.style import COLOURS, figure

    drawing = figure(7.0, 3.6)
    axes = drawing.add_subplot()
    rows = [row for row in facts["search"] if row["kept"]]
    numbers = [row["light"] for row in rows]
    axes.bar(numbers, [100 * row["share"] for row in rows], color=COLOURS["cube"], label="each light")
    axes.plot(numbers, [100 * row["share_so_far"] for row in rows], "o-", color=COLOURS["sphere"], label="all so far")
    axes.set_xlabel("light, in the order found")
    axes.set_ylabel("share of the map's luminance [%]")
    axes.set_ylim(0, None if rows else 1)
    axes.set_xticks(numbers)
    axes.grid(axis="y", color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)
    if rows:
        axes.legend(frameon=False)
    else:
        axes.text(0.5, 0.5, "no light stands out", transform=axes.transAxes, ha="center")
    return drawing
